"""Gauss and Newton on motions and unknowns: banded in the motion of each recording, dense in what they share."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve
from scipy.linalg.lapack import dtrtri

from proof.rivals.case import Array
from proof.rivals.smoother.balance import Motion
from proof.rivals.smoother.basis import LOCAL
from proof.rivals.smoother.course import Course
from proof.rivals.smoother.problem import Problem

# Prior sigmas that a number of the rig goes in a step at most: to begin with, at most, at least; and by what it grows
# where a step made the cost less, and shrinks where it did not.
REACH, _FAR, NEAR, _ONWARD, _BACK = 2.0, 4.0, 0.1, 2.0, 0.4
_HELD = (-3.0, 12.0)  # powers of ten: of what holds the rig's numbers where they are, over what priors do
_HALVINGS = 24
_RUNS = 2  # steps in which a motion follows unknowns that moved


@dataclass(slots=True, eq=False)
class State:
    """Where a fit is: unknowns, coefficients of each recording's motion, and sigmas of all rows."""

    x: Array
    coefficients: list[Array]
    sigma: Array  # (rows,)
    torques: list[Array] = field(default_factory=list)  # of the rotors along each motion
    ideal: list[Array] = field(default_factory=list)  # coefficients of the motion that the model has by itself
    ideal_torques: list[Array] = field(default_factory=list)
    reach: float = REACH
    lowest: float = np.inf  # cost where the last step began

    @classmethod
    def of(cls, problem: Problem, forces: Array) -> State:
        """Before any step, with forces of `forces` (their rows,)."""
        sigma = problem.sigma.copy()
        sigma[problem.forces] = forces
        state = cls(problem.prior.copy(), [problem.start(k) for k in range(len(problem.recordings))], sigma)
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
        return replace(
            self, x=x, coefficients=[*self.coefficients], sigma=self.sigma.copy(), torques=[*self.torques],
            ideal=[*self.ideal], ideal_torques=[*self.ideal_torques], reach=REACH, lowest=np.inf,
        )  # fmt: skip

    def motion(self, problem: Problem, k: int) -> Motion:
        """The motion of a recording."""
        return problem.recordings[k].basis.motion(self.coefficients[k])

    def follow(self, problem: Problem) -> None:
        """Take the rotors' torques where the motion is now."""
        before = self.torques or [None] * len(problem.recordings)
        self.torques = [_torques(problem, k, self.x, self.motion(problem, k), before[k]) for k in range(len(before))]

    def idealise(self, problem: Problem, stiff: float) -> None:
        """Let the model run by itself: forces that it lacks are `stiff` times as large, and readings hardly count."""
        if not self.ideal:
            self.ideal = [problem.start(k) for k in range(len(problem.recordings))]
            self.ideal_torques = [
                _torques(problem, k, self.x, self.ideal_motion(problem, k), None) for k in range(len(self.ideal))
            ]
        sigma = self.sigma.copy()
        sigma[problem.forces] *= stiff
        for k in range(len(self.ideal)):
            if problem.present:
                problem.acting[k], problem.beyond[k] = self.course(problem, k).acting()
            for _ in range(_RUNS):
                self.ideal[k], self.ideal_torques[k] = _moved(
                    problem, k, self.x, self.ideal[k], self.ideal_torques[k], self.weights(problem, k, sigma)
                )

    def smooth(self, problem: Problem) -> None:
        """Bring the motion to where it is best for the unknowns as they are."""
        for k in range(len(self.coefficients)):
            self.coefficients[k], self.torques[k] = _moved(
                problem, k, self.x, self.coefficients[k], self.torques[k], self.weights(problem, k)
            )

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

    def ideal_motion(self, problem: Problem, k: int) -> Motion:
        """The motion that the model has by itself."""
        return problem.recordings[k].basis.motion(self.ideal[k])

    def course(self, problem: Problem, k: int) -> Course:
        """What effects do along that motion."""
        return Course(problem, k, self.x, self.ideal_motion(problem, k), self.ideal_torques[k])

    def weights(self, problem: Problem, k: int, sigma: Array | None = None) -> Array:
        """(n, rows) one over the variance of each row, were it white."""
        sigma = self.sigma if sigma is None else sigma
        weights = np.outer(problem.recordings[k].weight, sigma**-2.0)
        weights[:, problem.angles] *= problem.recordings[k].turning
        weights[:, problem.forces] = sigma[problem.forces] ** -2.0  # they hold where nothing is read
        return weights

    def banded(self, problem: Problem, k: int) -> tuple[Banded, Array]:
        """What a recording's rows say of its motion, and square roots of their weights (n, rows)."""
        root = np.sqrt(self.weights(problem, k))
        slopes = problem.by_motion(k, self.x, self.motion(problem, k), self.torques[k])
        return Banded.of(slopes, problem.recordings[k].basis.values, root), root

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


