"""Zero-phase low-pass and differentiation of uniformly sampled channels by one windowed FIR kernel."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft, next_fast_len, rfft, rfftfreq
from scipy.signal import fftconvolve

from kbs_process.signals.records import Array

Index = NDArray[np.intp]
_PIECE = 2**16  # rows that are filtered at a time, or four times the kernel's half
_KAISER_BETA = 11.3  # 110 dB: its ends are small enough to be differentiated
_HALF_LENGTH = 3.6  # in periods of the corner: 110 dB reached within one corner frequency


def kernel_length(corner: float, dt: float) -> int:
    """Samples on either side of the middle of the kernel: where the ends of a record still show."""
    return int(np.ceil(_HALF_LENGTH / (corner * dt)))


def smooth(values: Array, dt: float, corner: float, derivative: int = 0) -> Array:
    """Low-pass (n, ...) channels and differentiate them 0, 1 or 2 times, with zero phase.

    The gain is 1 within 1e-5 up to `corner` Hz (times (j 2 pi f)^derivative), one half at 1.5 `corner`, and below
    1e-5 above twice `corner`. Ends are continued by point reflection, exact for a straight line;
    within `kernel_length` of them values are less certain. A corner that the sampling
    rate does not allow is taken as high as it does.
    """
    return smooth_rows(values.__getitem__, len(values), dt, corner, derivative)


def smooth_rows(
    rows: Callable[[Index], Array], n: int, dt: float, corner: float, derivative: int = 0, *, every: int = 1
) -> Array:
    """`smooth` n rows (k, ...) that are made by their indices (k,), a piece at a time; each `every`-th is returned."""
    half = kernel_length(corner, dt)
    kernel = _kernel(dt, min(1.5 * corner, 0.4 / dt), half, derivative)
    length = every * -(-max(_PIECE, 4 * half) // every)
    pieces = []
    for start in range(0, n, length):
        at = np.arange(start - half, min(start + length, n) + half)
        end = np.clip(at, 0, n - 1)  # the nearest row that there is
        values = rows(end)
        if np.any(at != end):
            values = 2.0 * values - rows(np.clip(2 * end - at, 0, n - 1))
        shape = (-1,) + (1,) * (values.ndim - 1)
        pieces.append(fftconvolve(values, kernel.reshape(shape), mode="valid", axes=0)[::every])
    return np.concatenate(pieces)


def _kernel(dt: float, cutoff: float, half: int, derivative: int) -> Array:
    """Kaiser-windowed sinc, differentiated in the frequency domain: its response times (j 2 pi f)^derivative."""
    length = 2 * half + 1
    h: Array = np.kaiser(length, _KAISER_BETA) * np.sinc(2 * cutoff * dt * np.arange(-half, half + 1))
    h /= h.sum()
    if derivative == 0:
        return h
    padded = next_fast_len(4 * length, real=True)
    response = rfft(h, padded) * (2j * np.pi * rfftfreq(padded, dt)) ** derivative
    differentiated: Array = irfft(response, padded)[:length]
    # What the cut ends leave: a constant must have no derivative.
    differentiated -= h * differentiated.sum()
    return differentiated
