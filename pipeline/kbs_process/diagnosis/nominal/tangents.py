"""Slopes of the search for the known parameters: differences of the plant, taken anew or updated by what steps gave.

Updates are Broyden's (Math. Comp. 19:577, 1965); along valleys see `along_valleys`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from kbs_process.diagnosis.experiments.hypothesis import Prediction
from kbs_process.diagnosis.nominal.costs import (
    ALL,
    GEARS,
    GROSS,
    OLD,
    OWN,
    Costs,
    Found,
    Gradients,
    Ground,
    Predictions,
)
from kbs_process.diagnosis.nominal.parameters import Slopes, slopes
from kbs_process.identification.objective import MOST_DIFFERENCE, SEEN
from kbs_process.signals.records import Array

_SPAN = 1.0  # of a step
_LEAST_DIFFERENCE = 2e-3  # prior sigmas
_ALIKE = 1e-4  # of what recordings would tell of each number alone: a direction of which they tell less is a valley
_LENGTH = 3.0  # standard deviations of a direction, that it is gone along
_APART = 1e-3  # of the longest: directions that differ by less are one
_MUCH = 0.5  # prior sigmas of a body's number, within which its slopes and others' stay what they are
# Of the whitened residual's length: what a number moves by one sigma and is not looked at again.
_NEGLIGIBLE = 1.0


@dataclass(frozen=True, slots=True, eq=False)
class Step:
    """Where a step leads, and what it gains of what slopes promised."""

    theta: Array
    predicted: Predictions
    promised: float
    gained: float


class Tangents(Costs):
    """Costs, and how predictions answer to the free numbers where a search stands."""

    def begin(self, theta: Array, gradients: Gradients | None = None, predicted: Predictions | None = None) -> Found:
        """Numbers to begin with, and their slopes; some `gradients` may be of the first numbers alone."""
        predicted = predicted or self.predict([theta], self.everything)[0]
        if gradients is None:
            gradients = self.slopes(theta, {}, ALL)
        elif missing := len(self.free) - len(gradients[self.references[0]].columns):
            wider = {drive: _widened(slope, predicted[drive], missing) for drive, slope in gradients.items()}
            gradients = self.slopes(theta, wider, OWN)
        found = Found(theta, predicted, gradients)
        self.idle = {drive: self._idle(drive, found.gradients) for drive in self.references}
        return found

    def _idle(self, drive: int, gradients: Gradients) -> list[int]:
        """Numbers that a drive shows nothing of, such as those of joints that it does not turn."""
        length = np.zeros(len(self.free))
        for k in self.experiment.fit:
            if self.experiment.reference(self.experiment.trials[k].trajectory) == drive:
                length += np.sum(self.jacobian(k, gradients) ** 2, axis=0)
        return [int(i) for i in np.flatnonzero(np.sqrt(length) * self.spread < _NEGLIGIBLE)]

    def with_slopes(self, found: Found) -> Found:
        """The same with the slopes that are due."""
        if found.due == OLD:
            return found
        return replace(found, gradients=self.slopes(found.theta, found.gradients, found.due), due=OLD)

    def slopes(self, theta: Array, held: Gradients, fresh: int = GEARS) -> Gradients:
        """Slopes at theta; where some are held, only those that `fresh` names are taken again.

        Those of bodies change with the resonances, slowly. Calibrations, slow and at rest for the most part, keep what
        others show better. A law's column is its slope. What is not taken again is as it was taken: a step of drives
        that stick or slip corrects the columns of all that moved with them, and theirs with the wrong ones.
        """
        if fresh == ALL:
            self.bodies_at = theta
        keep = {}
        for drive in self.references:
            same = set(self.idle.get(drive, ())) if drive in held else set()
            if drive in held and fresh < ALL:
                same |= set(self.slow) | (set(self.geared) if fresh == OWN else set())
                if drive in self.calibrations:
                    same |= {i for i in self.geared if self._shown_beside(i, drive)}
            columns = held[drive].taken.copy() if drive in held else None
            if self.laws:
                if columns is None:
                    grid = self.experiment.drives[drive].n, len(self.experiment.channels)
                    columns = np.zeros((len(self.free), *grid))
                for i, scalar in enumerate(self.free):
                    if scalar.name in self.laws:
                        columns[i] = self.laws[scalar.name][drive]
                        same.add(i)
            if columns is not None:
                keep[drive] = (sorted(same), columns)
        here, free = self.at(theta), self.free
        taken = slopes(self.experiment, here, free, self.differences, self.references, self.simulate, keep=keep)
        whole = {drive: replace(one, base=self.shown(theta, drive, one.base)) for drive, one in taken.items()}
        return along_valleys(self, theta, whole)

    def _shown_beside(self, index: int, drive: int) -> bool:
        """Whether a drive other than a calibration shows something of a number."""
        others = set(self.idle) - self.calibrations - {drive}
        return any(index not in self.idle[other] for other in others)

    def bodies_moved(self, theta: Array) -> bool:
        """Whether numbers on which slopes of bodies depend have moved much since these were taken."""
        if self.bodies_at is None:
            return True
        moved = np.abs(theta - self.bodies_at)[self.slow] / self.spread[self.slow]
        return bool((moved > _MUCH).any())

    def updated(self, gradients: Gradients, theta: Array, step: Step) -> Gradients:
        """Broyden's update, lengths in prior sigmas; what laws add is exact."""
        moved = np.zeros(len(theta))
        moved[self.inside] = ((step.theta - theta) / self.spread)[self.inside]
        if not moved.any():
            return {drive: replace(slope, base=step.predicted[drive]) for drive, slope in gradients.items()}
        along = moved / (moved @ moved) / self.spread
        new = {}
        for drive, slope in gradients.items():
            promised = np.tensordot(step.theta - theta, slope.columns, axes=1)
            missed = step.predicted[drive].values - slope.base.values - promised
            columns = slope.columns + along[:, None, None] * missed
            new[drive] = replace(slope, base=step.predicted[drive], columns=columns)
        return new

    def settle(self, H: Array, moved: Array) -> None:
        """Differences that move the whitened residual by about `SEEN`, and span some of what a step has moved.

        Where friction sticks or slips by a hair, slopes over less than the next step say nothing of it.
        """
        length = np.sqrt(np.maximum(np.diag(H), 1e-300))
        self.differences = np.clip(
            np.maximum(SEEN / length, _SPAN * moved), _LEAST_DIFFERENCE * self.spread, MOST_DIFFERENCE * self.spread
        )