def _torques(problem: Problem, k: int, x: Array, motion: Motion, before: Array | None) -> Array:
    return problem.recordings[k].field.torques(problem.rig, problem.behind(k, x, motion, before))


@dataclass(frozen=True, slots=True, eq=False)
class Banded:
    """What a recording's rows say of its motion, factorised: blocks of as many samples as see a coefficient.

    A block of samples sees its own coefficients and those of the next block. Of N = R R^T, the normal matrix, R has
    triangles, and what couples a block to the one before.
    """

    seen: Array  # (blocks, LOCAL rows, 2 width) slopes by coefficients, over sigmas as all below
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
        seen = np.zeros((blocks, LOCAL, rows, 2 * LOCAL, freedoms))
        for i in range(LOCAL):
            own = local[i::LOCAL]
            seen[: len(own), i, :, i : i + LOCAL] = own
        seen = seen.reshape(blocks, LOCAL * rows, 2 * width)
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
        return cls(seen, inverse, coupled.copy(), (n, rows), freedoms)

    def against(self, columns: Array) -> Array:
        """R^-1 times products of columns (n rows, m) with what the motion does, (blocks + 1, width, m)."""
        blocks, samples, width = len(self.seen), self.seen.shape[1], self.seen.shape[2] // 2
        padded = columns
        if len(columns) < blocks * samples:
            padded = np.concatenate([columns, np.zeros((blocks * samples - len(columns), columns.shape[1]))])
        products = self.seen.swapaxes(1, 2) @ padded.reshape(blocks, samples, -1)
        out = np.zeros((blocks + 1, width, columns.shape[1]))
        out[:-1] = products[:, :width]
        out[1:] += products[:, width:]
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

    def shown(self, against: Array) -> Array:
        """What the motion takes up of a column (n, rows), of its `against` (blocks + 1, width)."""
        every = np.zeros((len(self.inverse) * LOCAL, self.freedoms))
        found = self.coefficients(against)
        every[: len(found)] = found
        each = every.reshape(len(self.inverse), -1)
        both = np.concatenate([each[:-1], each[1:]], axis=1)[:, :, None]
        n, rows = self.shape
        return np.asarray((self.seen @ both).reshape(-1, rows)[:n])


def _moved(
    problem: Problem, k: int, x: Array, coefficients: Array, torques: Array, weights: Array
) -> tuple[Array, Array]:
    """Coefficients after a step of Gauss and Newton in the motion alone, and the rotors' torques there."""
    basis, root = problem.recordings[k].basis, np.sqrt(weights)
    motion = basis.motion(coefficients)
    banded = Banded.of(problem.by_motion(k, x, motion, torques), basis.values, root)
    left = problem.residual(k, x, motion, torques) * root
    coefficients = coefficients + banded.coefficients(banded.against(left.reshape(-1, 1))[:, :, 0])
    return coefficients, _torques(problem, k, x, basis.motion(coefficients), torques)


