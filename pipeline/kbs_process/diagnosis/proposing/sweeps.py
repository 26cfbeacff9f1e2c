"""A tone whose frequency runs up or down: where the residual has one, for a suspect whose grid only data give."""

from __future__ import annotations

import numpy as np
from scipy.fft import fft, next_fast_len
from scipy.optimize import minimize

from kbs_process.diagnosis.experiments.thresholds import LINE_ALPHA
from kbs_process.estimation.tails import log_tail
from kbs_process.signals.records import Array

_PADDED = 2  # times, for frequencies between those that a recording resolves
_STEP = 1.0  # of the inverse square of a recording's length: sweeps closer than that look alike
_REACH = 0.5  # of the band, that a tone crosses in a recording at most, and
_MOST = 400  # steps up and down, which is less in long recordings
_BETTER = 1.5  # times the power of the strongest steady tone


def sweeping(z: Array, dt: float, highest_Hz: float) -> tuple[float, float, float] | None:
    r"""Power, frequency at the start (Hz) and sweep (Hz/s) of the one tone that takes most of a white series z (n, c).

    Greatest $P(f, k) = \sum_c |\sum_t z_c(t) \exp(-i \pi (2 f + k t) t)|^2 / n$: maximum likelihood of a tone that
    has an amplitude and a phase in every channel. None, if chance or a steady tone does nearly as well.
    Validity: more than a few turns in the series; white noise of unit variance.
    Source: P. M. Djuric, S. M. Kay, Parameter estimation of chirp signals, IEEE Trans. ASSP 38 (1990) 2118.
    """
    n = len(z)
    t = np.arange(n) * dt
    length = n * dt
    size = next_fast_len(_PADDED * n)
    channels = np.ascontiguousarray(z.T)
    inside = np.arange(1, int(np.ceil(highest_Hz * size * dt)))
    f = inside / (size * dt)

    def strongest(sweep: float) -> tuple[tuple[float, float], tuple[float, float]]:
        """Power and frequency of a tone with that sweep, and with the opposite one: z is real, and has it at -f."""
        turned = fft(channels * np.exp(-1j * np.pi * sweep * t**2), size, axis=1)
        power = np.sum(turned.real**2 + turned.imag**2, axis=0)
        sides = power[inside], power[size - inside]
        up, down = ((float(side.max()), float(f[side.argmax()])) for side in sides)
        return up, down

    count = min(_MOST, int(np.ceil(_REACH * highest_Hz * length / _STEP)))
    sweeps = np.arange(-count, count + 1) * (_STEP / length**2)
    both = [strongest(float(sweep)) for sweep in sweeps[count:]]
    found = [*(down for _, down in both[:0:-1]), *(up for up, _ in both)]
    best = max(range(len(sweeps)), key=lambda k: found[k][0])
    power, steady = found[best][0] / n, found[count][0] / n
    chance = log_tail(2.0 * power, 2 * z.shape[1]) + np.log(len(sweeps) * len(inside))
    if chance > np.log(LINE_ALPHA) or power < _BETTER * steady:
        return None

    def less(x: Array) -> float:
        phase = np.exp(-1j * np.pi * (2.0 * x[0] / length + x[1] / length**2 * t) * t)
        return -float(np.sum(np.abs(phase @ z) ** 2)) / n

    begin = np.array([found[best][1] * length, sweeps[best] * length**2])
    end = minimize(less, begin, method="Nelder-Mead", options={"xatol": 1e-4, "fatol": 1e-6})
    return -float(end.fun), float(end.x[0] / length), float(end.x[1] / length**2)
