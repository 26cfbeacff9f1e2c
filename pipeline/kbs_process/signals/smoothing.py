"""Zero-phase low-pass and differentiation of uniformly sampled channels by one windowed FIR kernel."""

from __future__ import annotations

import numpy as np
from scipy.signal import fftconvolve

from kbs_process.signals.records import Array

_KAISER_BETA = 7.857  # 80 dB
_HALF_LENGTH = 2.51  # in periods of the corner: 80 dB reached within one corner frequency


def kernel_length(corner: float, dt: float) -> int:
    """Samples on either side of the middle of the kernel: where the ends of a record still show."""
    return int(np.ceil(_HALF_LENGTH / (corner * dt)))


def smooth(values: Array, dt: float, corner: float, derivative: int = 0) -> Array:
    """Low-pass (n, c) channels and differentiate them 0, 1 or 2 times, with zero phase.

    The gain is 1 within 1e-4 up to `corner` Hz (relative to (j 2 pi f)^derivative) and below 1e-4 above twice
    `corner`. Ends are continued by point reflection, exact for a straight line; within `kernel_length` of
    them values are less certain. A corner that the sampling rate does not allow is taken as high as it does.
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
    """Windowed derivative of the ideal low-pass; exact for polynomials up to its own degree."""
    t = dt * np.arange(-half, half + 1)
    window = np.kaiser(2 * half + 1, _KAISER_BETA)
    w = 2 * np.pi * cutoff
    at = w * np.where(t == 0.0, 1.0, t)
    sine, cosine = np.sin(at), np.cos(at)
    h: Array
    if derivative == 0:
        h = window * np.where(t == 0.0, 1.0, sine / at)
        h /= h.sum()
    elif derivative == 1:
        h = window * np.where(t == 0.0, 0.0, (at * cosine - sine) / at**2)
        h /= -(h @ t)
    else:
        h = window * np.where(t == 0.0, -1.0 / 3.0, -sine / at - 2 * cosine / at**2 + 2 * sine / at**3)
        h -= window * (h.sum() / window.sum())
        h /= 0.5 * (h @ t**2)
    return h