def _widened(slope: Slopes, base: Prediction, missing: int) -> Slopes:
    """Slopes with room for `missing` more numbers."""
    more = (0, missing), (0, 0), (0, 0)
    return Slopes(base, np.pad(slope.columns, more), np.pad(slope.taken, more))


def along_valleys(search: Tangents, theta: Array, gradients: Gradients) -> Gradients:
    """`gradients` taken at theta (p,), so corrected that they give what the plant does along valleys.

    Where numbers make up for each other (a stiffness, inertias, the coupling's gain), a step moves each by hundreds of
    the differences that its column is taken over, and what the columns say of it nearly cancels: the rest is their
    errors, as friction sticks or slips by a hair. So the plant is asked again, over a step that is as long as the
    valley is.

    The least correction that does, lengths in prior sigmas: Broyden's, of several steps at once. What laws add is exact
    and stays. Source: R. B. Schnabel, Quasi-Newton methods using multiple secant equations (1983).
    """
    bases = {drive: slope.base for drive, slope in gradients.items()}
    trials = [k for k in search.experiment.fit if search.experiment.trials[k].drive in bases]
    data = sum(float(z @ z) for z in (search.residual(k, bases) for k in trials))
    rows = sum(search.metric[k].rows for k in trials)
    # Where much is left, standard deviations are as wide, and the plant is not linear over them.
    if not data <= (1.0 + GROSS) * rows:
        return gradients
    weight = 1.0 / max(1.0, data / rows)
    ground = Ground(search, theta, search.jacobians(gradients), weight)
    points = ground.valleys(search.stated, _ALIKE, _LENGTH)
    gone = list(zip(points, search.predict(points, search.references), strict=True))
    gone = [(p, there) for p, there in gone if all(np.isfinite(one.values).all() for one in there.values())]
    if not gone:
        return gradients
    steps = np.array([point - theta for point, _ in gone])
    back = np.linalg.pinv(steps / search.spread, rcond=_APART) / search.spread[:, None]
    new = {}
    for drive, slope in gradients.items():
        seen = np.array([there[drive].values for _, there in gone]) - slope.base.values
        missed = seen - np.tensordot(steps, slope.columns, axes=1)
        new[drive] = replace(slope, columns=slope.columns + np.tensordot(back, missed, axes=1))
    return new
