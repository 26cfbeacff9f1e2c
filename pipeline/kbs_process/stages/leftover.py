"""What the data show of a load that a model leaves: a frequency, an angle, a step, a drift, or a time."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from kbs_process.signals.records import Array, Mask

HALF = 0.5  # share of the power that a description has to hold
_WINDOW = 0.1  # of a recording
_POWERS = 3  # of an angle


def description(x: Array, valid: Mask, dt: float, q: Array, joints: Sequence[str], load: Array) -> str:
    """Describe a history x (n,), left of a `load` (n,) along angles q (n, joints), by what holds half of its power."""
    t = dt * np.arange(len(x))
    later = -np.gradient(load, dt)
    t, x, q, later = t[valid], x[valid], q[valid], later[valid]
    later -= later.mean() if len(later) else 0.0
    centred: Array = x - x.mean() if len(x) > 8 else np.zeros(1)
    if not centred.any():
        return "too little of it is known to say more"
    share, words = max(_shares(t.astype(np.float64), centred, dt, q, joints, later))
    if share < HALF:
        return "no one frequency, angle, step, drift or time holds half of it"
    return f"{100.0 * share:.0f} % of its power is {words}"


def _shares(t: Array, x: Array, dt: float, q: Array, joints: Sequence[str], late: Array) -> Iterator[tuple[float, str]]:
    """Yield shares of the power of x (n,), about its mean, and what each is; `late`: what a lag of 1 s would leave."""
    power = float(x @ x)
    if late.any():
        lag = float(x @ late) / float(late @ late)
        if abs(lag) < _WINDOW * (t[-1] - t[0]):
            yield _held(x, late[:, None]), f"a lag of {lag:.2g} s behind the angles: clocks, or a filter"
    yield _held(x, np.vander((t - t[0]) / (t[-1] - t[0]), 2)), "a drift with time"
    before = np.cumsum(x)[:-1]
    count = np.arange(1.0, len(x))
    gain = before**2 * len(x) / (count * (len(x) - count))
    at = int(np.argmax(gain))
    yield float(gain[at]) / power, f"a step at {t[at]:.1f} s"
    for index, joint in enumerate(joints):
        span = float(np.ptp(q[:, index]))
        if span > 0.0:
            yield _held(x, np.vander((q[:, index] - q[:, index].mean()) / span, _POWERS)), f"a curve of {joint}'s angle"
    size = max(1, int(_WINDOW * len(x)))
    energy = np.convolve(x**2, np.ones(size), "valid")
    at = int(np.argmax(energy))
    yield float(energy[at]) / power, f"from {t[at]:.1f} s to {t[at + size - 1]:.1f} s"
    spectrum = np.abs(np.fft.rfft(np.interp(np.arange(t[0], t[-1], dt), t, x)))[1:] ** 2
    line = np.convolve(spectrum, np.ones(3), "same")
    at = int(np.argmax(line))
    if at >= 2:  # fewer periods are a drift
        frequency = (at + 1) / (t[-1] - t[0])
        yield float(line[at] / spectrum.sum()), f"at {frequency:.3g} Hz"


def _held(x: Array, shapes: Array) -> float:
    """Share of the power of x (n,) that a sum of shapes (n, k) holds."""
    left = x - shapes @ np.linalg.lstsq(shapes, x)[0]
    return 1.0 - float(left @ left) / float(x @ x)
