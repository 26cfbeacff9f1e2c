"""The repeatability floor: what repeats of a trajectory differ by, as a cross-spectral density of all channels.

Each repeat's residual less the mean of its repeats holds the noise alone, whatever the model misses, so long as that
comes again each time. With M repeats and L neighbouring frequencies in a cell,

    S = sum (x_i - xbar)(x_i - xbar)^H / (L (M - 1)),   nu = L (M - 1) complex degrees of freedom

pooled over trajectories, after each channel was divided by a smooth level that falls with frequency (white, 1/f and
1/f^2, fitted to the same differences), so that a cell is flat. What repeats share although it is noise, the rounding
of encoders along one and the same path, is added from the predicted motion. Repeats that differ by less than a plant
is exact to, as simulated ones may, have that for a floor.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from kbs_process.diagnosis.experiments.experiment import Experiment, Trial
from kbs_process.diagnosis.experiments.whiten import Whitener, frequencies, independent, whitener, window_of
from kbs_process.signals.records import WRENCH_CHANNELS, Array, Mask
from kbs_process.stages.align.resample import resample

Complex = NDArray[np.complex128]
_LEAST = 4  # degrees of freedom a channel that a cell must have
_CELLS_A_DECADE = 8.0
_KNEE = 0.05  # Hz: where 1/f noise equals white noise, taken of a transducer whose runs are not repeated
_PHASES = 8  # of an encoder code, over which rounding is averaged
_LEAST_ROUNDING = 0.05  # of the density of white rounding: less is not believed
_EXACT = 1e-2  # of the density of stated noise: to a tenth of its amplitude an integrator's step is good enough
_MOVING = 2.0  # codes a second below which an encoder says no more than which code it shows
_SETTLE = 0.5  # s around
_UNKNOWN_ANGLE = 1e-6  # rad rms a sample, of an encoder whose code is not stated
_UNSEEN = 0.05  # of white rounding: what an encoder's readings differ by between repeats that nobody made
_LEVEL_ROUNDS = 30
_TRUSTED = 0.98  # of what channels have in common


@dataclass(frozen=True, slots=True, eq=False)
class Floor:
    """Noise of one trial, as repeats show it or as the sensors' data sheets say.

    `C` is relative to `level`, and that to the trial's declared white density; both are functions of frequency.
    """

    experiment: Experiment
    edges: Array  # (m + 1,) Hz of the cells
    centres: Array  # (m,) Hz
    C: Complex  # (m, c, c)
    nu: Array  # (m,) complex degrees of freedom; inf where nothing was estimated
    level: Array  # (3, c) of white, 1/f and 1/f^2 noise
    source: Literal["repeats", "declared"]
    statement: str

    def repeats(self, trial: Trial, f: Array) -> Complex:
        """Density (b, c, c) of what differs from repeat to repeat, unit^2/Hz."""
        root = np.sqrt(_white(self.experiment, trial) * (_shapes(f) @ self.level))  # (b, c)
        C = _between(f, self.centres, self.C)
        return np.asarray(root[:, :, None] * C * root[:, None, :], dtype=np.complex128)

    def freedom(self, f: Array) -> Array:
        """Degrees of freedom (b,) at frequencies f: those of the weighted mean of two cells' estimates."""
        if not np.isfinite(self.nu).all():
            return np.full(len(f), np.inf)
        low, share = _places(f, self.centres)
        high = np.minimum(low + 1, len(self.nu) - 1)
        return np.asarray(1.0 / ((1.0 - share) ** 2 / self.nu[low] + share**2 / self.nu[high]), dtype=np.float64)

    def shared(self, trial: Trial, path: Array, windows: Array, f: Array) -> Array:
        """Density (b, c) of what repeats share although no model explains it, beyond `repeats`.

        That is the encoders' rounding, and by how much the plant's solution may be wrong.
        """
        differing = np.asarray(np.einsum("bcc->bc", self.repeats(trial, f)).real, dtype=np.float64)
        wrench = self.experiment.loads
        alike = np.tile(_EXACT * _white(self.experiment, trial), (len(f), 1))
        alike[:, wrench:] = rounding(self.experiment, trial, path, windows, f)
        return np.maximum(alike - differing, 0.0)

    def whitener(
        self, trial: Trial, path: Array, lowest_Hz: float = 0.0, *, valid: Mask | None = None, repeats: int = 1
    ) -> Whitener:
        """The whitener of a trial from `lowest_Hz` on; `path` (n, c) is a prediction of its channels.

        Or that of the mean of some `repeats`, where all are `valid`.
        An estimated S^-1 is too large by nu / (nu - c) in the mean (complex Wishart); that is taken back.
        """
        experiment = self.experiment
        band = (lowest_Hz, experiment.highest_Hz)
        windows = channel_windows(experiment, trial, trial.valid if valid is None else valid)
        f, inside = frequencies(len(windows), experiment.dt, band)
        f = f[inside]
        c = len(experiment.channels)
        nu = self.freedom(f)
        inflation = np.where(np.isfinite(nu), 1.0 + c / np.maximum(np.where(np.isfinite(nu), nu, 1.0) - c, 1.0), 1.0)
        density = self.repeats(trial, f) * inflation[:, None, None] / repeats
        density = density + self.shared(trial, path, windows, f)[:, :, None] * np.eye(c)
        return whitener(windows, experiment.dt, band, density)


