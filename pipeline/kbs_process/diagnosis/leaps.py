"""Phases of cogging and friction, and the edges of tooth contact, moved to better minima than a descent finds.

What a weak effect does shows only once the strong ones are right. A phase that enters smoothly is tried all round;
tooth contact at the best pairs of edges (`stages.contact`), each followed by a step in its own numbers before it is
judged. All other numbers follow as the slopes say.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from kbs_process.diagnosis.phasing import stages
from kbs_process.signals.records import Array
from kbs_process.stages.contact import edge_minima
from kbs_process.stages.screening import Contact, contacts

if TYPE_CHECKING:
    from kbs_process.diagnosis.search import Found, Search

_SMOOTH = 8  # phases tried all round
_EDGES = 4  # pairs of edges tried of a contact
_DIFFERENCE = 0.01  # rad, of an edge, and 5 % of a torque, for a candidate's own step
_REACH = 0.06  # rad: an edge's own step goes no farther than half the grid that proposed it
_WALK = (-0.3, -0.16, -0.08, -0.03, 0.03, 0.08, 0.16, 0.3)  # rad, outwards: an edge's places that are tried
_NARROWEST = 0.02  # rad, half a contact
_BETTER = 10.0  # of -2 log likelihood, for which something is moved
_FOLLOWED = (1.0, 0.3, 0.0)  # shares of how the others follow
_RISE = 1.5  # times the cost, that a leap may bring before the others have settled


def leap(search: Search, found: Found, *, smooth: bool) -> Array | None:
    """Return better values (p,), or None where there are none; phases that enter smoothly are tried if `smooth`."""
    theta, moved = found.theta, list[int]()
    J = {k: search.jacobian(k, found.gradients) for k in search.experiment.fit}
    for trials, joints in stages(search.experiment):
        prefixes = tuple(f"joint.{name}.drive." for name in joints)
        for pair in search.pairs:
            if smooth and pair.smooth and search.free[pair.phase].name.startswith(prefixes):
                view = _View(search, found, J, trials, (pair.amplitude, pair.phase))
                moved += view.own
                turns = np.arange(_SMOOTH) * (2.0 * np.pi / _SMOOTH)
                middle = search.parameters.value[pair.amplitude]
                theta = view.best(theta, [view.at(theta, (middle, turn)) for turn in turns])
        for contact in contacts(search.hypothesis.rig, search.hypothesis.effects, search.free):
            if search.free[contact.phase].name.startswith(prefixes):
                view = _View(search, found, J, trials, (contact.torque, contact.width, contact.phase))
                moved += view.own
                theta = view.best(theta, view.edges(theta, contact))
                theta = view.best(theta, view.walked(theta))
    if theta is found.theta:
        return None
    # What the others are to follow by is linear, and may be far from true: less of it then.
    own = np.isin(np.arange(len(theta)), sorted(set(moved)))
    points = [np.where(own, theta, found.theta + share * (theta - found.theta)) for share in _FOLLOWED]
    costs = [
        sum(search.cost(point, predicted))
        for point, predicted in zip(points, search.predict(points, search.drives), strict=True)
    ]
    best = int(np.argmin(costs))
    return points[best] if costs[best] < _RISE * sum(search.cost(found.theta, found.predicted)) else None


@dataclass(frozen=True, slots=True, eq=False)
class _Followed:
    """A point whose `own` numbers were simulated: the cost once the rest has followed, and by how much that moves."""

    point: Array
    cost: float
    follow: Array  # (rest,)


class _View:
    """Some trials in which some numbers, `own`, are moved; the other trials hold the rest by what they already say."""

    def __init__(
        self,
        search: Search,
        found: Found,
        J: Mapping[int, Array],
        trials: Sequence[int],
        own: tuple[int, ...],
    ) -> None:
        self.search, self.trials, self.own = search, trials, list(own)
        self.J = np.concatenate([J[k] for k in trials])
        self.rest = np.delete(np.arange(len(search.free)), self.own)
        self.drives = sorted({search.experiment.trials[k].drive for k in trials})
        self.weights = (search.precision + search.ridge)[self.rest]
        normal = sum((j[:, self.rest].T @ j[:, self.rest] for j in J.values()), np.diag(self.weights))
        self.factor = cho_factor(normal)
        self.judged: dict[bytes, _Followed] = {}
        self.held = np.zeros(len(self.rest))
        for k in set(J) - set(trials):
            self.held += J[k][:, self.rest].T @ search.residual(k, found.predicted)

    def at(self, theta: Array, values: Sequence[float] | Array) -> Array:
        """`theta` with the own numbers at `values`, within bounds."""
        point = theta.copy()
        point[self.own] = values
        return self.search.clipped(point)

    def residuals(self, points: Sequence[Array]) -> list[Array]:
        """Whitened residuals of the trials, end to end, at each point; those that no plant has are not finite."""
        search = self.search
        return [
            np.concatenate([search.residual(k, predicted) for k in self.trials])
            for predicted in search.predict(points, self.drives)
        ]

    def best(self, theta: Array, points: Sequence[Array]) -> Array:
        """The best of some points, the rest having followed; `theta` itself where none is better by `_BETTER`."""
        here, *others = self.followed([theta, *points])
        chosen = min(others, key=lambda one: one.cost, default=here)
        if chosen.cost > here.cost - _BETTER:
            return theta
        better = self.at(theta, chosen.point[self.own])
        better[self.rest] += chosen.follow - here.follow
        return self.at(better, better[self.own])

    def followed(self, points: Sequence[Array]) -> list[_Followed]:
        """Judge points by their residuals and the priors."""
        new = list(
            {point.tobytes(): point for point in points if point.tobytes() not in self.judged}.values()
        )
        for point, z in zip(new, self.residuals(new), strict=True):
            self.judged[point.tobytes()] = self._judge(point, z)
        return [self.judged[point.tobytes()] for point in points]

    def _judge(self, point: Array, z: Array) -> _Followed:
        if not np.isfinite(z).all():
            return _Followed(point, np.inf, np.zeros(len(self.rest)))
        excess = self.weights * (point - self.search.parameters.value)[self.rest]
        g = self.J[:, self.rest].T @ z + self.held - excess
        follow = cho_solve(self.factor, g)
        return _Followed(point, float(z @ z) + self.search.excess(point) - float(g @ follow), follow)

    def edges(self, theta: Array, contact: Contact) -> list[Array]:
        """Points with the contact's edges where they might be, each after a step of its own."""
        prior = self.search.parameters
        # A phase that these trials show nothing of would leave the equations singular.
        bounded = replace(prior, sigma=np.where(np.isfinite(prior.sigma), prior.sigma, np.pi))
        points = edge_minima(self.residuals, theta, -self.J, bounded, contact, _EDGES)
        return [*points, *self.stepped(points)]

    def walked(self, theta: Array) -> list[Array]:
        """The best place of either edge in turn, the other standing: each meets events of its own.

        Where friction sticks, narrow contacts do not add up, and their sum proposes wrong edges. The torque goes with
        the inverse of the width, which leaves the loss in a turn as it is.
        """
        point = theta
        for side in (-1.0, 1.0, -1.0, 1.0):
            torque, width, phase = point[self.own]
            moves = [(offset, width + 0.5 * offset) for offset in _WALK if width + 0.5 * offset > _NARROWEST]
            # The contact is centred at minus its phase.
            points = [
                self.at(point, (torque * width / wide, wide, phase - 0.5 * side * offset))
                for offset, wide in moves
            ]
            point = min(self.followed([point, *points]), key=lambda one: one.cost).point
        return [point, *self.stepped([point])] if point is not theta else []

    def stepped(self, points: Sequence[Array]) -> list[Array]:
        """Gauss-Newton steps from some points in the own numbers and the rest together; only the own are taken."""
        around = [[point, *self._differenced(point)] for point in points]
        found = iter(self.residuals([one for own in around for one in own]))
        return [
            self._step(point, [next(found) for _ in own]) for point, own in zip(points, around, strict=True)
        ]

    def _differences(self, point: Array) -> Array:
        return np.array([0.05 * max(abs(point[self.own[0]]), 1e-9), _DIFFERENCE, _DIFFERENCE])

    def _differenced(self, point: Array) -> list[Array]:
        moved = []
        for index, d in zip(self.own, self._differences(point), strict=True):
            one = point.copy()
            one[index] += d
            moved.append(one)
        return moved

    def _step(self, point: Array, residuals: Sequence[Array]) -> Array:
        z, *others = residuals
        size = self._differences(point)
        own = np.column_stack([(z - other) / d for other, d in zip(others, size, strict=True)])
        if not (np.isfinite(own).all() and np.isfinite(z).all()):
            return point
        J = self.J[:, self.rest]
        prior = self.search.parameters
        cross = J.T @ own
        excess = (self.search.precision + self.search.ridge) * (point - prior.value)
        g = J.T @ z + self.held - excess[self.rest]
        A = own.T @ own + np.diag(self.search.precision[self.own]) - cross.T @ cho_solve(self.factor, cross)
        b = own.T @ z - self.search.precision[self.own] * (point - prior.value)[self.own]
        b = b - cross.T @ cho_solve(self.factor, g)
        reach = np.array([0.5 * abs(point[self.own[0]]), _REACH, _REACH])
        step = np.clip(np.linalg.lstsq(A, b, rcond=1e-12)[0], -reach, reach)
        return self.at(point, point[self.own] + step)
