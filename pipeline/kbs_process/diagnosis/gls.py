r"""Generalised least squares of candidates' signatures on whitened residuals, known parameters projected out.

    z = S a + J (theta - theta_hat) + e,   e white,   theta ~ N(theta_0, prior),   amplitudes a free

With $H = \sum J^T J + P$ (P the prior's precision) everything follows from sums over trials of products of columns:

    A = S^T S - S^T J H^{-1} J^T S,   b = S^T z - S^T J H^{-1} (J^T z + P (theta_0 - theta_hat)),
    a = A^+ b,   gain = b^T A^+ b,   kappa = 1 - a^T A a / a^T S^T S a

gain is what -2 log likelihood falls by, chi-square with rank(A) degrees of freedom where there is no effect, and the
square of rho_eff, what is left of rho^2 = a^T S^T S a once the known parameters were refitted.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve, eigh

from kbs_process.diagnosis.tails import log_tail
from kbs_process.diagnosis.thresholds import ABSORBED, DEPENDENT
from kbs_process.signals.records import Array

_NOTHING = 1e-100  # whitened length of a signature that is nothing: squares of its inverse are still numbers


@dataclass(frozen=True, slots=True, eq=False)
class Background:
    """Whitened residuals of independent trials, and how they answer to the known parameters (p,)."""

    z: Mapping[int, Array]  # of each trial, (rows,)
    J: Mapping[int, Array]  # (rows, p)
    factor: tuple[Array, bool]  # of H, scaled
    scale: Array  # (p,)
    shift: Array  # (p,) of H's scaled parameters: the known parameters' own step, zero after a refit

    @classmethod
    def of(
        cls, z: Mapping[int, Array], J: Mapping[int, Array], precision: Array, offset: Array | None = None
    ) -> Background:
        """From residuals, Jacobians, prior precision (p,), and prior mean less present values (p,)."""
        H = sum((J[k].T @ J[k] for k in z), np.diag(precision))
        h = sum((J[k].T @ z[k] for k in z), precision * (0.0 if offset is None else offset))
        size = np.sqrt(np.diag(H))
        scale = np.where(size > 0.0, 1.0 / np.where(size > 0.0, size, 1.0), 0.0)
        H = H * np.outer(scale, scale) + np.diag((size == 0.0) * 1.0) + 1e-12 * np.eye(len(size))
        factor = cho_factor(H)
        return cls(z, J, factor, scale, cho_solve(factor, scale * h) if len(size) else h)

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
    """What a candidate with m amplitudes does for the residuals."""

    gain: float
    rank: int
    kappa: float
    rho: float  # of its own, before anything is refitted
    free: float  # gain along those combinations of amplitudes that known parameters do not take up
    free_rank: int
    amplitude: Array  # (m,)
    covariance: Array  # (m, m)

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
    along = vectors[:, kept]
    root = along / np.sqrt(values[kept])
    a = root @ (root.T @ b)
    free, free_rank = _free(whole, A, b, along)
    alone = float(a @ whole @ a)
    gain = float(np.sum((root.T @ b) ** 2))
    return Score(
        gain=gain,
        rank=int(np.count_nonzero(kept)),
        kappa=1.0 - gain / alone if alone > 0.0 else 1.0,
        rho=float(np.sqrt(alone)),
        free=free,
        free_rank=free_rank,
        amplitude=a * unit,
        covariance=(root @ root.T) * np.outer(unit, unit),
    )


def _free(whole: Array, left: Array, b: Array, along: Array) -> tuple[float, int]:
    """Gain and number of the combinations that are left after absorption, each with a kappa of its own.

    In the basis in which whole = S^T S is one and left = S^T P S is diagonal, 1 - kappa of each: gains add up.
    """
    if not along.shape[1]:
        return 0.0, 0
    share, basis = eigh(along.T @ left @ along, along.T @ whole @ along)
    apart = share > 1.0 - ABSORBED
    gains = (basis.T @ (along.T @ b)) ** 2 / np.maximum(share, 1e-300)
    return float(np.sum(gains[apart])), int(np.count_nonzero(apart))


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
