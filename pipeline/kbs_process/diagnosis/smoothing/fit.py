"""Gauss and Newton on motions and unknowns: banded in the motion of each recording, dense in what they share."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve
from scipy.linalg.lapack import dtrtri

from kbs_process.diagnosis.nominal.known import Strain, strain_of
from kbs_process.diagnosis.side_by_side import side_by_side
from kbs_process.diagnosis.smoothing.balance import Motion
from kbs_process.diagnosis.smoothing.basis import LOCAL
from kbs_process.diagnosis.smoothing.columns import Columns, Places, within
from kbs_process.diagnosis.smoothing.course import Course
from kbs_process.diagnosis.smoothing.problem import Problem
from kbs_process.signals.records import Array

# Prior sigmas that a number of the rig goes in a step at most: to begin with, at most, at least; and by what it grows
# where a step made the cost less, and shrinks where it did not.
REACH, _FAR, NEAR, _ONWARD, _BACK = 2.0, 4.0, 0.1, 2.0, 0.4
_HELD = (-3.0, 12.0)  # powers of ten: of what holds the rig's numbers where they are, over what priors do
_HALVINGS = 24
_MANY = 3  # rows, of a column that acts on more of which all are taken at once
_RUNS = 2  # steps in which a motion follows unknowns that moved


@dataclass(slots=True, eq=False)
class State:
    """Where a fit is: unknowns, coefficients of each recording's motion, and sigmas of all rows."""

    x: Array
    coefficients: list[Array]
    sigma: Array  # (rows,)
    torques: list[Array] = field(default_factory=list)  # of the rotors along each motion
    ideal: list[Array] = field(default_factory=list)  # coefficients of the motion that the model of a group has
    ideal_torques: list[Array] = field(default_factory=list)
    reach: float = REACH
    lowest: float = np.inf  # cost where the last step began
    # What rows of a group said of its motion when last asked, and what that was asked for.
    _asked: dict[int, tuple[tuple[object, ...], Banded, Array]] = field(default_factory=dict, init=False, repr=False)

    @classmethod
    def of(cls, problem: Problem, forces: Array) -> State:
        """Before any step, with forces of `forces` (their rows,)."""
        sigma = problem.sigma.copy()
        sigma[problem.forces] = forces
        begun: dict[int, Array] = {}
        for members in problem.groups:
            begun |= dict.fromkeys(members, problem.start(members[0]))
        state = cls(problem.prior.copy(), [begun[k] for k in range(len(begun))], sigma)
        state.follow(problem)
        return state

    def joined(self, before: Problem, problem: Problem) -> State:
        """The same for a problem that has one effect more than the one `before`."""
        x = problem.prior.copy()
        shared = before.own[0].start
        x[:shared] = self.x[:shared]
        for old, new in zip(before.own, problem.own, strict=True):
            clocks = old.stop - 2
            x[new.start : new.start + clocks - old.start] = self.x[old.start : clocks]
            x[new.stop - 2 : new.stop] = self.x[clocks : old.stop]
        of = {k: g for g, members in enumerate(before.groups) for k in members}
        first = [of[members[0]] for members in problem.groups] if self.ideal else []
        return replace(
            self, x=x, coefficients=[*self.coefficients], sigma=self.sigma.copy(), torques=[*self.torques],
            ideal=[self.ideal[g] for g in first], ideal_torques=[self.ideal_torques[g] for g in first],
            reach=REACH, lowest=np.inf,
        )  # fmt: skip

    def motion(self, problem: Problem, k: int) -> Motion:
        """The motion of a recording."""
        return problem.recordings[k].basis.motion(self.coefficients[k])

    def follow(self, problem: Problem) -> None:
        """Take the rotors' torques where the motion is now."""
        before: Sequence[Array | None] = self.torques or [None] * len(problem.recordings)
        self.torques = [_torques(problem, k, self.x, self.motion(problem, k), one) for k, one in enumerate(before)]

    def idealise(self, problem: Problem, stiff: float) -> None:
        """Let the model run by itself: forces that it lacks are `stiff` times as large, and readings hardly count."""
        if not self.ideal:
            self.ideal = [problem.start(members[0]) for members in problem.groups]
            self.ideal_torques = [
                _torques(problem, members[0], self.x, self.ideal_motion(problem, g), None)
                for g, members in enumerate(problem.groups)
            ]
        sigma = self.sigma.copy()
        sigma[problem.forces] *= stiff

        def run(g: int) -> tuple[Array, Array]:
            members = problem.groups[g]
            first, coefficients, torques = members[0], self.ideal[g], self.ideal_torques[g]
            if problem.present:
                acting, beyond = self.course(problem, g).acting()
                for k in members:
                    problem.acting[k], problem.beyond[k] = acting, beyond
            root = np.sqrt(self.weights(problem, first, sigma))
            banded = _banded(problem, first, self.x, self.ideal_motion(problem, g), torques, root)
            for _ in range(_RUNS):
                motion = problem.recordings[first].basis.motion(coefficients)
                left = np.mean([problem.residual(k, self.x, motion, torques) for k in members], axis=0)
                coefficients = coefficients + banded.taken(left * root)
                torques = _torques(
                    problem, first, self.x, problem.recordings[first].basis.motion(coefficients), torques
                )  # fmt: skip
            return coefficients, torques

        found = side_by_side(run, range(len(problem.groups)))
        self.ideal, self.ideal_torques = [one for one, _ in found], [one for _, one in found]

    def smooth(self, problem: Problem) -> None:
        """Bring the motion to where it is best for the unknowns as they are."""

        def follow(g: int) -> None:
            banded, root = self.banded(problem, g)
            for k in problem.groups[g]:
                left = problem.residual(k, self.x, self.motion(problem, k), self.torques[k]) * root
                self.coefficients[k] = self.coefficients[k] + banded.taken(left)
                self.torques[k] = _torques(problem, k, self.x, self.motion(problem, k), self.torques[k])

        side_by_side(follow, range(len(problem.groups)))

    def adapt(self, problem: Problem) -> None:
        """Go farther where the last step made the cost less, and less far where it did not."""
        cost = self.cost(problem)
        if np.isfinite(self.lowest):
            self.reach = float(np.clip(self.reach * (_BACK if cost > self.lowest else _ONWARD), NEAR, _FAR))
        self.lowest = cost

    def weigh(self, problem: Problem, forces: Array) -> None:
        """Take other sigmas of forces (their rows,)."""
        before = self.cost(problem)
        self.sigma[problem.forces] = forces
        self.lowest += self.cost(problem) - before

    def ideal_motion(self, problem: Problem, g: int) -> Motion:
        """The motion that the model of a group of recordings has by itself."""
        return problem.recordings[problem.groups[g][0]].basis.motion(self.ideal[g])

    def course(self, problem: Problem, g: int) -> Course:
        """What effects do along that motion."""
        return Course(problem, problem.groups[g], self.x, self.ideal_motion(problem, g), self.ideal_torques[g])

    def weights(self, problem: Problem, k: int, sigma: Array | None = None) -> Array:
        """(n, rows) one over the variance of each row, were it white."""
        sigma = self.sigma if sigma is None else sigma
        weights = np.outer(problem.recordings[k].weight, sigma**-2.0)
        weights[:, problem.angles] *= problem.recordings[k].turning
        weights[:, problem.forces] = sigma[problem.forces] ** -2.0  # they hold where nothing is read
        return weights

    def banded(self, problem: Problem, g: int) -> tuple[Banded, Array]:
        """What rows of a group say of a recording's motion, and square roots of their weights (n, rows).

        Along the motion that the model has by itself: what a recording's own differs by bends no slope.
        """
        here = problem, self.x.tobytes(), self.sigma.tobytes(), self.ideal[g].tobytes()
        asked = self._asked.get(g)
        if asked is None or asked[0] != here:
            first = problem.groups[g][0]
            root = np.sqrt(self.weights(problem, first))
            motion, torques = self.ideal_motion(problem, g), self.ideal_torques[g]
            asked = self._asked[g] = here, _banded(problem, first, self.x, motion, torques, root), root
        return asked[1], asked[2]

    def residuals(self, problem: Problem) -> list[Array]:
        """Of every recording, (n, rows)."""
        every = range(len(problem.recordings))
        return [problem.residual(k, self.x, self.motion(problem, k), self.torques[k]) for k in every]

    def cost(self, problem: Problem) -> float:
        """Sum of squares, priors included."""
        total = float(np.sum(((self.x - problem.prior) / problem.spread) ** 2))
        for k, left in enumerate(self.residuals(problem)):
            total += float(np.sum(left**2 * self.weights(problem, k)))
        return total


