r"""Generalised least squares of candidates' signatures on whitened residuals, known parameters projected out.

    z = S a + J (theta - theta_hat) + e,   e white,   theta ~ N(theta_0, prior),   amplitudes a free

With $H = \sum J^T J + P$ (P the prior's precision) everything follows from sums over trials of products of columns:

    A = S^T S - S^T J H^{-1} J^T S,   b = S^T z - S^T J H^{-1} (J^T z + P (theta_0 - theta_hat)),
    a = A^+ b,   gain = b^T A^+ b,   kappa = 1 - a^T A a / a^T S^T S a

gain is what -2 log likelihood falls by, chi-square with rank(A) degrees of freedom where there is no effect, and the
square of rho_eff, what is left of rho^2 = a^T S^T S a once the known parameters were refitted. Combinations of
amplitudes of which these leave less than a hundredth are theirs: what they would gain does not count.

Known numbers have bounds. Where they would go farther, alone or beside the effect, amplitudes and numbers together are
the least squares between these, and gain is what that gains beyond the numbers alone: else these seem to do what the
effect does. Which combinations are an effect's own is told without bounds: what a number would do if it went on is its.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve, eigh

from kbs_process.diagnosis.experiments.thresholds import ABSORBED, DEPENDENT
from kbs_process.estimation.bounded import bounded_minimum
from kbs_process.estimation.tails import log_tail
from kbs_process.signals.records import Array

_RIDGE = 1e-12  # of unit columns
_NOTHING = 1e-100  # whitened length of a signature that is nothing: squares of its inverse are still numbers


@dataclass(frozen=True, slots=True, eq=False)
class Bounded:
    """Known parameters, scaled, between bounds."""

    H: Array  # (p, p)
    h: Array  # (p,)
    low: Array  # (p,)
    high: Array  # (p,)
    at: Array  # (p,) where they are best without any candidate
    alone: float  # what they gain there

    @classmethod
    def of(cls, H: Array, h: Array, low: Array, high: Array) -> Bounded:
        x = bounded_minimum(H, h, low, high)
        return cls(H, h, low, high, x, float(2.0 * h @ x - x @ H @ x))

    def bars(self, step: Array) -> bool:
        """Whether a step (p,) leads beyond bounds."""
        return bool(((step < self.low) | (step > self.high)).any())

    def beside(self, whole: Array, pull: Array, across: Array) -> tuple[Array, float]:
        """Best amplitudes (m,) beside them, and what these gain: S^T S (m, m), S^T z (m,), S^T J (m, p), scaled."""
        m = len(pull)
        A = np.block([[self.H, across.T], [across, whole + _RIDGE * np.eye(m)]])
        b = np.concatenate([self.h, pull])
        free = np.full(m, np.inf)
        x = bounded_minimum(
            A,
            b,
            np.concatenate([self.low, -free]),
            np.concatenate([self.high, free]),
            np.concatenate([self.at, np.zeros(m)]),
        )
        return x[-m:], max(0.0, float(2.0 * b @ x - x @ A @ x) - self.alone)


@dataclass(frozen=True, slots=True, eq=False)
class Background:
    """Whitened residuals of independent trials, and how they answer to the known parameters (p,)."""

    z: Mapping[int, Array]  # of each trial, (rows,)
    J: Mapping[int, Array]  # (rows, p)
    factor: tuple[Array, bool]  # of H, scaled
    scale: Array  # (p,)
    shift: Array  # (p,) of H's scaled parameters: the known parameters' own step, zero after a refit
    bounded: Bounded | None = None  # where known numbers have bounds

    @classmethod
    def of(
        cls,
        z: Mapping[int, Array],
        J: Mapping[int, Array],
        precision: Array,
        offset: Array | None = None,
        room: tuple[Array, Array] | None = None,
    ) -> Background:
        """From residuals, Jacobians, prior precision (p,), and prior mean less present values (p,).

        `room` is how far each known number may go down and up.
        """
        H = sum((J[k].T @ J[k] for k in z), np.diag(precision))
        h = sum((J[k].T @ z[k] for k in z), precision * (0.0 if offset is None else offset))
        size = np.sqrt(np.diag(H))
        scale = np.where(size > 0.0, 1.0 / np.where(size > 0.0, size, 1.0), 0.0)
        H = H * np.outer(scale, scale) + np.diag((size == 0.0) * 1.0) + _RIDGE * np.eye(len(size))
        factor = cho_factor(H)
        shift = cho_solve(factor, scale * h) if len(size) else h
        bounded = None
        if room is not None:
            low, high = (np.multiply(side, size, out=np.zeros_like(size), where=size > 0.0) for side in room)
            bounded = Bounded.of(H, scale * h, low, high)
        return cls(z, J, factor, scale, shift, bounded)

    @property
    def rows(self) -> int:
        return sum(len(one) for one in self.z.values())


@dataclass(frozen=True, slots=True, eq=False)
class Sums:
    """Products of some columns with themselves, the residual and the known parameters, added over trials."""

    SS: Array  # (m, m)
    Sz: Array  # (m,)
    SJ: Array  # (m, p)

    @classmethod
    def over(cls, background: Background, columns: Mapping[int, Array]) -> Sums:
        """Of the same columns (rows, m) in each trial.

        Trials that share one array of columns are whitened alike: these, and their slopes, are multiplied once.
        """
        groups: dict[int, list[int]] = {}
        for k, x in columns.items():
            groups.setdefault(id(x), []).append(k)
        SS, Sz, SJ = [], [], []
        for members in groups.values():
            x = columns[members[0]]
            SS.append(len(members) * (x.T @ x))
            Sz.append(x.T @ np.sum([background.z[k] for k in members], axis=0))
            SJ.append(len(members) * (x.T @ background.J[members[0]]))
        return cls(np.sum(SS, axis=0), np.sum(Sz, axis=0), np.sum(SJ, axis=0))

    def pick(self, index: NDArray[np.intp]) -> Sums:
        return Sums(self.SS[np.ix_(index, index)], self.Sz[index], self.SJ[index])


@dataclass(frozen=True, slots=True, eq=False)
class Score:
    """What a candidate with m amplitudes does for the residuals, along combinations that are its own.

    With those that known parameters take up as well: `kappa`, `rho` before anything is refitted, `whole` amplitudes.
    """

    gain: float
    rank: int
    amplitude: Array  # (m,)
    covariance: Array  # (m, m)
    kappa: float
    rho: float
    whole: Array  # (m,)
    whole_gain: float
    whole_rank: int

    @property
    def rho_eff(self) -> float:
        return float(np.sqrt(self.gain))

    @property
    def log_p(self) -> float:
        """Natural logarithm of the chance of such a gain without the effect."""
        return log_tail(self.gain, self.rank)


def score(background: Background, sums: Sums) -> Score:
    """Fit a candidate's amplitudes; combinations that the known parameters span, or that do nothing, have none."""
    length = np.sqrt(np.diag(sums.SS))
    shows = length > _NOTHING
    unit = np.where(shows, 1.0 / np.where(shows, length, 1.0), 0.0)
    SJ = sums.SJ * background.scale * unit[:, None]
    A = sums.SS * np.outer(unit, unit)
    whole = A
    b = sums.Sz * unit
    if SJ.shape[1]:
        b = b - SJ @ background.shift
        A = A - SJ @ cho_solve(background.factor, SJ.T)
    values, vectors = np.linalg.eigh(A)
    kept = values > DEPENDENT
    root = _combinations(whole, A, vectors[:, kept])
    a = root @ (root.T @ b)
    alone, gain = float(a @ whole @ a), float(np.sum((root.T @ b) ** 2))
    # Where whole = S^T S is one, root is that of the inverse of 1 - kappa.
    own = root[:, np.sum((whole @ root) * root, axis=0) * (1.0 - ABSORBED) < 1.0]
    share, own_gain = own.T @ b, float(np.sum((own.T @ b) ** 2))
    bounded = background.bounded
    step = background.shift - cho_solve(background.factor, SJ.T @ (own @ share)) if SJ.shape[1] else share
    if bounded is not None and own.shape[1] and (bounded.bars(background.shift) or bounded.bars(step)):
        share, own_gain = bounded.beside(own.T @ whole @ own, own.T @ (sums.Sz * unit), own.T @ SJ)
    return Score(
        gain=own_gain,
        rank=own.shape[1],
        amplitude=own @ share * unit,
        covariance=(own @ own.T) * np.outer(unit, unit),
        kappa=1.0 - gain / alone if alone > 0.0 else 1.0,
        rho=float(np.sqrt(alone)),
        whole=a * unit,
        whole_gain=gain,
        whole_rank=root.shape[1],
    )


