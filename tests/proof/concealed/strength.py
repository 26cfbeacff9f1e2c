"""How far apart two predictions are, in units of the floor, and how much of that known parameters absorb.

Whitened entries are 2 dt FFT(y) (df/S)^(1/2), real and imaginary parts of the bins below BAND_HZ: with a one-sided
density S of the noise each has unit variance, and the sum of squares is rho^2 = 4 Int |Y|^2/S df. What a laboratory's
noise makes of the rig is common to the channels: in every bin, entries are whitened by the lower root of 1 + P, where
P (8, 8) is the mean over realisations and neighbouring bins of what these entries have of it. What repeats differ by
is part of the floor: constant and slope of every channel, clocks' offsets, friction and inclination of each run, as
columns with their sigmas. Known parameters are columns of all runs together, with the sigmas that the campaign states:

    rho^2     = d' (I + G G')^-1 d             G: one set a run
    rho_eff^2 = d' (I + G G' + J J')^-1 d      J: common
    kappa     = 1 - rho_eff^2/rho^2
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.ndimage import uniform_filter1d
from scipy.signal.windows import tukey

from engine.hardware import AXES, Array, Hardware
from engine.sensors import CLOCK_OFFSET, PINK_CORNER
from proof.concealed.observed import WORKING_HZ, Motion

BAND_HZ = 8.0
_EDGES = 0.05  # share of a run that is tapered
_REST = 20.0  # s; an encoder that shows one code for as long tells nothing of the motion
_FREE = 1e3  # sigmas of what is not known at all, in units of the noise
_NEIGHBOURS = 5  # bins each way, of which the noise that the rig shows is the mean: less than its resonances' width


@dataclass(frozen=True, slots=True)
class Strength:
    """Distance of an effect from the floor."""

    rho: float
    kappa: float
    rho_eff: float


@dataclass(frozen=True, slots=True, eq=False)
class Whitening:
    """Makes a run's readings (n, 8) white."""

    gain: Array  # (bins, 8)
    window: Array  # (n, 8): 0 where an encoder rests
    common: Array | None = None  # (bins, 8, 8) lower roots: of the noise that the channels share

    @classmethod
    def of(
        cls, hardware: Hardware, readings: Array, wrench_hz: float, encoder_hz: float, disturbed: Sequence[Array] = ()
    ) -> Whitening:
        """From the sensors' noise; encoders' codes are as white as the motion across them makes them.

        Each of `disturbed` (n, 8) is what one realisation of a laboratory's noise changes in the readings.
        """
        n = len(readings)
        f = np.fft.rfftfreq(n, 1 / WORKING_HZ)
        used = (f > 0) & (f <= BAND_HZ)
        density = np.full((used.sum(), 8), np.inf)
        noise, step = hardware["transducer.noise"], hardware["transducer.resolution"]
        white = 2 * (noise**2 + step**2 / 12) / wrench_hz
        density[:, :6] = white + 2 * noise**2 / wrench_hz * PINK_CORNER / f[used, None]
        window = np.tile(tukey(n, 2 * _EDGES)[:, None], (1, 8))
        for k, axis in enumerate(AXES):
            code = hardware.scalar(f"joint.{axis}.encoder.step")
            rate = np.abs(np.gradient(readings[:, 6 + k])) * WORKING_HZ
            moving = rate > code / _REST
            window[~moving, 6 + k] = 0.0
            if moving.any():
                crossings = float(np.exp(np.mean(np.log(rate[moving])))) / code
                density[:, 6 + k] = 2 * code**2 / 12 / min(encoder_hz, max(crossings, 1.0 / _REST))
        dt, df = 1 / WORKING_HZ, WORKING_HZ / n
        alone = cls(2 * dt * np.sqrt(df / density), window)
        return replace(alone, common=_root(alone, disturbed)) if len(disturbed) else alone

    def spectrum(self, columns: Array) -> Array:
        """Columns (n, 8, m) over the sensors' noise: (bins, 8, m), complex."""
        spectrum = np.fft.rfft(columns * self.window[:, :, None], axis=0)[1 : 1 + len(self.gain)]
        return np.asarray(spectrum * self.gain[:, :, None])

    def __call__(self, readings: Array) -> Array:
        """Whitened entries (2 bins 8, ...) of readings (n, 8) or of columns (n, 8, m)."""
        shape = readings.shape
        spectrum = self.spectrum(readings.reshape(*shape[:2], -1))
        if self.common is not None:
            spectrum = np.linalg.solve(self.common, spectrum)
        return np.concatenate([spectrum.real, spectrum.imag]).reshape(-1, *shape[2:])


def _root(alone: Whitening, disturbed: Sequence[Array]) -> Array:
    """The lower root of 1 + P in every bin."""
    entries = alone.spectrum(np.stack(disturbed, axis=2))
    power = np.einsum("bim,bjm->bij", entries, entries.conj()) / (2 * len(disturbed))
    power = uniform_filter1d(power, 2 * _NEIGHBOURS + 1, axis=0, mode="nearest")
    return np.asarray(np.linalg.cholesky(np.eye(8) + power))


@dataclass(frozen=True, slots=True, eq=False)
class Setting:
    """A trajectory's part of the metric."""

    motion: Motion
    whiten: Whitening
    repeats: int
    common: Array  # (k, p) whitened sensitivity to known parameters, times sigma
    own: Array  # (k, q) whitened, times sigma: what differs from run to run

    def above_floor(self, columns: Array) -> Array:
        """(I + G G')^-1 columns."""
        inner = cho_factor(np.eye(self.own.shape[1]) + self.own.T @ self.own)
        return np.asarray(columns - self.own @ cho_solve(inner, self.own.T @ columns))


def own_columns(whiten: Whitening, readings: Array, varying: Array) -> Array:
    """What differs from run to run: `varying` (n, 8, m), clocks' offsets, constants and slopes of the wrench."""
    n = len(readings)
    rate = np.gradient(readings, axis=0) * WORKING_HZ
    clocks = np.zeros((n, 8, 2))
    clocks[:, :6, 0], clocks[:, 6:, 1] = CLOCK_OFFSET * rate[:, :6], CLOCK_OFFSET * rate[:, 6:]
    drifts = np.zeros((n, 8, 12))
    for channel in range(6):
        drifts[:, channel, channel] = 1.0
        drifts[:, channel, 6 + channel] = np.linspace(-1.0, 1.0, n)
    white = whiten(drifts)
    white = white * (_FREE / np.maximum(np.linalg.norm(white, axis=0), 1e-30))
    return np.hstack([whiten(varying), whiten(clocks), white])


def strength(settings: Sequence[Setting], changes: Sequence[Array]) -> Strength:
    """Distance of `changes`, one whitened vector a trajectory, over all repeats of all trajectories.

    Runs are independent but for the known parameters, so the floor is taken out run by run.
    """
    p = settings[0].common.shape[1]
    normal, right, rho2 = np.eye(p), np.zeros(p), 0.0
    for setting, change in zip(settings, changes, strict=True):
        clean = setting.above_floor(change)
        rho2 += setting.repeats * float(change @ clean)
        normal += setting.repeats * setting.common.T @ setting.above_floor(setting.common)
        right += setting.repeats * setting.common.T @ clean
    eff2 = max(rho2 - float(right @ cho_solve(cho_factor(normal), right)), 0.0)
    return Strength(float(np.sqrt(rho2)), float(1 - eff2 / rho2) if rho2 > 0 else 0.0, float(np.sqrt(eff2)))