def estimate(experiment: Experiment, residuals: Mapping[int, Array]) -> Floor:
    """Estimate the floor from residuals (n, c) of trials, whose model need not be right."""
    repeated = [members for members in experiment.repeats if len(members) > 1]
    rows = max((len(members) - 1 for members in repeated), default=0)
    groups = [_differences(experiment, members, residuals, rows) for members in repeated]
    c = len(experiment.channels)
    if not groups:
        return declared(experiment)
    f = np.concatenate([group.f for group in groups])
    order = np.argsort(f, kind="stable")
    f = f[order]
    x = np.concatenate([group.contrasts for group in groups])[order]
    nu = np.concatenate([np.tile(group.count, (len(group.f), 1)) for group in groups])[order]
    freedom = np.concatenate([np.full(len(group.f), group.freedom.max()) for group in groups])[order]
    level = np.stack([_level(f, _power(x[:, :, k], nu[:, k]), nu[:, k]) for k in range(c)], axis=1)
    x = x / np.sqrt(_shapes(f) @ level)[:, None, :]
    cells = _cells(f, freedom, _LEAST * c)
    C, dof, centres, edges = [], [], [], [0.0]
    for first, end in itertools.pairwise(cells):
        own = x[first:end].reshape(-1, c)
        gram = np.asarray(own.T @ own.conj(), dtype=np.complex128)
        C.append(_normalised(gram, nu[first:end].sum(axis=0)))
        dof.append(float(freedom[first:end].sum()))
        centres.append(float(np.exp(np.mean(np.log(f[first:end])))))
        edges.append(float(f[end - 1]))
    runs = sum(len(members) for members in repeated)
    plural = "trajectory" if len(groups) == 1 else "trajectories"
    return Floor(
        experiment, np.array(edges), np.array(centres), np.array(C), np.array(dof), level, "repeats",
        f"from what {runs} recordings of {len(groups)} repeated {plural} differ by",
    )  # fmt: skip


def smaller(one: Floor, other: Floor) -> Floor:
    """The smaller of two floors of the same recordings, estimated with two models.

    Repeats that were not driven alike differ by the noise and by what a model makes wrongly of their drives.
    """
    return min(one, other, key=_size)


def _size(floor: Floor) -> float:
    """Mean logarithm of the density of all channels."""
    f = np.geomspace(floor.centres[0], floor.experiment.highest_Hz, 64)
    return float(np.mean(np.linalg.slogdet(floor.repeats(floor.experiment.trials[0], f))[1]))


