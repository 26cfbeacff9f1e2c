"""The search for the known parameters: Gauss-Newton with Levenberg's damping on the normal equations.

Slopes are differences of the plant. They are taken anew where a step went otherwise than they promised; else they are
updated by what the step gave. Phases, and where tooth contact begins and ends, have minima by the dozen: see `leaps`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial

import numpy as np

from kbs_process.diagnosis.nominal.costs import ALL, GEARS, OLD, Found, Ground, Predictions
from kbs_process.diagnosis.nominal.leaps import leap, stride
from kbs_process.diagnosis.nominal.tangents import Step, Tangents
from kbs_process.diagnosis.side_by_side import side_by_side
from kbs_process.signals.records import Array

# Tried side by side, as many as a processor's vector has lanes: valleys are as narrow as 1e-8 of what is across them,
# in squares, and each has its own.
_DAMPING = (0.0, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 10.0)
_CHORDS = 3  # corrections of each
_AGREED = 0.9  # gained over promised, above which slopes are only updated
_HALF = 0.5  # of the same, below which slopes of drives alone do not do
_STALLED = 0.1  # of the same, below which a descent goes nowhere
_HOPE = 0.1  # of what is left: a right model's steps, along slopes taken there, gain more
GAIN = 2.0  # of -2 log likelihood: a step that promises less ends a descent
LITTLE = 25.0  # of the same: what exact slopes gained, below which more rounds are not worth their time
SLIGHT = 3e-2  # of all that is left: likewise
EARLY = 2  # steps before the first leap: masses and centres of gravity are right then
_ROUNDS = 10  # steps of a descent at most


class Search(Tangents):
    """How the cost of one experiment under one floor is lowered."""

    def run(self, found: Found, *, leaps: int, least: float = LITTLE) -> Found:
        """Descend; leap to better phases and edges while there are any, at most `leaps` times, and descend again.

        The first leap is made early: what is left out, or a wrong phase, has not yet pulled the others far then. One
        that ends higher than where it left from is taken back.
        """
        left: list[Found] = []
        for number in range(leaps):
            found = self.descend(found, EARLY if number == 0 else _ROUNDS)
            moved = self.leapt(found, smooth=number == 0)
            if moved is not None:
                left.append(found)
                found = moved
        ended = self.descend(found, giving_up=True, least=least)
        before = min(left, key=self.height, default=ended)
        if not self.height(ended) > self.height(before):
            return ended
        return min(ended, self.descend(before, giving_up=True), key=self.height)

    def descend(
        self, found: Found, rounds: int = _ROUNDS, *, most: int = ALL, giving_up: bool = False, least: float = LITTLE
    ) -> Found:
        """Steps until slopes that are all taken anew promise little, or do not keep what they promise.

        All of them, or only those of suspects' own numbers, as `most` says; little is the `least`, or little of what is
        left. When `giving_up`, also until a step does little of what is to be done: no number here does it then, and
        more steps only bend them towards it.
        """
        fresh = found.due if found.due != OLD else min(GEARS, most)
        idle = 0
        for number in range(found.rounds + 1, found.rounds + rounds + 1):
            found = self.with_slopes(found)
            ground = self.ground(found)
            step = self.step(found, ground)
            self.settle(ground.information, np.abs(step.theta - found.theta))
            little = max(least, SLIGHT * self.left(found))
            arrived = step.gained < max(little, _STALLED * step.promised)
            kept = step.gained > _AGREED * step.promised
            if step.gained > 0.0:
                gradients = self.updated(found.gradients, found.theta, step)
                found = replace(found, theta=step.theta, predicted=step.predicted, gradients=gradients)
            freshest = min(most, ALL if self.bodies_moved(found.theta) else GEARS)
            # Slopes that promise what they do not keep may have been taken over the wrong differences.
            idle = idle + 1 if arrived and fresh >= freshest else 0
            found = replace(found, rounds=number, converged=idle > 1 or (arrived and step.promised < little))
            if found.converged:
                break
            hope = _HOPE * self.left(found)
            if giving_up and fresh >= freshest and self.gross(found) and step.gained < hope:
                break
            stale = step.gained < max(little, _HALF * step.promised)
            fresh = OLD if kept else freshest if stale and fresh == GEARS else min(most, GEARS)
            fresh = min(most, ALL) if idle else fresh
            found = replace(found, due=fresh)
        return found

    def leapt(self, found: Found, *, smooth: bool) -> Found | None:
        """Where a stride leads, or else a leap, with slopes; None where neither leads anywhere.

        Where something is missing by far, it makes wrong places as good as right ones.
        """
        found = self.with_slopes(found)
        if not self.gross(found) and (reached := stride(self, found, EARLY, GEARS)):
            return reached
        theta = leap(self, found, smooth=smooth)
        if theta is None:
            return None
        predicted = self.predict([theta], self.everything)[0]
        return Found(theta, predicted, self.slopes(theta, found.gradients), rounds=found.rounds)

    def ground(self, found: Found) -> Ground:
        """The cost around a place; while much is unexplained residuals count for less, so that no step is rash."""
        weight = 1.0 / max(1.0, self.cost(found.theta, found.predicted)[0] / self.rows)
        return Ground(self, found.theta, self.jacobians(found.gradients), weight)

    def step(self, found: Found, ground: Ground) -> Step:
        """One step in the chart of cosines and sines, as damped and as often corrected as lowers the cost most.

        Numbers that make up for each other (stiffness and inertia, of a resonance) lie along valleys, narrow and bent:
        a step along one is off its bottom by more than it gains, and damping makes it as short as the bend is tight.
        From where a step ends the same equations lead back to the bottom (the chord method).
        Source: J. M. Ortega, W. C. Rheinboldt, Iterative Solution of Nonlinear Equations in Several Variables (1970).
        """
        data, excess = self.cost(found.theta, found.predicted)
        pull = ground.pull(found.theta, found.predicted)
        ends = side_by_side(partial(ground.minimum, found.theta, pull), _DAMPING)
        points = dict(zip(_DAMPING, ends, strict=True))
        promised = points[0.0][1]
        best = Step(found.theta, found.predicted, promised, 0.0)
        if promised < GAIN:
            return best
        places = {damping: point for damping, (point, _) in points.items()}
        costs = dict.fromkeys(_DAMPING, np.inf)
        for _ in range(1 + _CHORDS):
            tried = dict(zip(places, self.predict([*places.values()], self.drives), strict=True))
            found_costs = self.costs([*places.values()], [*tried.values()])
            before = costs
            costs = {damping: ground.weight * d + e for damping, (d, e) in zip(places, found_costs, strict=True)}
            least = min(costs, key=costs.__getitem__)
            gained = data + (excess - costs[least]) / ground.weight
            if gained > best.gained:
                best = Step(places[least], tried[least], promised, gained)
            if best.gained > _AGREED * promised or promised < LITTLE:
                break
            # What promises less than another has gained is not worth a correction, nor what the last one made worse.
            worth = [
                damping
                for damping, cost in costs.items()
                if cost < before[damping] and points[damping][1] > best.gained
            ]
            if not worth:
                break
            corrected = side_by_side(partial(_corrected, ground, places, tried), worth)
            places = dict(zip(worth, corrected, strict=True))
        return best


def _corrected(
    ground: Ground, places: Mapping[float, Array], tried: Mapping[float, Predictions], damping: float
) -> Array:
    """Where the same equations lead from the place that a damping has led to."""
    return ground.minimum(places[damping], ground.pull(places[damping], tried[damping]), damping)[0]
