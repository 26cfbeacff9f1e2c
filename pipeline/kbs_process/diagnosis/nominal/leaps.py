"""Phases of cogging and friction, and the edges of tooth contact, moved to better minima than a descent finds.

What a weak effect does shows only once the strong ones are right. A phase that enters smoothly is tried all round;
tooth contact at the best pairs of edges (`stages.contact`), each followed by a step in its own numbers before it is
judged. All other numbers follow as the slopes say. Where these are those of a wrong minimum, a stride asks the plant.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from kbs_process.diagnosis.nominal.phasing import stages
from kbs_process.diagnosis.side_by_side import side_by_side
from kbs_process.identification.contact import edge_minima
from kbs_process.identification.screening import Contact, contacts
from kbs_process.identification.search import BETTER, EDGES
from kbs_process.signals.records import Array

if TYPE_CHECKING:
    from kbs_process.diagnosis.nominal.costs import Found, Predictions
    from kbs_process.diagnosis.nominal.search import Search

_SMOOTH = 8  # phases tried all round
_DIFFERENCE = 0.01  # rad, of an edge, and 5 % of a torque, for a candidate's own step
_STRIDES = 2  # pairs of edges tried of a contact by steps of all numbers
_REACH = 0.06  # rad: an edge's own step goes no farther than half the grid that proposed it
_WALK = (-0.3, -0.16, -0.08, -0.03, 0.03, 0.08, 0.16, 0.3)  # rad, outwards: an edge's places that are tried
_NARROWEST = 0.02  # rad, half a contact
_RIDGE = 1e-10  # of each number's own information
_FOLLOWED = (1.0, 0.3, 0.0)  # shares of how the others follow
_RISE = 1.5  # times the cost, that a leap may bring before the others have settled
_FAR = 1.08  # likewise, of a stride: places that two steps reached the bottom from rose by 5 % at most


def leap(search: Search, found: Found, *, smooth: bool) -> Array | None:
    """Return better values (p,), or None where there are none; phases that enter smoothly are tried if `smooth`."""
    theta, moved = found.theta, list[int]()
    J = search.jacobians(found.gradients)
    for trials, joints in stages(search.experiment):
        for pair in search.pairs:
            if smooth and pair.smooth and search.free[pair.phase].name.startswith(_paths(joints)):
                view = Moving(search, found, J, trials, (pair.amplitude, pair.phase))
                moved += view.own
                turns = np.arange(_SMOOTH) * (2.0 * np.pi / _SMOOTH)
                middle = search.parameters.value[pair.amplitude]
                theta = view.best(theta, [view.at(theta, (middle, turn)) for turn in turns])
        for contact in _contacts(search, joints):
            view = Moving(search, found, J, trials, (contact.torque, contact.width, contact.phase))
            moved += view.own
            if search.gross(found):
                theta = view.best(theta, view.edges(theta, contact))
            theta = view.best(theta, view.walked(theta))
    if theta is found.theta:
        return None
    point, _, cost = _followed(search, found, theta, sorted(set(moved)))
    return point if cost < _RISE * sum(search.cost(found.theta, found.predicted)) else None


def stride(search: Search, found: Found, steps: int, most: int) -> Found | None:
    """Where some `steps` of all numbers lead, from tooth contact elsewhere; None where nowhere better.

    A place far away is judged wrongly by how the others follow along the slopes that they have where it is not. So
    those that the least squares over all edges rank before the present one are tried, along slopes taken there.
    """
    begun = found
    for trials, joints in stages(search.experiment):
        for contact in _contacts(search, joints):
            J = search.jacobians(found.gradients)
            view = Moving(search, found, J, trials, (contact.torque, contact.width, contact.phase))
            here, *others = view.followed([found.theta, *view.ranked(found.theta, contact, _STRIDES)])
            reached, standing = [found], sum(search.cost(found.theta, found.predicted))
            for one in others:
                theta = view.with_rest(found.theta, one, here)
                point, predicted, cost = _followed(search, found, theta, view.own)
                if not cost < _FAR * standing:
                    continue
                gradients = search.slopes(point, found.gradients)
                gone = replace(found, theta=point, predicted=predicted, gradients=gradients, rounds=begun.rounds)
                reached.append(search.descend(gone, steps, most=most))
            costs = [sum(search.cost(one.theta, one.predicted)) for one in reached]
            best = int(np.argmin(costs))
            found = reached[best] if costs[best] < costs[0] - BETTER else found
    return None if found is begun else found


def _paths(joints: Sequence[str]) -> tuple[str, ...]:
    return tuple(f"joint.{name}.drive." for name in joints)


def _contacts(search: Search, joints: Sequence[str]) -> list[Contact]:
    """Tooth contacts of some joints' drives."""
    found = contacts(search.hypothesis.rig, search.hypothesis.effects, search.free)
    return [contact for contact in found if search.free[contact.phase].name.startswith(_paths(joints))]


