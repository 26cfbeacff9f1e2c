"""Zero-phase low-pass and differentiation of uniformly sampled channels by one windowed FIR kernel."""

from __future__ import annotations

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft, rfftfreq
from scipy.signal import fftconvolve

from kbs_process.signals.records import Array

_KAISER_BETA = 11.3  # 110 dB: its ends are small enough to be differentiated
_HALF_LENGTH = 3.6  # in periods of the corner: 110 dB reached within one corner frequency


def kernel_length(corner: float, dt: float) -> int:
    """Samples on either side of the middle of the kernel: where the ends of a record still show."""
    return int(np.ceil(_HALF_LENGTH / (corner * dt)))


def smooth(values: Array, dt: float, corner: float, derivative: int = 0) -> Array:
    """Low-pass (n, c) channels and differentiate them 0, 1 or 2 times, with zero phase.

    The gain is 1 within 1e-5 up to `corner` Hz (times (j 2 pi f)^derivative), one half at 1.5 `corner`, and below
    1e-5 above twice `corner`. Ends are continued by point reflection, exact for a straight line;
    within `kernel_length` of them values are less certain. A corner that the sampling
    rate does not allow is taken as high as it does.
    """
    half = kernel_length(corner, dt)
    kernel = _kernel(dt, min(1.5 * corner, 0.4 / dt), half, derivative)
    n = len(values)
    reach = min(half, n - 1)
    extended = np.concatenate(
        [2 * values[:1] - values[reach:0:-1], values, 2 * values[-1:] - values[-2 : -reach - 2 : -1]]
    )
    if reach < half:
        pad = [(half - reach, half - reach)] + [(0, 0)] * (values.ndim - 1)
        extended = np.pad(extended, pad, mode="edge")
    shape = (-1,) + (1,) * (values.ndim - 1)
    smoothed: Array = fftconvolve(extended, kernel.reshape(shape), mode="valid", axes=0)
    return smoothed


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
