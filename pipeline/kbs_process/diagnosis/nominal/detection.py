"""Is the mean residual of repeats greater than what repeats differ by? Cell by cell in frequency, with a p-value.

With S estimated from nu complex degrees of freedom, U = sum over a cell's B frequencies of M zbar^H S^-1 zbar is no
chi-square: S^-1 is too large in the mean and U has long tails. Its mean and variance for noise alone,

    E U = B p nu / q,   var U = nu^2 (B E tr W^-2 + B^2 var tr W^-1),   q = nu - p,

W complex Wishart of p channels (moments: Maiwald and Kraus, IEE Proc. Radar Sonar Navig. 147:162, 2000), are those of a
multiple of an F variable, which is exact for B = 1. What fitted numbers have taken up is counted out. Cells combine by
Fisher's method.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2 as chi_square
from scipy.stats import f as fisher_f

from kbs_process.diagnosis.experiments.experiment import Experiment
from kbs_process.diagnosis.experiments.floor import Floor
from kbs_process.diagnosis.experiments.hypothesis import Hypothesis, Prediction
from kbs_process.diagnosis.experiments.metric import counted
from kbs_process.diagnosis.experiments.nuisance import nuisances
from kbs_process.diagnosis.experiments.thresholds import DETECTED, FAINT, TOLERATED, UNFORESEEN
from kbs_process.diagnosis.experiments.whiten import Projector, Whitener, independent
from kbs_process.diagnosis.nominal.known import Known
from kbs_process.signals.records import Array

_LEAST_LOG = -1e5
_MOST_D2 = 1e7  # denominators that are as good as infinite


@dataclass(frozen=True, slots=True, eq=False)
class Cell:
    """A band of one trajectory."""

    trajectory: int
    low_Hz: float
    high_Hz: float
    ratio: float  # mean residual's power over the floor's
    rows: float  # numbers of noise that the mean residual holds
    log_p: float  # natural logarithm


@dataclass(frozen=True, slots=True, eq=False)
class Detection:
    """Is there anything beyond the floor?"""

    cells: tuple[Cell, ...]
    log_p: float  # natural logarithm, of all cells
    ratio: float  # power over the floor's, all cells

    @property
    def left(self) -> bool:
        """Whether what is left is more than chance, and more than floor and search are good for."""
        return bool(self.log_p < np.log(DETECTED) and self.ratio > 1.0 + TOLERATED)

    @property
    def much(self) -> bool:
        """Whether so much is left that it is more than recordings which nothing was fitted to are good for."""
        return bool(self.log_p < np.log(DETECTED) and self.ratio > 1.0 + UNFORESEEN)

    @property
    def faint(self) -> bool:
        """Whether there is something beyond chance, and less of it than floor and search are good for."""
        return bool(self.log_p < np.log(FAINT) and 1.0 < self.ratio <= 1.0 + TOLERATED)

    @property
    def rows(self) -> dict[int, float]:
        """Numbers of noise in the mean residual, by trajectory."""
        rows: dict[int, float] = {}
        for cell in self.cells:
            rows[cell.trajectory] = rows.get(cell.trajectory, 0.0) + cell.rows
        return rows

    @property
    def ratios(self) -> dict[int, float]:
        """Power over the floor's, by trajectory."""
        power: dict[int, float] = {}
        for cell in self.cells:
            power[cell.trajectory] = power.get(cell.trajectory, 0.0) + cell.ratio * cell.rows
        return {trajectory: power[trajectory] / rows for trajectory, rows in self.rows.items()}

    @property
    def log10_p(self) -> float:
        return self.log_p / float(np.log(10.0))


def detect(
    experiment: Experiment,
    floor: Floor,
    predicted: Mapping[int, Prediction],
    trials: Sequence[int],
    *,
    known: Known | None = None,
) -> Detection:
    """Test the mean residuals of `trials`, trajectory by trajectory; `predicted` by drive.

    Of trials that `known` numbers were fitted to, these have taken up part; to what was held out, they add what they
    are uncertain by.
    """
    present = Hypothesis(experiment.rig, experiment.effects) if known is None else known.hypothesis
    whitened = [
        _mean(experiment, floor, predicted, members, present)
        for own in experiment.repeats
        if (members := [k for k in own if k in trials])
    ]
    cells: list[Cell] = []
    power = expected = 0.0
    for one in whitened:
        lost = one.leverage.copy()
        if known is not None and (slopes := known.slopes.get(experiment.reference(one.trajectory))):
            J = one(np.moveaxis(slopes.columns, 0, 2))
            fitted = any(k in experiment.fit for k in experiment.repeats[one.trajectory] if k in trials)
            share = np.einsum("rp,pq,rq->r", J, known.covariance, J, optimize=True)
            lost += np.minimum(share, 1.0) if fitted else -share
        for cell, u, mean in _cells(floor, one, lost):
            cells.append(cell)
            power, expected = power + u, expected + mean
    total = sum(cell.log_p for cell in cells)
    log_p = float(chi_square.logsf(-2.0 * total, 2 * len(cells)))
    return Detection(tuple(cells), max(log_p, _LEAST_LOG), power / expected)