def _followed(search: Search, found: Found, theta: Array, moved: Sequence[int]) -> tuple[Array, Predictions, float]:
    """`theta` with as much of how the others follow as does best, what is predicted there, and its cost.

    What the others are to follow by is linear, and may be far from true.
    """
    own = np.isin(np.arange(len(theta)), moved)
    points = [np.where(own, theta, found.theta + share * (theta - found.theta)) for share in _FOLLOWED]
    predicted = search.predict(points, search.drives)
    costs = [sum(one) for one in search.costs(points, predicted)]
    best = int(np.argmin(costs))
    return points[best], predicted[best], costs[best]


@dataclass(frozen=True, slots=True, eq=False)
class Followed:
    """A point whose `own` numbers were simulated: the cost once the rest has followed, and by how much that moves."""

    point: Array
    cost: float
    follow: Array  # (rest,)


class Moving:
    """Some trials in which some numbers, `own`, are moved; the other trials hold the rest by what they already say."""

    def __init__(
        self, search: Search, found: Found, J: Mapping[int, Array], trials: Sequence[int], own: tuple[int, ...]
    ) -> None:
        self.search, self.trials, self.own = search, trials, list(own)
        self.J = np.concatenate([J[k] for k in trials])
        self.rest = np.delete(np.arange(len(search.free)), self.own)
        self.drives = sorted({search.experiment.trials[k].drive for k in trials})
        self.weights = (search.precision + search.ridge)[self.rest]
        normal = sum((j[:, self.rest].T @ j[:, self.rest] for j in J.values()), np.diag(self.weights))
        # A law's number that nothing shows has no prior either, and would leave the equations singular.
        size = np.diag(normal)
        self.factor = cho_factor(normal + np.diag(np.where(size > 0.0, _RIDGE * size, 1.0)))
        self.judged: dict[bytes, Followed] = {}
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
        return side_by_side(
            lambda predicted: np.concatenate([search.residual(k, predicted) for k in self.trials]),
            search.predict(points, self.drives),
        )

    def best(self, theta: Array, points: Sequence[Array]) -> Array:
        """The best of some points, the rest having followed; `theta` itself where none is better by `BETTER`."""
        here, *others = self.followed([theta, *points])
        chosen = min(others, key=lambda one: one.cost, default=here)
        return theta if chosen.cost > here.cost - BETTER else self.with_rest(theta, chosen, here)

    def with_rest(self, theta: Array, chosen: Followed, here: Followed) -> Array:
        """`theta` moved to a point that was judged, the rest following."""
        better = self.at(theta, chosen.point[self.own])
        better[self.rest] += chosen.follow - here.follow
        return self.at(better, better[self.own])

    def followed(self, points: Sequence[Array]) -> list[Followed]:
        """Judge points by their residuals and the priors."""
        new = list({point.tobytes(): point for point in points if point.tobytes() not in self.judged}.values())
        for point, z in zip(new, self.residuals(new), strict=True):
            self.judged[point.tobytes()] = self._judge(point, z)
        return [self.judged[point.tobytes()] for point in points]

    def _judge(self, point: Array, z: Array) -> Followed:
        if not np.isfinite(z).all():
            return Followed(point, np.inf, np.zeros(len(self.rest)))
        excess = self.weights * (point - self.search.parameters.value)[self.rest]
        g = self.J[:, self.rest].T @ z + self.held - excess
        follow = cho_solve(self.factor, g)
        return Followed(point, float(z @ z) + self.search.excess(point) - float(g @ follow), follow)

    def edges(self, theta: Array, contact: Contact) -> list[Array]:
        """Points with the contact's edges where they might be, each after a step of its own."""
        points = self.minima(theta, contact, EDGES)
        return [*points, *self.stepped(points)]

    def minima(self, theta: Array, contact: Contact, most: int) -> list[Array]:
        """Points with the contact's edges where least squares have them, best first."""
        prior = self.search.parameters
        # A phase that these trials show nothing of would leave the equations singular.
        bounded = replace(prior, sigma=np.where(np.isfinite(prior.sigma), prior.sigma, np.pi))
        return edge_minima(self.residuals, theta, -self.J, bounded, contact, most)

    def ranked(self, theta: Array, contact: Contact, most: int) -> list[Array]:
        """Those of them that come before the place where the contact is."""
        points = self.minima(theta, contact, most)
        _, width, phase = theta[self.own]

        def here(point: Array) -> bool:
            _, wide, turn = point[self.own]
            apart = np.mod(turn - phase + np.pi, 2.0 * np.pi) - np.pi
            return bool(abs(apart) + abs(wide - width) < _REACH)  # the farther of both edges

        return list(itertools.takewhile(lambda point: not here(point), points))

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
                self.at(point, (torque * width / wide, wide, phase - 0.5 * side * offset)) for offset, wide in moves
            ]
            point = min(self.followed([point, *points]), key=lambda one: one.cost).point
        return [point, *self.stepped([point])] if point is not theta else []

    def stepped(self, points: Sequence[Array]) -> list[Array]:
        """Gauss-Newton steps from some points in the own numbers and the rest together; only the own are taken."""
        around = [[point, *self._differenced(point)] for point in points]
        found = iter(self.residuals([one for own in around for one in own]))
        return [self._step(point, [next(found) for _ in own]) for point, own in zip(points, around, strict=True)]

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