@dataclass(frozen=True, slots=True, eq=False)
class Reduced:
    """A recording's rows with its motion taken out of them: columns are projected by `gram`."""

    motion: Banded
    root: Array  # (n, rows) square roots of the weights
    columns: Array  # (n rows, local + 1) unknowns, then the residual
    against: Array  # (blocks + 1, width, local + 1) of them
    whole: Array  # (local + 1, local + 1) their products

    @classmethod
    def of(cls, problem: Problem, state: State, k: int) -> Reduced:
        """At a state; unknowns along the motion that the model has by itself, in which there is no noise."""
        banded, root = state.banded(problem, k)
        left = problem.residual(k, state.x, state.motion(problem, k), state.torques[k])
        by_unknown = problem.by_unknown(k, state.x, state.ideal_motion(problem, k), state.ideal_torques[k])
        columns = np.concatenate([by_unknown, left[:, :, None]], axis=2) * root[:, :, None]
        columns = columns.reshape(root.size, -1)
        against = banded.against(columns)
        return cls(banded, root, columns, against, columns.T @ columns - _flat(against).T @ _flat(against))

    def left(self, change: Array, column: Array | float = 0.0) -> Array:
        """What is left of the rows (n, rows), over their sigmas, after the motion and a change of unknowns (local,).

        `column` (n, rows) is what is known to be in them.
        """
        rest = self.columns @ np.append(-change, 1.0) - np.reshape(column, -1)
        return np.asarray(
            rest.reshape(self.root.shape) - self.motion.shown(self.motion.against(rest[:, None])[:, :, 0])
        )

    def gram(self, columns: Array) -> tuple[Array, Array]:
        """Products of columns (n rows, m) with the unknowns and the residual (m, local + 1), and with each other.

        The latter (m, m), both with the motion taken out.
        """
        against = _flat(self.motion.against(columns))
        return columns.T @ self.columns - against.T @ _flat(self.against), columns.T @ columns - against.T @ against


def _flat(against: Array) -> Array:
    return against.reshape(-1, against.shape[2])


@dataclass(frozen=True, slots=True, eq=False)
class Quadratic:
    """The cost about a state, in the unknowns alone."""

    parts: Mapping[int, Reduced]  # by recording
    normal: Array  # (p, p), priors included
    pull: Array  # (p,)
    left: float  # cost at the best motion for these unknowns

    @classmethod
    def of(cls, problem: Problem, state: State) -> Quadratic:
        """At a state."""
        every = range(len(problem.recordings))
        return cls.over(problem, state, {k: Reduced.of(problem, state, k) for k in every})

    @classmethod
    def over(cls, problem: Problem, state: State, parts: Mapping[int, Reduced]) -> Quadratic:
        """Of some recordings."""
        off = (state.x - problem.prior) / problem.spread
        normal, pull, left = np.diag(problem.spread**-2.0), -off / problem.spread, float(off @ off)
        for k, part in parts.items():
            local, whole = problem.local[k], part.whole
            normal[np.ix_(local, local)] += whole[:-1, :-1]
            pull[local] += whole[:-1, -1]
            left += float(whole[-1, -1])
        return cls(parts, normal, pull, left)

    def solve(
        self, spread: Array, right: Array, free: NDArray[np.bool_] | None = None, held: Array | float = 0.0
    ) -> Array:
        """normal^-1 right, of the free unknowns; zero of the others. `held` is added to the normal's diagonal."""
        scale = spread if free is None else np.where(free, spread, 0.0)
        factor = cho_factor(self.normal * np.outer(scale, scale) + np.diag((scale == 0.0) + held * np.ones(len(scale))))
        found = cho_solve(factor, right.reshape(len(spread), -1) * scale[:, None]) * scale[:, None]
        return np.asarray(found.reshape(right.shape))

    def sigma(self, spread: Array) -> Array:
        """Standard deviation of each unknown."""
        return np.asarray(np.sqrt(np.diag(self.solve(spread, np.eye(len(spread))))))


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
    state.coefficients = [
        c + part.motion.coefficients(part.against @ np.append(-change[local], 1.0))
        for c, part, local in zip(state.coefficients, quadratic.parts.values(), problem.local, strict=True)
    ]
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
