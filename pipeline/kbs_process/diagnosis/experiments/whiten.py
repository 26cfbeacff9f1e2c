"""Whitening: from channels in time to independent numbers of unit variance, linearly and for all channels at once.

X(f) being the Fourier transform of the tapered channels (n, c), and S(f) their one-sided cross-spectral density,

    z(f) = W(f) X(f),   W^H W = S^-1 4 dt / sum(w^2), W lower triangular,

has real and imaginary parts of unit variance, independent between channels and (but for what the taper shares between
neighbours) between frequencies. Whatever is sent through the same map, a residual or a signature, is compared in
the metric of the noise by plain sums.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal.windows import tukey

from kbs_process.signals.records import Array, Mask

Complex = NDArray[np.complex128]
_TAPER = 0.05  # of a trial, at both ends together
_DEPENDENT = 1e-9  # nuisances that are combinations of others, in units of the largest


@dataclass(frozen=True, slots=True, eq=False)
class Whitener:
    """The map of one trial."""

    window: Array  # (n, c) tapers, zero where nothing is valid
    inside: Mask  # (n // 2 + 1,) frequencies that count
    f: Array  # (b,) Hz
    weights: Complex  # (b, c, c)

    @property
    def shape(self) -> tuple[int, int, int]:
        """How its results are laid out: real and imaginary parts, frequencies, channels."""
        return 2, len(self.f), int(self.weights.shape[1])

    def __call__(self, x: Array) -> Array:
        """Whitened numbers (2 b c,) of x (n, c), or (2 b c, k) of x (n, c, k)."""
        window = self.window if x.ndim == 2 else self.window[:, :, None]
        spectrum = np.fft.rfft(x * window, axis=0)[self.inside]
        z = self.weights @ spectrum if x.ndim == 3 else (self.weights @ spectrum[:, :, None])[:, :, 0]
        size = (-1,) if x.ndim == 2 else (-1, x.shape[2])
        return np.concatenate([z.real, z.imag]).reshape(size)


def window_of(valid: Mask) -> Array:
    """(n,) Tukey taper over what is valid from first to last; zero in gaps."""
    window = np.zeros(len(valid))
    there = np.flatnonzero(valid)
    if len(there):
        first, last = int(there[0]), int(there[-1])
        window[first : last + 1] = tukey(last - first + 1, _TAPER)
    return np.asarray(window * valid, dtype=np.float64)


def independent(windows: Array) -> Array:
    """(c,) share of the numbers at all frequencies that are independent, of channels with windows (n, c).

    What a window leaves out correlates neighbours: of white noise the sum of B squared moduli varies as that of
    B (sum w^2)^2 / (n sum w^4) independent ones. 0 of a channel that shows nothing.
    """
    square, fourth = np.sum(windows**2, axis=0), np.sum(windows**4, axis=0)
    return np.asarray(square**2 / (len(windows) * np.where(fourth > 0.0, fourth, 1.0)), dtype=np.float64)


def frequencies(n: int, dt: float, band: tuple[float, float]) -> tuple[Array, Mask]:
    """Frequencies (n // 2 + 1,) and which lie in a band; the mean of a trial, its taring, never does."""
    f = np.asarray(np.fft.rfftfreq(n, dt), dtype=np.float64)
    return f, np.asarray((f >= band[0]) & (f <= band[1]) & (f > 0.0), dtype=np.bool_)


def whitener(windows: Array, dt: float, band: tuple[float, float], density: Complex) -> Whitener:
    """The whitener of tapered channels, windows (n, c), with noise of density (b, c, c) in the band.

    Channels whose window is empty come out as zeros. Noise that two channels share counts as far as both see it.
    """
    f, inside = frequencies(len(windows), dt, band)
    overlap = windows.T @ windows
    power = np.diag(overlap)
    seen = power > 0.0
    share = overlap / np.sqrt(np.outer(np.where(seen, power, 1.0), np.where(seen, power, 1.0)))
    share[~seen, ~seen] = 1.0
    factor = np.linalg.cholesky(density * share)
    weights = np.linalg.solve(factor, np.broadcast_to(np.eye(factor.shape[1]), factor.shape))
    gain = np.where(seen, np.sqrt(4.0 * dt / np.where(seen, power, 1.0)), 0.0)
    return Whitener(windows, inside, f[inside], np.asarray(weights * gain, dtype=np.complex128))


@dataclass(frozen=True, slots=True, eq=False)
class Projector:
    """Takes nuisances out of whitened numbers: columns that may have any amplitude, or one within its prior.

    With A = [N; P], P one over the amplitudes' standard deviations (0: free), z becomes [z; 0] less its projection on
    A. Its squared length is -2 log likelihood, maximised over the nuisances. Rows of P are kept for those with a prior.
    """

    basis: Array  # (rows, k) orthonormal, of N
    tail: Array  # (priors, k)

    @classmethod
    def of(cls, N: Array, precision: Array) -> Projector:
        """Of whitened columns N (rows, k) and one over their standard deviations (k,)."""
        length = np.sqrt(np.sum(N**2, axis=0) + precision**2)
        kept = length > 0.0
        scale = 1.0 / length[kept]
        bound = precision[kept] > 0.0
        A = np.vstack([N[:, kept] * scale, np.diag(precision[kept] * scale)[bound]])
        U, s, _ = np.linalg.svd(A, full_matrices=False)
        Q = U[:, s > _DEPENDENT * s[0]] if len(s) else U
        return cls(Q[: len(N)], Q[len(N) :])

    def __call__(self, z: Array) -> Array:
        """(rows + priors,) or (rows + priors, k) of z (rows,) or (rows, k)."""
        along = self.basis.T @ z
        return np.concatenate([z - self.basis @ along, -self.tail @ along])