def _banded(problem: Problem, k: int, x: Array, motion: Motion, torques: Array, root: Array) -> Banded:
    return Banded.of(problem.by_motion(k, x, motion, torques), problem.recordings[k].basis.values, root)


def _torques(problem: Problem, k: int, x: Array, motion: Motion, before: Array | None) -> Array:
    return problem.recordings[k].field.torques(problem.rig, problem.behind(k, x, motion, before))


@dataclass(frozen=True, slots=True, eq=False)
class Banded:
    """What a recording's rows say of its motion, factorised: blocks of as many samples as see a coefficient.

    A block of samples sees its own coefficients and those of the next block. Of N = R R^T, the normal matrix, R has
    triangles, and what couples a block to the one before.
    """

    seen: Array  # (blocks, rows, LOCAL, 2 width) slopes by coefficients, over sigmas as all below
    inverse: Array  # (blocks + 1, width, width) of the triangles
    coupled: Array  # (blocks, width, width) of each but the first
    shape: tuple[int, int]  # samples, rows
    freedoms: int

    @classmethod
    def of(cls, by_motion: Array, bases: Array, root: Array) -> Banded:
        """Of slopes (n, rows, freedoms, 3), the basis (3, LOCAL) and square roots of weights (n, rows)."""
        (n, rows), freedoms = root.shape, by_motion.shape[2]
        local = np.matmul(bases.T, (by_motion * root[:, :, None, None]).swapaxes(2, 3))
        blocks, width = -(-n // LOCAL), LOCAL * freedoms
        seen = np.zeros((blocks, rows, LOCAL, 2 * LOCAL, freedoms))
        for i in range(LOCAL):
            own = local[i::LOCAL]
            seen[: len(own), :, i, i : i + LOCAL] = own
        seen = seen.reshape(blocks, rows * LOCAL, 2 * width)
        products = seen.swapaxes(1, 2) @ seen
        own = np.concatenate([products[:, :width, :width], np.zeros((1, width, width))])
        own[1:] += products[:, width:, width:]
        diagonal = np.diagonal(own, axis1=1, axis2=2)
        own += np.eye(width) * (1e-9 * diagonal + 1e-9 * np.median(diagonal[:-1]))[:, None, :]
        coupled, inverse = products[:, width:, :width], np.empty_like(own)
        for b in range(blocks + 1):
            if b:
                coupled[b - 1] = coupled[b - 1] @ inverse[b - 1].T
                own[b] -= coupled[b - 1] @ coupled[b - 1].T
            inverse[b] = np.tril(dtrtri(np.linalg.cholesky(own[b]), lower=1)[0])
        return cls(seen.reshape(blocks, rows, LOCAL, 2 * width), inverse, coupled.copy(), (n, rows), freedoms)

    def against(self, columns: Columns) -> Array:
        """R^-1 times products of columns with what the motion does, (blocks + 1, width, columns)."""
        blocks, rows, samples, width = self.seen.shape
        width //= 2
        out = np.zeros((blocks + 1, width, columns.count))

        def enter(places: Places, products: Array) -> None:
            first, end = places[0], places[-1] + 1
            whole = slice(first, end) if end - first == len(places) else places
            out[:-1, :, whole] += products[:, :width]
            out[1:, :, whole] += products[:, width:]

        def blockwise(values: Array) -> Array:
            padded = np.zeros((blocks * samples, values.shape[1]))
            padded[: len(values)] = values
            return padded.reshape(blocks, samples, -1)

        rest, many = columns.divided(_MANY)
        if len(many):
            dense = np.zeros((blocks, rows, samples, len(many)))
            for row, places, values in columns.chosen(many).parts:
                dense[:, row, :, places] = np.moveaxis(blockwise(values), 2, 0)
            whole = self.seen.reshape(blocks, rows * samples, -1)
            enter(many, whole.swapaxes(1, 2) @ dense.reshape(blocks, rows * samples, -1))
        for row, places, values in columns.chosen(rest).parts:
            enter(rest[places], self.seen[:, row].swapaxes(1, 2) @ blockwise(values))
        out[0] = self.inverse[0] @ out[0]
        for b in range(blocks):
            out[b + 1] = self.inverse[b + 1] @ (out[b + 1] - self.coupled[b] @ out[b])
        return out

    def coefficients(self, against: Array) -> Array:
        """Coefficients (size, freedoms) of the motion that take up a column, of its `against` (blocks + 1, width)."""
        out = np.empty_like(against)
        out[-1] = against[-1] @ self.inverse[-1]
        for b in range(len(self.coupled) - 1, -1, -1):
            out[b] = (against[b] - out[b + 1] @ self.coupled[b]) @ self.inverse[b]
        return out.reshape(-1, self.freedoms)[: self.shape[0] - 1 + LOCAL]

    def taken(self, left: Array) -> Array:
        """Coefficients of the motion that take up what is left of rows (n, rows)."""
        return self.coefficients(self.against(Columns.of_dense(left[:, :, None]))[:, :, 0])

    def shown(self, against: Array) -> Array:
        """What the motion takes up of a column (n, rows), of its `against` (blocks + 1, width)."""
        every = np.zeros((len(self.inverse) * LOCAL, self.freedoms))
        found = self.coefficients(against)
        every[: len(found)] = found
        each = every.reshape(len(self.inverse), -1)
        both = np.concatenate([each[:-1], each[1:]], axis=1)[:, :, None]
        n, rows = self.shape
        return np.asarray((self.seen @ both[:, None]).swapaxes(1, 2).reshape(-1, rows)[:n])


@dataclass(frozen=True, slots=True, eq=False)
class Reduced:
    """Rows of recordings that were driven alike, with their motion taken out: columns are projected by `gram`."""

    members: tuple[int, ...]  # recordings
    motion: Banded
    root: Array  # (n, rows) square roots of the weights
    columns: Columns  # unknowns, then residuals of members
    against: Array  # (blocks + 1, width, local + members) of them
    whole: Array  # (local + members, local + members) their products

    @classmethod
    def of(cls, problem: Problem, state: State, g: int) -> Reduced:
        """At a state; unknowns along the motion that the model has by itself, in which there is no noise."""
        banded, root = state.banded(problem, g)
        members = problem.groups[g]
        left = [problem.residual(k, state.x, state.motion(problem, k), state.torques[k]) for k in members]
        by_unknown = problem.by_unknown(
            members[0], state.x, state.ideal_motion(problem, g), state.ideal_torques[g]
        )  # fmt: skip
        columns = Columns.beside([by_unknown, Columns.of_dense(np.stack(left, axis=2))]).weighed(root)
        against = banded.against(columns)
        whole = columns.products(columns) - _flat(against).T @ _flat(against)
        return cls(tuple(members), banded, root, columns, against, whole)

    @property
    def unknowns(self) -> int:
        return len(self.whole) - len(self.members)

    def of_member(self, k: int, change: Array) -> Array:
        """(local + members,) of columns: a recording's residual less what a change of its unknowns (local,) does."""
        own = np.zeros(len(self.members))
        own[self.members.index(k)] = 1.0
        return np.concatenate([-change, own])

    def left(self, k: int, change: Array) -> Array:
        """What is left of a recording's rows (n, rows), over their sigmas, after motion and a change of unknowns."""
        own = self.of_member(k, change)
        return self.columns.times(own, self.root.shape[1]) - self.motion.shown(self.against @ own)

    def gram(self, columns: Columns, owner: Places) -> tuple[Array, Array]:
        """Products of columns with unknowns and residuals (columns, local + members), and with each other.

        The latter (columns, columns) between those of one `owner` (columns,); both with the motion taken out.
        """
        columns = columns.weighed(self.root)
        against = _flat(self.motion.against(columns))
        mixed = columns.products(self.columns) - against.T @ _flat(self.against)
        return mixed, columns.squares(owner) - within(against, owner)


def _flat(against: Array) -> Array:
    return against.reshape(-1, against.shape[2])


@dataclass(frozen=True, slots=True, eq=False)
class Quadratic:
    """The cost about a state, in the unknowns alone."""

    parts: tuple[Reduced, ...]  # by groups of recordings
    normal: Array  # (p, p), priors included
    pull: Array  # (p,)
    left: float  # cost at the best motion for these unknowns

    @classmethod
    def of(cls, problem: Problem, state: State) -> Quadratic:
        """At a state."""
        parts = side_by_side(lambda g: Reduced.of(problem, state, g), range(len(problem.groups)))
        off = (state.x - problem.prior) / problem.spread
        normal, pull, left = np.diag(problem.spread**-2.0), -off / problem.spread, float(off @ off)
        for part in parts:
            p = part.unknowns
            for residual, k in enumerate(part.members, start=p):
                local = problem.local[k]
                normal[np.ix_(local, local)] += part.whole[:p, :p]
                pull[local] += part.whole[:p, residual]
                left += float(part.whole[residual, residual])
        return cls(tuple(parts), normal, pull, left)

    def solve(
        self, spread: Array, right: Array, free: NDArray[np.bool_] | None = None, held: Array | float = 0.0
    ) -> Array:
        """normal^-1 right, of the free unknowns; zero of the others. `held` is added to the normal's diagonal."""
        if not np.isfinite(self.normal).all():
            raise np.linalg.LinAlgError("rows have no values there")
        scale = spread if free is None else np.where(free, spread, 0.0)
        factor = cho_factor(self.normal * np.outer(scale, scale) + np.diag((scale == 0.0) + held * np.ones(len(scale))))
        found = cho_solve(factor, right.reshape(len(spread), -1) * scale[:, None]) * scale[:, None]
        return np.asarray(found.reshape(right.shape))

    def sigma(self, spread: Array) -> Array:
        """Standard deviation of each unknown."""
        return np.asarray(np.sqrt(np.diag(self.solve(spread, np.eye(len(spread))))))


@dataclass(frozen=True, slots=True, eq=False)
class Fitted:
    """A fit that has settled."""

    problem: Problem
    state: State
    covariance: Array  # (p, p) of what recordings have in common

    @classmethod
    def of(cls, problem: Problem, state: State) -> Fitted:
        """Where a state is."""
        common = problem.own[0].start
        chosen = np.eye(len(problem.prior), common)
        return cls(problem, replace(state), Quadratic.of(problem, state).solve(problem.spread, chosen)[:common])

    @property
    def strain(self) -> Strain:
        """Of all numbers that files state."""
        problem, own = self.problem, self.problem.stated
        spread = problem.spread[own]
        moved = (self.state.x - problem.prior)[own] / spread
        return strain_of(moved, self.covariance[own, own] / np.outer(spread, spread))


def step(problem: Problem, state: State, quadratic: Quadratic, free: NDArray[np.bool_] | None = None) -> float:
    """Take a step of Gauss and Newton; return its length in sigmas of the unknowns.

    What pulls an unknown is what the residual has of its slopes along the motion that the model has by itself, so that
    no noise is in both (instruments): the smoothed motion's own noise would pull all that scales a balance to nothing.
    """
    numbers = problem.of_rig
    free = np.ones(len(state.x), dtype=bool) if free is None else free.copy()
    free[numbers] &= (state.x[numbers] > problem.lower) | (quadratic.pull[numbers] > 0.0)
    change = restrained(problem, quadratic, state.reach, free)
    bounded = state.x + change
    bounded[numbers] = np.maximum(bounded[numbers], problem.lower)
    change, state.x = bounded - state.x, bounded
    for part in quadratic.parts:
        for k in part.members:
            own = part.of_member(k, change[problem.local[k]])
            state.coefficients[k] = state.coefficients[k] + part.motion.coefficients(part.against @ own)
    state.follow(problem)
    state.smooth(problem)
    return float(np.sqrt(change @ quadratic.normal @ change))


def restrained(problem: Problem, quadratic: Quadratic, reach: float, free: NDArray[np.bool_] | None) -> Array:
    """The change of unknowns that lessens the cost most while no number of the rig goes farther than `reach` sigmas.

    Rows are linear in all others, which go as far as they like. Source: J. J. More, The Levenberg-Marquardt algorithm:
    implementation and theory, Lecture Notes in Mathematics 630 (1978) 105.
    """
    own, numbers = np.zeros(len(problem.spread)), problem.of_rig
    own[numbers] = 1.0

    def held(by: float) -> tuple[Array, bool]:
        change = quadratic.solve(problem.spread, quadratic.pull, free, by * own)
        return change, bool(np.abs(change / problem.spread)[numbers].max(initial=0.0) <= reach)

    change, near = held(0.0)
    low, high = _HELD
    for _ in range(0 if near else _HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if held(10.0**middle)[1] else (middle, high)
    return change if near else held(10.0**high)[0]
