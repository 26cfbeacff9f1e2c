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

_HALVES = 6  # of a step that does not gain
_ENOUGH = 1e-3  # of the cost: a step that gains less is the last


@dataclass(slots=True, eq=False)
class State:
    """Where a fit is: unknowns, coefficients of each recording's motion, and sigmas of all rows."""

    x: Array
    coefficients: list[Array]
    sigma: Array  # (rows,)
    torques: list[Array] = field(default_factory=list)  # of the rotors along each motion

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
        self.torques = [
            recording.field.torques(problem.rig, problem.behind(k, self.x, self.motion(problem, k), before[k]))
            for k, recording in enumerate(problem.recordings)
        ]

    def weights(self, problem: Problem, k: int) -> Array:
        """(n, rows) one over the variance of each row, as far as samples are independent."""
        weights = np.outer(problem.recordings[k].weight, problem.independent / self.sigma**2)
        weights[:, problem.angles] *= problem.recordings[k].turning
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


@dataclass(frozen=True, slots=True, eq=False)
class Reduced:
    """A recording's rows with its motion taken out of them: columns are projected by `gram`."""

    by_motion: Array  # (n, rows, LOCAL freedoms) square roots of weights in it, as in all below
    places: NDArray[np.intp]  # (n, LOCAL freedoms) of the coefficients
    factor: Array  # banded
    size: int
    root: Array  # (n, rows) square roots of the weights
    columns: Array  # (n rows, local + 1) unknowns, then the residual
    against: Array  # (size, local + 1) their products with the motion
    solved: Array

    def gram(self, columns: Array) -> tuple[Array, Array]:
        """Products of columns (n rows, m) with the unknowns and the residual (m, local + 1), and with each other.

        The latter (m, m), both with the motion taken out.
        """
        against = self.against_motion(columns)
        solved = cho_solve_banded((self.factor, True), against)
        return columns.T @ self.columns - against.T @ self.solved, columns.T @ columns - against.T @ solved

    def against_motion(self, columns: Array) -> Array:
        """Products (size, m) of columns with what the motion does."""
        n, rows, width = self.by_motion.shape
        products = np.einsum("nri,nrm->nim", self.by_motion, columns.reshape(n, rows, -1), optimize=True)
        out = np.zeros((self.size, products.shape[2]))
        for i in range(width):
            np.add.at(out, self.places[:, i], products[:, i])
        return out


def reduce(problem: Problem, state: State, k: int) -> Reduced:
    """Factorise a recording's motion."""
    recording, motion = problem.recordings[k], state.motion(problem, k)
    by_motion, by_unknown = problem.slopes(k, state.x, motion, state.torques[k])
    left = problem.residual(k, state.x, motion, state.torques[k])
    root = np.sqrt(state.weights(problem, k))
    n, rows, freedoms = recording.n, problem.rows, problem.freedoms
    width = LOCAL * freedoms
    local = np.einsum("nrdk,kna->nrad", by_motion, recording.splines.values, optimize=True).reshape(n, rows, width)
    local = local * root[:, :, None]
    places = recording.splines.first[:, None] * freedoms + np.arange(width)
    size = recording.splines.size * freedoms
    products = np.einsum("nri,nrj->nij", local, local, optimize=True)
    banded = np.zeros((width, size))
    for i in range(width):
        for j in range(i + 1):
            np.add.at(banded[i - j], places[:, j], products[:, i, j])
    banded[0] = banded[0] * (1 + 1e-9) + 1e-9 * np.median(banded[0])
    factor = cholesky_banded(banded, lower=True)
    columns = np.concatenate([by_unknown * root[:, :, None], (left * root)[:, :, None]], axis=2).reshape(n * rows, -1)
    part = Reduced(local, places, factor, size, root, columns, np.zeros(0), np.zeros(0))
    against = part.against_motion(columns)
    return Reduced(local, places, factor, size, root, columns, against, cho_solve_banded((factor, True), against))


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
            part = reduce(problem, state, k)
            whole = part.columns.T @ part.columns - part.against.T @ part.solved
            normal[np.ix_(local, local)] += whole[:-1, :-1]
            pull[local] += whole[:-1, -1]
            left += float(whole[-1, -1])
            parts.append(part)
        return cls(parts, normal, pull, left)

    def solve(self, spread: Array, right: Array, free: NDArray[np.bool_] | None = None) -> Array:
        """normal^-1 right, of the free unknowns; zero of the others."""
        chosen = np.ones(len(spread), dtype=bool) if free is None else free
        scale = spread[chosen]
        columns = right.reshape(len(spread), -1)[chosen] * scale[:, None]
        factor = cho_factor(self.normal[np.ix_(chosen, chosen)] * np.outer(scale, scale))
        out = np.zeros((len(spread), columns.shape[1]))
        out[chosen] = cho_solve(factor, columns) * scale[:, None]
        return out.reshape(right.shape)


def descend(problem: Problem, state: State, steps: int, free: NDArray[np.bool_]) -> None:
    """Take some steps of Gauss and Newton, halved where they do not gain."""
    cost = state.cost(problem)
    for _ in range(steps):
        quadratic = Quadratic.of(problem, state)
        change = quadratic.solve(problem.spread, quadratic.pull, free)
        moves = [
            (part.solved[:, -1] - part.solved[:, :-1] @ change[local]).reshape(-1, problem.freedoms)
            for part, local in zip(quadratic.parts, problem.local, strict=True)
        ]
        step, gained = 1.0, False
        for _ in range(_HALVES):
            tried = State(
                state.x + step * change,
                [c + step * move for c, move in zip(state.coefficients, moves, strict=True)],
                state.sigma,
                state.torques,
            )
            tried.follow(problem)
            after = tried.cost(problem)
            gained = after < cost
            if gained:
                break
            step /= 2
        if not gained:
            return
        small = cost - after < _ENOUGH * after
        state.x, state.coefficients, state.torques, cost = tried.x, tried.coefficients, tried.torques, after
        if small:
            return