def declared(experiment: Experiment) -> Floor:
    """The floor of the data sheets: white noise and rounding of the sensors, 1/f noise below `_KNEE` in the wrench."""
    c, wrench = len(experiment.channels), experiment.loads
    level = np.zeros((3, c))
    level[0, :wrench] = 1.0
    level[1, :wrench] = _KNEE
    level[0, wrench:] = np.where(encoder_steps(experiment) > 0.0, _UNSEEN, 1.0)
    statement = (
        "no trajectory was repeated: the sensors' stated noise and rounding, and 1/f noise below "
        f"{_KNEE:g} Hz, are taken for all that differs from run to run"
    )
    return Floor(
        experiment, np.geomspace(_KNEE, experiment.highest_Hz, 16), np.ones(1), np.eye(c)[None].astype(complex),
        np.full(1, np.inf), level, "declared", statement,
    )  # fmt: skip


def _white(experiment: Experiment, trial: Trial) -> Array:
    """(c,) one-sided density of the sensors' stated white noise and rounding, decoupled, unit^2/Hz."""
    rig = experiment.rig
    index = [WRENCH_CHANNELS.index(channel) for channel in rig.transducer.channels]
    efforts = [joint.effort for joint in rig.joints if joint.effort is not None]
    resolution = np.concatenate(
        [rig.transducer.resolution.value[index], [float(effort.resolution) for effort in efforts]]
    )
    wrench = rig.loads.noise[rig.loads.index(rig.channels)] ** 2 + resolution**2 / 12.0
    steps = encoder_steps(experiment)
    angle = np.where(steps > 0.0, steps**2 / 12.0, _UNKNOWN_ANGLE**2)
    return np.concatenate([wrench * 2.0 / trial.wrench_rate, angle * 2.0 / trial.angle_rate])


def encoder_steps(experiment: Experiment) -> Array:
    """(angles,) rad, code of the encoder behind each angle channel; 0 where none is stated."""
    joints = [experiment.rig.joints[place] for place in experiment.angle_joints]
    return np.array([float(joint.encoder.step) if joint.encoder else 0.0 for joint in joints])


def _shapes(f: Array) -> Array:
    return np.stack([np.ones_like(f), 1.0 / f, 1.0 / f**2], axis=1)


@dataclass(frozen=True, slots=True, eq=False)
class _Differences:
    """What the repeats of one trajectory differ by, over the root of white density: all rows as long as the longest."""

    f: Array  # (b,) Hz
    contrasts: Complex  # (b, rows, c), zero where there is none
    count: Array  # (c,) contrasts a frequency; 0 of a channel that shows nothing
    freedom: Array  # (c,) complex degrees of freedom a frequency: fewer, as windows correlate neighbours


def _differences(
    experiment: Experiment, members: Sequence[int], residuals: Mapping[int, Array], rows: int
) -> _Differences:
    """M - 1 orthonormal contrasts of M residuals, which hold all that these differ by."""
    trials = [experiment.trials[k] for k in members]
    windows = channel_windows(experiment, trials[0], np.logical_and.reduce([t.valid for t in trials]))
    f, inside = frequencies(len(windows), experiment.dt, (0.0, experiment.highest_Hz))
    power = np.sum(windows**2, axis=0)
    seen = power > 0.0
    spectra = []
    for k, trial in zip(members, trials, strict=True):
        left = _detrended(residuals[k], windows, experiment.loads)
        gain = np.sqrt(2.0 * experiment.dt / np.where(seen, power, 1.0) / _white(experiment, trial))
        spectra.append(np.fft.rfft(left * windows, axis=0)[inside] * gain)
    contrasts = np.zeros((int(inside.sum()), rows, len(seen)), dtype=np.complex128)
    contrasts[:, : len(members) - 1] = _helmert(len(members)) @ np.stack(spectra, axis=1)
    count = np.where(seen, len(members) - 1.0, 0.0)
    return _Differences(f[inside], contrasts, count, count * np.minimum(independent(windows), 1.0))