def _combinations(whole: Array, left: Array, along: Array) -> Array:
    """Combinations of amplitudes, columns, that are independent before and after absorption: gains add up.

    In that basis left = S^T P S is one, and whole = S^T S diagonal: 1 / (1 - kappa) of each.
    """
    if not along.shape[1]:
        return along
    share, basis = eigh(along.T @ left @ along, along.T @ whole @ along)
    return np.asarray(along @ basis / np.sqrt(share), dtype=np.float64)


def per_trial(background: Background, columns: Mapping[int, Array]) -> Sums:
    """Sums of columns that have amplitudes of their own in each trial: trial by trial, m columns each."""
    parts = [Sums.over(background, {k: x}) for k, x in columns.items()]
    count = sum(len(part.Sz) for part in parts)
    SS, place = np.zeros((count, count)), 0
    for part in parts:
        own = slice(place, place + len(part.Sz))
        SS[own, own] = part.SS
        place += len(part.Sz)
    return Sums(SS, np.concatenate([part.Sz for part in parts]), np.concatenate([part.SJ for part in parts]))


def absorbing(background: Background, sums: Sums, amplitude: Array, names: Sequence[str]) -> tuple[str, ...]:
    """Known parameters that take up a candidate of that amplitude, those that do most of it first.

    The step that they make towards it, each in units of what is known of it with all others.
    """
    step = cho_solve(background.factor, background.scale * (amplitude @ sums.SJ))
    share = np.abs(step)
    order = np.argsort(-share)
    return tuple(names[k] for k in order[:3] if share[k] > 0.1 * share[order[0]])
