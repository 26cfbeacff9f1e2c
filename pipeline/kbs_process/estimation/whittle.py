"""Gaussian likelihood of coloured residuals in the frequency domain, with linear nuisances projected out.

For a stationary residual x of n samples with one-sided power spectral density S(f), the Fourier coefficients are
independent, and their real and imaginary parts have the variance n S / (4 dt) (Whittle, Ark. Mat. 2:423, 1953). So

    z_k = X_k sqrt(4 dt / (n S_k)),   f_low <= f_k <= f_high

is white with unit variance in 2 numbers a frequency, and choosing a band is choosing k. Validity: records much longer
than the residual's memory; the greatest error is leakage at frequencies below a few 1/(n dt).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kbs_process.signals.records import Array, Mask

_LEAST_BINS = 24  # frequencies in one step of an estimated spectrum: its level is known to 1/sqrt(24)
_STEPS_A_DECADE = 12


@dataclass(frozen=True, slots=True, eq=False)
class StepSpectrum:
    """One-sided power spectral density, constant between `edges`."""

    edges: Array  # (m + 1,) Hz
    density: Array  # (m,) unit^2/Hz, > 0

    def at(self, f: Array) -> Array:
        """Density at frequencies f (k,); outside the edges it is held."""
        index = np.clip(np.searchsorted(self.edges, f, side="right") - 1, 0, len(self.density) - 1)
        density: Array = self.density[index]
        return density


def flat(density: float) -> StepSpectrum:
    """White noise."""
    return StepSpectrum(np.array([0.0, np.inf]), np.array([density]))


@dataclass(frozen=True, slots=True, eq=False)
class Whitener:
    """One channel of one record: which frequencies count, and for how much."""

    inside: Mask  # (n // 2 + 1,) frequencies of the band
    gain: Array  # (k,) of those, 1/unit
    valid: Mask  # (n,) samples that exist

    def __call__(self, columns: Array) -> Array:
        """Whitened coefficients (2 k, c) of columns (n, c), or (2 k,) of one (n,): real parts, then imaginary."""
        present = columns * (self.valid if columns.ndim == 1 else self.valid[:, None])
        spectrum = np.fft.rfft(present, axis=0)[self.inside]
        z = spectrum * (self.gain if columns.ndim == 1 else self.gain[:, None])
        return np.concatenate([z.real, z.imag])


def whitener(valid: Mask, dt: float, band: tuple[float, float], spectrum: StepSpectrum) -> Whitener:
    """The whitener of a channel sampled every `dt` s, where `valid`, in a band (Hz)."""
    f = _frequencies(len(valid), dt)
    inside = (f >= band[0]) & (f <= band[1])
    gain = np.sqrt(4.0 * dt / (np.count_nonzero(valid) * spectrum.at(f[inside])))
    return Whitener(inside, gain, valid)


def _frequencies(n: int, dt: float) -> Array:
    return np.asarray(np.fft.rfftfreq(n, dt), dtype=np.float64)


def project(z: Array, nuisances: Array, priors: Array) -> Array:
    """Return z (k,) less its best fit by `nuisances` (k, m), followed by what their priors make of the fit (m,).

    The amplitudes v minimise |z - N v|^2 + |priors v|^2, `priors` (m,) being one over their standard deviations, 0
    where nothing is known beforehand. The squared length of the result is -2 log of the likelihood maximised over v,
    so that a fit of other parameters to it treats v as jointly fitted (Golub and Pereyra, SIAM J. Numer. Anal.
    10:413, 1973).
    """
    length = np.sqrt(np.sum(nuisances**2, axis=0) + priors**2)
    scale = np.where(length > 0.0, 1.0 / np.where(length > 0.0, length, 1.0), 0.0)
    N, P = nuisances * scale, priors * scale
    normal = N.T @ N + np.diag(P**2)
    # A nuisance that does not move (a joint at rest has no clock) has length zero and stays zero.
    v = np.linalg.lstsq(normal, N.T @ z, rcond=1e-12)[0]
    return np.concatenate([z - N @ v, P * v])


def periodogram(x: Array, valid: Mask, dt: float) -> tuple[Array, Array]:
    """Frequencies (Hz) and one-sided power spectral density of x (n,) where `valid`: (n // 2 + 1,) each."""
    power = np.abs(np.fft.rfft(x * valid)) ** 2 * (2.0 * dt / np.count_nonzero(valid))
    return _frequencies(len(x), dt), np.asarray(power, dtype=np.float64)


def estimated(residual: Array, valid: Mask, dt: float, band: tuple[float, float]) -> StepSpectrum:
    """Spectrum of a residual (n,) in steps of equal ratio that hold at least 24 frequencies each.

    Level of a step: mean periodogram, chi-square with 48 or more degrees of freedom, 20 % or better.
    """
    f, power = periodogram(residual, valid, dt)
    inside = (f >= band[0]) & (f <= band[1])
    f, power = f[inside], power[inside]
    ratio = 10.0 ** (1.0 / _STEPS_A_DECADE)
    starts, begin = [0], 0
    for index in range(len(f)):
        enough = index - begin >= _LEAST_BINS and len(f) - index >= _LEAST_BINS
        if enough and f[index] >= f[begin] * ratio:
            starts.append(index)
            begin = index
    density = np.add.reduceat(power, starts) / np.diff([*starts, len(f)])
    edges = np.concatenate([f[starts], [f[-1] * (1.0 + 1e-9)]])
    return StepSpectrum(edges, np.asarray(density, dtype=np.float64))