def _power(x: Complex, nu: Array) -> Array:
    """(b,) mean power of contrasts (b, rows) with nu (b,) of them."""
    power: Array = np.sum(np.abs(x) ** 2, axis=1) / np.maximum(nu, 1.0)
    return power


def _normalised(gram: Complex, nu: Array) -> Complex:
    """(c, c) of a sum of outer products in which each channel has nu (c,) terms; 1 for a channel with none.

    What channels have in common is taken by `_TRUSTED` of it, so that the matrix stays positive.
    """
    root = np.sqrt(np.maximum(nu, 1.0))
    C = gram / np.outer(root, root)
    size = np.where(nu > 0.0, np.diag(C).real, 1.0)
    return np.asarray(_TRUSTED * (C - np.diag(np.diag(C))) + np.diag(size), dtype=np.complex128)


def _helmert(m: int) -> Array:
    """(m - 1, m) orthonormal contrasts."""
    rows = np.tril(np.ones((m, m)), -1)[1:] - np.diag(np.arange(1.0, m), 1)[:-1]
    return np.asarray(rows / np.linalg.norm(rows, axis=1, keepdims=True), dtype=np.float64)


def _detrended(x: Array, windows: Array, wrench: int) -> Array:
    """Constant and slope of the wrench's channels taken off, the constant of the angles'."""
    t = np.linspace(-1.0, 1.0, len(x))
    out = x.copy()
    for k in range(x.shape[1]):
        w = windows[:, k]
        A = np.stack([np.ones_like(t), t], axis=1)[:, : 2 if k < wrench else 1]
        out[:, k] -= A @ np.linalg.lstsq(A * w[:, None], x[:, k] * w, rcond=None)[0]
    return out


def _level(f: Array, power: Array, nu: Array) -> Array:
    """(3,) of white, 1/f and 1/f^2 noise: Whittle's likelihood of mean periodograms (b,), by multiplicative steps.

    theta_j <- theta_j sum(A_j P/S^2) / sum(A_j 1/S) raises the likelihood and keeps every theta >= 0 (the
    Itakura-Saito step of Fevotte et al., Neural Computation 21:793, 2009).
    """
    if not nu.any():
        return np.array([_UNSEEN, 0.0, 0.0])
    A = _shapes(f) / np.sum(_shapes(f) * nu[:, None], axis=0)  # columns of equal weight
    theta = np.full(3, max(float(np.mean(power)), 1e-12) / max(float(np.mean(A.sum(axis=1))), 1e-300))
    for _ in range(_LEVEL_ROUNDS):
        S = A @ theta
        theta = theta * np.sqrt((A.T @ (nu * power / S**2)) / (A.T @ (nu / S)))
    level = theta / np.sum(_shapes(f) * nu[:, None], axis=0)
    return np.asarray(np.maximum(level, np.array([1e-9, 0.0, 0.0])), dtype=np.float64)


def _cells(f: Array, nu: Array, least: float) -> list[int]:
    """Bounds of cells of ascending frequencies, each with `least` degrees of freedom and a minimum of width."""
    bounds, begin, ratio = [0], 0, 10.0 ** (1.0 / _CELLS_A_DECADE)
    total = np.concatenate([[0.0], np.cumsum(nu)])
    for k in range(1, len(f)):
        enough = total[k] - total[begin] >= least and total[-1] - total[k] >= least
        if enough and f[k] >= f[begin] * ratio and f[k] > f[k - 1]:
            bounds.append(k)
            begin = k
    return [*bounds, len(f)]


def _places(f: Array, centres: Array) -> tuple[NDArray[np.intp], Array]:
    """The cell below each frequency and the share of the one above, linear in log f, held beyond the ends."""
    at = np.interp(np.log(f), np.log(centres), np.arange(len(centres)))
    low = np.minimum(at.astype(np.intp), max(len(centres) - 2, 0))
    return low, np.asarray(at - low, dtype=np.float64)


