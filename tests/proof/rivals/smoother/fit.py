"""Gauss and Newton on motions and unknowns: banded in the motion of each recording, dense in what they share."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve, cho_solve_banded, cholesky_banded

from proof.rivals.case import Array
from proof.rivals.smoother.balance import Motion
from proof.rivals.smoother.problem import Problem
from proof.rivals.smoother.splines import LOCAL

_FAR = 4.0  # prior sigmas that a step goes at most
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

    @classmethod
    def of(cls, problem: Problem, forces: Array) -> State:
        """Before any step, with forces of `forces` (their rows,)."""
        sigma = problem.sigma.copy()
        sigma[problem.forces] = forces
        state = cls(problem.prior.copy(), [problem.start(k) for k in range(len(problem.recordings))], sigma)
        state.follow(problem)
        return state

    def motion(self, problem: Problem, k: int) -> Motion:
        """The motion of a recording."""
        return problem.recordings[k].splines.motion(self.coefficients[k])

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

    def ideal_motion(self, problem: Problem, k: int) -> Motion:
        """The motion that the model has by itself."""
        return problem.recordings[k].splines.motion(self.ideal[k])

    def weights(self, problem: Problem, k: int, sigma: Array | None = None) -> Array:
        """(n, rows) one over the variance of each row, as far as samples are independent."""
        sigma = self.sigma if sigma is None else sigma
        weights = np.outer(problem.recordings[k].weight, problem.independent / sigma**2)
        weights[:, problem.angles] *= problem.recordings[k].turning
        weights[:, problem.forces] = problem.independent / sigma[problem.forces] ** 2  # they hold where nothing is read
        return weights

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
    """What a recording's rows say of its motion, factorised."""

    by_motion: Array  # (n, rows, LOCAL freedoms) square roots of weights in it, as in all below
    factor: Array
    size: int

    @classmethod
    def of(cls, problem: Problem, k: int, by_motion: Array, root: Array) -> Banded:
        """Of slopes (n, rows, freedoms, 3) and square roots of weights (n, rows)."""
        recording, freedoms = problem.recordings[k], problem.freedoms
        n, width = recording.n, LOCAL * problem.freedoms
        bases = recording.splines.values.transpose(1, 2, 0)  # (n, LOCAL, 3)
        local = np.matmul(bases[:, None], by_motion.swapaxes(2, 3)).reshape(n, problem.rows, width)
        local *= root[:, :, None]
        size = recording.splines.size * freedoms
        products = np.matmul(local.swapaxes(1, 2), local)
        banded = np.zeros((width, size))
        for i in range(width):
            for j in range(i + 1):
                banded[i - j, j : j + freedoms * (n - 1) : freedoms] += products[:-1, i, j]
                banded[i - j, j + freedoms * (n - 2)] += products[-1, i, j]
        banded[0] = banded[0] * (1 + 1e-9) + 1e-9 * np.median(banded[0])
        return cls(local, cholesky_banded(banded, lower=True), size)

    def against(self, columns: Array) -> Array:
        """Products (size, m) of columns (n rows, m) with what the motion does."""
        n, rows, width = self.by_motion.shape
        products = np.matmul(self.by_motion.swapaxes(1, 2), columns.reshape(n, rows, -1))
        out = np.zeros((self.size, products.shape[2]))
        each = out.reshape(-1, width // LOCAL, products.shape[2])
        for a, part in enumerate(np.split(products, LOCAL, axis=1)):
            each[a : a + n - 1] += part[:-1]
            each[a + n - 2] += part[-1]  # the last sample sees the coefficients of the one before it
        return out

    def shown(self, coefficients: Array) -> Array:
        """What coefficients (size, 1) of the motion do to the rows (n, rows)."""
        n, _, width = self.by_motion.shape
        freedoms = width // LOCAL
        each = coefficients.reshape(-1, freedoms)
        first = np.minimum(np.arange(n), n - 2)
        local = np.concatenate([each[first + a] for a in range(LOCAL)], axis=1)
        return np.asarray(np.matmul(self.by_motion, local[:, :, None])[:, :, 0])

    def solve(self, against: Array) -> Array:
        """Coefficients (size, m) that take columns up, of their products with the motion."""
        return np.asarray(cho_solve_banded((self.factor, True), against))


def _moved(
    problem: Problem, k: int, x: Array, coefficients: Array, torques: Array, weights: Array
) -> tuple[Array, Array]:
    """Coefficients after a step of Gauss and Newton in the motion alone, and the rotors' torques there."""
    splines, root = problem.recordings[k].splines, np.sqrt(weights)
    motion = splines.motion(coefficients)
    banded = Banded.of(problem, k, problem.by_motion(k, x, motion, torques), root)
    left = problem.residual(k, x, motion, torques) * root
    coefficients = coefficients + banded.solve(banded.against(left.reshape(-1, 1))).reshape(coefficients.shape)
    return coefficients, _torques(problem, k, x, splines.motion(coefficients), torques)


@dataclass(frozen=True, slots=True, eq=False)
class Reduced:
    """A recording's rows with its motion taken out of them: columns are projected by `gram`."""

    motion: Banded
    root: Array  # (n, rows) square roots of the weights
    columns: Array  # (n rows, local + 1) unknowns, then the residual
    against: Array  # (size, local + 1) their products with the motion
    solved: Array

    @classmethod
    def of(cls, problem: Problem, state: State, k: int) -> Reduced:
        """At a state; unknowns along the motion that the model has by itself, in which there is no noise."""
        motion = state.motion(problem, k)
        root = np.sqrt(state.weights(problem, k))
        banded = Banded.of(problem, k, problem.by_motion(k, state.x, motion, state.torques[k]), root)
        left = problem.residual(k, state.x, motion, state.torques[k])
        by_unknown = problem.by_unknown(k, state.x, state.ideal_motion(problem, k), state.ideal_torques[k])
        columns = np.concatenate([by_unknown, left[:, :, None]], axis=2) * root[:, :, None]
        columns = columns.reshape(root.size, -1)
        against = banded.against(columns)
        return cls(banded, root, columns, against, banded.solve(against))

    def left(self, change: Array, column: Array | float = 0.0) -> Array:
        """What is left of the rows (n, rows), over their sigmas, after the motion and a change of unknowns (local,).

        `column` (n, rows) is what is known to be in them.
        """
        rest = self.columns @ np.append(-change, 1.0) - np.reshape(column, -1)
        taken = self.motion.solve(self.motion.against(rest[:, None]))
        return np.asarray(rest.reshape(self.root.shape) - self.motion.shown(taken))

    def gram(self, columns: Array) -> tuple[Array, Array]:
        """Products of columns (n rows, m) with the unknowns and the residual (m, local + 1), and with each other.

        The latter (m, m), both with the motion taken out.
        """
        against = self.motion.against(columns)
        mixed = columns.T @ self.columns - against.T @ self.solved
        return mixed, columns.T @ columns - against.T @ self.motion.solve(against)


@dataclass(frozen=True, slots=True, eq=False)
class Quadratic:
    """The cost about a state, in the unknowns alone."""

    parts: list[Reduced]
    normal: Array  # (p, p), priors included
    pull: Array  # (p,)
    left: float  # cost at the best motion for these unknowns

    @classmethod
    def of(cls, problem: Problem, state: State) -> Quadratic:
        """At a state."""
        off = (state.x - problem.prior) / problem.spread
        normal, pull = np.diag(problem.spread**-2.0), -off / problem.spread
        left, parts = float(off @ off), []
        for k, local in enumerate(problem.local):
            part = Reduced.of(problem, state, k)
            whole = part.columns.T @ part.columns - part.against.T @ part.solved
            normal[np.ix_(local, local)] += whole[:-1, :-1]
            pull[local] += whole[:-1, -1]
            left += float(whole[-1, -1])
            parts.append(part)
        return cls(parts, normal, pull, left)

    def solve(self, spread: Array, right: Array, free: NDArray[np.bool_] | None = None) -> Array:
        """normal^-1 right, of the free unknowns; zero of the others."""
        scale = spread if free is None else np.where(free, spread, 0.0)
        factor = cho_factor(self.normal * np.outer(scale, scale) + np.diag((scale == 0.0).astype(float)))
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
    change = quadratic.solve(problem.spread, quadratic.pull, free)
    change *= min(1.0, _FAR / max(float(np.abs(change / problem.spread).max()), 1e-300))
    bounded = state.x + change
    bounded[problem.of_rig] = np.maximum(bounded[problem.of_rig], problem.lower)
    change, state.x = bounded - state.x, bounded
    state.coefficients = [
        c + (part.solved[:, -1] - part.solved[:, :-1] @ change[local]).reshape(-1, problem.freedoms)
        for c, part, local in zip(state.coefficients, quadratic.parts, problem.local, strict=True)
    ]
    state.follow(problem)
    state.smooth(problem)
    return float(np.sqrt(change @ quadratic.normal @ change))
