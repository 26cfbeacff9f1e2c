"""Means over sampling intervals, back to values at the samples."""

from __future__ import annotations

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft, rfftfreq

from kbs_process.signals.records import Array

_PAD = 64  # samples of continuation at either end, where the ends' difference rings


def instants(means: Array) -> Array:
    r"""Values at the samples of a series (n, ...) whose row k is its mean from sample k to k + 1.

    Equation: $X(f) = \bar X(f) e^{-j \pi f h} / \operatorname{sinc}(f h)$, h the interval; ends are held.
    Validity: what has no power above the Nyquist frequency. A jump rings there, by a fortieth of itself ten samples on.
    Source: A. V. Oppenheim, R. W. Schafer, Discrete-Time Signal Processing (2010), section 4.8: zero-order hold.
    """
    n = len(means)
    ends = [(_PAD, _PAD)] + [(0, 0)] * (means.ndim - 1)
    extended = np.pad(means, ends, mode="edge")
    size = next_fast_len(len(extended), real=True)
    f = rfftfreq(size)
    undone = np.exp(-1j * np.pi * f) / np.sinc(f)
    spectrum = rfft(extended, size, axis=0) * undone.reshape(-1, *[1] * (means.ndim - 1))
    values: Array = irfft(spectrum, size, axis=0)[_PAD : _PAD + n]
    return values