@dataclass(frozen=True, slots=True, eq=False)
class _Mean:
    """The whitened mean residual of a trajectory's repeats, nuisances out."""

    trajectory: int
    f: Array  # (b,)
    z: Array  # (rows,)
    leverage: Array  # (rows,) of the nuisances
    share: Array  # (c,) of each channel's numbers that are independent, and that it counts for
    project: Projector
    whiten: Whitener

    def __call__(self, x: Array) -> Array:
        """(rows, k) of x (n, c, k), as `z` is of the residual."""
        return self.project(counted(self.whiten, self.share, x))[: len(self.z)]


def _mean(
    experiment: Experiment,
    floor: Floor,
    predicted: Mapping[int, Prediction],
    members: Sequence[int],
    hypothesis: Hypothesis,
) -> _Mean:
    trials = [experiment.trials[k] for k in members]
    valid = np.logical_and.reduce([trial.valid for trial in trials])
    near = predicted[trials[0].drive]
    whiten = floor.whitener(trials[0], near.values, valid=valid, repeats=len(trials))
    left = np.mean([trial.measured - predicted[trial.drive].values for trial in trials], axis=0)
    N, precision = nuisances(experiment, trials[0], near, hypothesis)
    share = independent(whiten.window)
    project = Projector.of(counted(whiten, share, N), precision * np.sqrt(len(trials)))
    size = 2 * len(whiten.f) * len(share)
    return _Mean(
        trials[0].trajectory,
        whiten.f,
        project(counted(whiten, share, left))[:size],
        np.sum(project.basis**2, axis=1),
        share,
        project,
        whiten,
    )


def _cells(floor: Floor, one: _Mean, taken: Array) -> list[tuple[Cell, float, float]]:
    """Each cell with its statistic and the mean of that for noise."""
    b = len(one.f)
    z2 = np.sum((one.z.reshape(2, b, -1)) ** 2, axis=(0, 2))
    lost = np.sum(taken.reshape(2, b, -1), axis=(0, 2))
    seen = one.share[one.share > 0.0]
    found = []
    for low, high in itertools.pairwise(floor.edges):
        inside = (one.f > low) & (one.f <= high)
        B = int(inside.sum())
        if B == 0:
            continue
        nu = float(floor.freedom(one.f[inside]).mean())
        full = float(B * seen.sum())
        left = max(full - 0.5 * float(lost[inside].sum()), 0.05 * full)
        # A channel's numbers are correlated by 1 / share and count for share each.
        mean, variance = left, _variance(B, len(seen), nu) * float(seen.mean()) * (left / full)
        u = 0.5 * float(z2[inside].sum())
        log_p = _log_p(u, mean, variance, left)
        cell = Cell(one.trajectory, float(low), float(high), u / mean, 2.0 * mean, log_p)
        found.append((cell, u, mean))
    return found


def _variance(B: int, p: int, nu: float) -> float:
    """Of U (nu - p) / nu."""
    q = nu - p
    if not np.isfinite(nu) or q > 1e6:
        return float(B * p)
    q = max(q, 2.5)
    cube = q**3 - q
    squares = p * (q + p) / cube
    spread = (q * p**2 + p) / cube - (p / q) ** 2
    return float(q**2 * (B * squares + B**2 * spread))


def _log_p(u: float, mean: float, variance: float, dims: float) -> float:
    """Of a multiple of F(2 dims, d2) with that mean and variance."""
    d1 = 2.0 * dims
    # var F / mean^2 F = 2 (d1 + d2 - 2) / (d1 (d2 - 4))
    ratio = variance / mean**2
    excess = ratio - 2.0 / d1
    if excess <= 0.0:
        shape = mean**2 / variance  # narrower or as wide as chi-square: gamma
        return float(max(chi_square.logsf(2.0 * shape * u / mean, 2.0 * shape), _LEAST_LOG))
    d2 = min((2.0 * (d1 - 2.0) / d1 + 4.0 * ratio) / excess, _MOST_D2)
    return float(max(fisher_f.logsf(u / mean * d2 / (d2 - 2.0), d1, d2), _LEAST_LOG))