def _between(f: Array, centres: Array, C: Complex) -> Complex:
    """C (b, c, c) at frequencies between the cells' centres: a mean of positive matrices is one."""
    low, share = _places(f, centres)
    high = np.minimum(low + 1, len(centres) - 1)
    return np.asarray((1.0 - share)[:, None, None] * C[low] + share[:, None, None] * C[high], dtype=np.complex128)


def channel_windows(experiment: Experiment, trial: Trial, valid: Mask) -> Array:
    """(n, c) tapers; an encoder's is zero where its joint rests.

    At rest an encoder says which code it shows, and shows nothing of motions within it: taken for a reading, that
    silence would deny them. A code a fraction of a second long is dither, and the mean of readings follows the angle.
    """
    whole = window_of(valid)
    windows = np.repeat(whole[:, None], len(experiment.channels), axis=1)
    for k, step in enumerate(encoder_steps(experiment), experiment.loads):
        if step > 0.0:
            windows[:, k] = window_of(valid & _moving(_filled(trial, k), step, experiment.dt))
    return windows


def _filled(trial: Trial, channel: int) -> Array:
    """(n,) a channel as measured, straight across gaps: what is not there does not move."""
    there = np.flatnonzero(trial.valid)
    if not len(there):
        return trial.measured[:, channel]
    filled = np.interp(np.arange(len(trial.valid)), there, trial.measured[there, channel])
    return np.asarray(filled, dtype=np.float64)


def _moving(angle: Array, step: float, dt: float) -> Mask:
    """Where a joint passes codes."""
    span = max(1, round(_SETTLE / dt))
    padded = np.pad(angle, span, mode="edge")
    rate = np.abs(padded[2 * span :] - padded[: -2 * span]) / (2 * span * dt)
    return np.asarray(rate > _MOVING * step, dtype=np.bool_)


def rounding(experiment: Experiment, trial: Trial, path: Array, windows: Array, f: Array) -> Array:
    """(b, angles) density of the encoders' rounding along a predicted path (n, c), mean over positions within a code.

    A measured path will not do: what it shows of its own rounding hides the codes' regular passing.

    Smoothed over a tenth of a decade, as its lines move with the least error in rate.
    """
    steps = encoder_steps(experiment)
    angle = path[:, experiment.loads :]
    n = len(angle)
    dt, rate = experiment.dt, trial.angle_rate
    every, inside = frequencies(n, dt, (0.0, experiment.highest_Hz))
    found = np.zeros((len(f), len(steps)))
    t = np.arange(int((n - 1) * dt * rate) + 1) / rate
    for k, step in enumerate(steps):
        window = windows[:, experiment.loads + k]
        white = step**2 / 12.0 * 2.0 / rate
        power = float(window @ window)
        if step == 0.0 or power == 0.0:
            continue
        fine = np.interp(t, dt * np.arange(n), angle[:, k]) / step
        codes = fine[:, None] + np.arange(_PHASES) / _PHASES
        error = resample(step * (np.round(codes) - codes), rate, 1.0 / dt)
        error = np.pad(error, ((0, max(0, n - len(error))), (0, 0)), mode="edge")[:n]
        spectrum = np.mean(np.abs(np.fft.rfft(error * window[:, None], axis=0)) ** 2, axis=1) * 2.0 * dt / power
        level = np.interp(f, every[inside], _smoothed(every[inside], spectrum[inside]))
        found[:, k] = np.maximum(level, _LEAST_ROUNDING * white)
    return found


def _smoothed(f: Array, power: Array) -> Array:
    """Running mean over a tenth of a decade, and over 8 frequencies at least."""
    total = np.concatenate([[0.0], np.cumsum(power)])
    index = np.arange(len(f))
    low = np.minimum(np.searchsorted(f, f * 10.0**-0.05), np.maximum(index - 4, 0))
    high = np.maximum(np.searchsorted(f, f * 10.0**0.05), np.minimum(index + 4, len(f)))
    return np.asarray((total[high] - total[low]) / (high - low), dtype=np.float64)
