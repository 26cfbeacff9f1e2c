"""Cross-spectral density matrix of a stream at its full rate, in one pass (Welch)."""

from __future__ import annotations

import numpy as np
from scipy import fft
from scipy.signal import get_window

from kbs_process.signals.records import Array, Mask, Spectrum

DOUBT = 0.01  # a segment with a larger share of invented samples is left out
OCTAVES = 3  # in which a noise is looked for
LINES = 8  # averages counted, that tell it
_LEAST = 8  # samples of a segment
_LAST = 16  # lines up to half the sampling rate, and as many beside them


class Welch:
    """Hann window, half-overlapping segments of 2^k samples, each without its mean.

    Density scaling: the integral of S_ii over f is the variance of channel i. S_ij = <conj(X_i) X_j>. The
    relative standard error of a density is about 1 / sqrt(averages).
    """

    def __init__(self, rate: float, resolution: float, limit: float, channels: tuple[str, ...]) -> None:
        """Rate, resolution (at least as fine as this) and highest frequency kept, Hz."""
        self._rate = rate
        self._limit = limit
        self._channels = channels
        self._length = 1 << int(np.ceil(np.log2(max(rate / resolution, _LEAST))))
        self._rows: Array = np.empty((self._length, len(channels)))
        self._flags: Mask = np.zeros(self._length, dtype=np.bool_)
        self._filled = 0
        self._averages = 0
        self._setup(self._length)

    def push(self, rows: Array, invented: Mask | None) -> None:
        """Take uniform rows (n, c) and their flags."""
        start = 0
        while start < len(rows):
            count = min(self._length - self._filled, len(rows) - start)
            into = slice(self._filled, self._filled + count)
            self._rows[into] = rows[start : start + count]
            self._flags[into] = False if invented is None else invented[start : start + count]
            self._filled += count
            start += count
            if self._filled == self._length:
                self._add(self._rows, self._flags)
                half = self._length // 2
                self._rows[:half] = self._rows[half:]
                self._flags[:half] = self._flags[half:]
                self._filled = self._length - half

    def result(self) -> Spectrum | None:
        """Return the mean over the segments; a recording of less than one gets shorter, coarser ones."""
        if self._averages == 0:
            rows, flags = self._rows[: self._filled].copy(), self._flags[: self._filled].copy()
            length = 1 << int(np.log2(max(len(rows) // 4, 1)))
            if length < _LEAST:
                return None
            self._setup(length)
            for start in range(0, len(rows) - length + 1, length // 2):
                self._add(rows[start : start + length], flags[start : start + length])
        if self._averages == 0:
            return None
        alternating = np.sqrt(np.maximum(self._fastest, 0.0) / self._averages)
        return Spectrum(self._f, self._sum / self._averages, self._channels, self._averages, alternating)

    def _setup(self, length: int) -> None:
        f = np.asarray(np.fft.rfftfreq(length, 1.0 / self._rate), dtype=np.float64)
        self._f: Array = f[f <= self._limit]
        self._window: Array = get_window("hann", length)
        one_sided = np.where((self._f > 0.0) & (self._f < 0.5 * self._rate), 2.0, 1.0)
        self._scale: Array = np.asarray(one_sided / (self._rate * float(self._window @ self._window)), dtype=np.float64)
        self._fastest = np.zeros(len(self._channels))
        self._sum = np.zeros((len(self._f), len(self._channels), len(self._channels)), dtype=np.complex128)

    def _add(self, rows: Array, flags: Mask) -> None:
        if np.count_nonzero(flags) > DOUBT * len(flags):
            return
        x = np.ascontiguousarray(rows.T)
        x = (x - x.mean(axis=1, keepdims=True)) * self._window
        every = fft.rfft(x, axis=1)
        X = np.ascontiguousarray(every[:, : len(self._f)].T)
        count = min(_LAST, every.shape[1] // 3)  # of a slow stream they would reach its signals
        last, beside = np.split(np.abs(every[:, : -1 - 2 * count : -1]) ** 2, [count], axis=1)
        scale = 2.0 / (len(self._window) * float(self._window @ self._window))
        self._fastest += scale * (last.sum(axis=1) - 0.5 * last[:, 0] - beside.sum(axis=1))
        self._sum += self._scale[:, None, None] * (X.conj()[:, :, None] * X[:, None, :])
        self._averages += 1


def quietest(spectrum: Spectrum, rate: float, top: float) -> Array:
    """White noise (c,), rms a sample at `rate`, in the quietest of the octaves below `top`, Hz; NaN if few lines tell.

    Signals only add to noise: the quietest octave holds least of them.
    """
    top = min(top, 0.45 * rate, float(spectrum.f[-1]))
    octaves = [(top / 2.0 ** (k + 1) < spectrum.f) & (spectrum.f <= top / 2.0**k) for k in range(OCTAVES)]
    power = np.diagonal(spectrum.S, axis1=1, axis2=2).real
    means = [power[one].mean(axis=0) for one in octaves if spectrum.averages * np.count_nonzero(one) >= LINES]
    noise: Array = np.sqrt(0.5 * rate * np.min(means or [np.full(power.shape[1], np.nan)], axis=0))
    return noise
