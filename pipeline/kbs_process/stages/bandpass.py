"""Bands of the working-rate signals: zero phase, gains and edges known and stated."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from scipy.signal import butter, fftconvolve, sosfiltfilt

from kbs_process.signals.records import Array, Mask, Signal
from kbs_process.stages.lowfrequency import METHOD, high_pass, high_pass_gain

ORDER = 4  # of the low-pass, run forwards and backwards
BRIDGED = 0.125  # of the shortest period of a band: across so long a gap a line errs by 8 % of a tone of that period
TOLERANCE = 1e-3  # an edge ends where the error is this part of the signal's rms
_FAR = 8  # times a filter's memory, beyond which a record has a middle that its ends do not reach
NEAR = 1.0  # s on either side of invalid samples, whose means a straight line joins


@dataclass(frozen=True, slots=True)
class Band:
    """Frequencies that pass; None is no limit on that side."""

    name: str
    high_pass_Hz: float | None
    low_pass_Hz: float | None


UNFILTERED = Band("unfiltered", None, None)


@dataclass(frozen=True, slots=True)
class BandStatement:
    """What a report says about a band filter on a record of given length.

    The errors are rms over the samples not flagged, as a part of the rms of the filtered signal, against the
    same filter on an endless record: for a signal with a flat spectrum, and for one that drifts like a random
    walk, between which recordings lie. They come from what happened before and after the record, which nobody
    knows. Two signals filtered alike (measured, predicted) are wrong alike: their difference is filtered as
    if it had been taken first.
    """

    name: str
    low_Hz: float | None
    high_Hz: float | None
    method: str
    edge_s: float  # s from either end until both errors are below 0.1 %
    flagged_s: float  # s at either end that `apply` flags: the low-pass would need samples beyond it
    edge_error: float  # flat spectrum
    edge_error_drift: float  # random walk


def gain(band: Band, f: Array, dt: float) -> Array:
    """Gain at f (n,), Hz; the phase is zero. Half at either limit.

    High-pass: 1 / (1 + (f0 / f)^4); low-pass: 1 / (1 + (f / f1)^8), f standing for sin(pi f dt) and tan(pi f dt).
    """
    g = np.ones_like(f)
    if band.high_pass_Hz is not None:
        g = g * high_pass_gain(f, band.high_pass_Hz, dt)
    if band.low_pass_Hz is not None:
        warped = np.tan(np.pi * f * dt) / np.tan(np.pi * band.low_pass_Hz * dt)
        g = g / (1.0 + warped ** (2 * ORDER))
    return g


def noise_bandwidth(band: Band, dt: float) -> float:
    """Width of the rectangle, Hz, that passes as much white noise as the band does: the integral of gain^2."""
    f = np.linspace(0.0, 0.5 / dt, 20001)[1:-1]
    return float(np.trapezoid(gain(band, f, dt) ** 2, f))


def crossing_rate(band: Band, dt: float) -> float:
    """How often a second white noise in the band crosses zero upwards: the rms frequency of its power (Rice)."""
    f = np.linspace(0.0, 0.5 / dt, 20001)[1:-1]
    power = gain(band, f, dt) ** 2
    return float(np.sqrt(np.trapezoid(f**2 * power, f) / np.trapezoid(power, f)))


def apply(signal: Signal, band: Band) -> Signal:
    """Return the signal's part in the band; samples that lean on unknown ones by more than 0.1 % are flagged.

    Invalid samples are bridged before anything is filtered: what was invented there, such as a static wrench of angles
    that were not recorded, would leak into samples around it for as long as the high-pass remembers. The high-pass
    comes first: the low-pass then has no trend left to continue beyond the ends.
    """
    valid = signal.valid
    values = signal.values if band == UNFILTERED else _bridged(signal.values, valid, signal.dt)
    if band.high_pass_Hz is not None:
        values = high_pass(values, band.high_pass_Hz, signal.dt)
    if band.low_pass_Hz is not None:
        values = _low_pass(values, band.low_pass_Hz, signal.dt)
        valid = known_within(valid, band.low_pass_Hz, signal.dt)
    return signal.derive(values, _step(band), valid=valid)


def too_long(gaps: Array, band: Band) -> Array:
    """Return those of gaps (k, 2), s from when to when, in which a band's signal is not known."""
    long: Array = gaps[_short(gaps, band) == 0.0]
    return long


def _short(gaps: Array, band: Band) -> Array:
    """Lengths (k,) of gaps (k, 2), in periods of a band's upper edge; zero of those that no line bridges."""
    lengths: Array = np.diff(gaps)[:, 0] * (band.low_pass_Hz or np.inf)
    lengths[lengths > BRIDGED] = 0.0
    return lengths


def bridged(signal: Signal, gaps: Array, band: Band, reach: float) -> Signal:
    """Take samples within `reach`, s, of gaps (k, 2), s, that are short in a band as they were interpolated.

    Those within the reach of longer gaps, and of what is beyond the ends, are not.
    """
    long = too_long(gaps, band)
    known = signal.valid | (_within(signal, gaps, reach) & ~_within(signal, long, reach))
    return replace(signal, valid=known)


def _within(signal: Signal, spans: Array, reach: float) -> Mask:
    """Which samples (n,) are within `reach`, s, of spans (k, 2), s."""
    edges = (spans + np.array([-reach, reach]) - signal.t0) / signal.dt
    begin, end = np.clip(np.ceil(edges), 0, len(signal)).astype(np.intp).T
    inside = np.bincount(begin, minlength=len(signal) + 1) - np.bincount(end, minlength=len(signal) + 1)
    return np.asarray(np.cumsum(inside)[:-1] > 0)


def bridging_error(gaps: Array, band: Band) -> float:
    """Return by how much of a band's largest tone its short gaps (k, 2), s, may let it err: those of half a period.

    A line across T is (2 pi f T)^2 / 8 off a tone at its crest, of which as much is in the band as T is of half its
    shortest period.
    """
    return _together((np.pi * _short(gaps, band)) ** 2 * _short(gaps, band), gaps, band)


def bridging_noise(gaps: Array, band: Band, rate: float) -> float:
    """Return the factor by which a band's noise, of samples at `rate`, Hz, is more next to its short gaps (k, 2), s.

    A line across T has the noise of its two ends, sigma / sqrt(2) in the mean; in a band up to f that is 2 f T of it,
    next to sigma sqrt(2 f / rate).
    """
    return float(np.sqrt(1.0 + _together(_short(gaps, band) ** 2, gaps, band) * rate / (band.low_pass_Hz or np.inf)))


def _together(each: Array, gaps: Array, band: Band) -> float:
    """The largest sum of what gaps (k, 2) do, `each` (k,), that begin within half a band's shortest period."""
    begin, order = np.sort(gaps[:, 0]), np.argsort(gaps[:, 0])
    total = np.concatenate(([0.0], np.cumsum(each[order])))
    last = np.searchsorted(begin, begin + 0.5 / (band.low_pass_Hz or np.inf), side="right")
    return float(np.max(total[last] - total[:-1], initial=0.0))


def _bridged(values: Array, valid: Mask, dt: float) -> Array:
    """Replace runs of invalid samples by straight lines between the means of the valid ones near them.

    Where one side has none, by the mean of the other. Runs of less than that at the ends of a record stay: decimation
    flags them for the little that it continued, and most of them was measured.
    """
    if valid.all() or not valid.any():
        return values
    bridged = values.copy()
    reach = max(1, round(NEAR / dt))
    ends = np.flatnonzero(np.diff(np.concatenate(([True], valid, [True])).astype(np.int8)))
    for start, stop in ends.reshape(-1, 2):
        if stop - start <= reach and (start == 0 or stop == len(valid)):
            continue
        sides = [slice(max(start - reach, 0), start), slice(stop, stop + reach)]
        means = [values[side][valid[side]].mean(axis=0) for side in sides if valid[side].any()]
        bridged[start:stop] = np.linspace(means[0], means[-1], stop - start + 2)[1:-1]
    return bridged


def _step(band: Band) -> str:
    parts = []
    if band.high_pass_Hz is not None:
        parts.append(f"above {band.high_pass_Hz:g} Hz by {METHOD}")
    if band.low_pass_Hz is not None:
        parts.append(f"below {band.low_pass_Hz:g} Hz by zero-phase Butterworth, order {ORDER} x 2")
    return f"band {band.name}: " + (", ".join(parts) or "as it is")


def _low_pass(values: Array, f1: float, dt: float) -> Array:
    sos = butter(ORDER, f1, output="sos", fs=1.0 / dt)
    pad = min(len(values) - 1, len(_low_pass_kernel(f1, dt)) // 2)
    filtered: Array = sosfiltfilt(sos, values, axis=0, padtype="odd", padlen=pad)
    return filtered


@lru_cache(maxsize=32)
def _low_pass_kernel(f1: float, dt: float) -> Array:
    """Impulse response, symmetric, cut where what is left of its absolute sum is 1e-9."""
    reach = int(np.ceil(12.0 / (f1 * dt)))
    impulse = np.zeros(2 * reach + 1)
    impulse[reach] = 1.0
    h: Array = sosfiltfilt(butter(ORDER, f1, output="sos", fs=1.0 / dt), impulse, padtype=None)
    tail = np.cumsum(np.abs(h[: reach + 1]))
    cut = int(np.searchsorted(tail, 1e-9))
    return h[cut : len(h) - cut]


def known_within(valid: Mask, f1: float, dt: float, tolerance: float = TOLERANCE) -> Mask:
    """Flag samples in which invalid ones, and those beyond the ends, weigh more than `tolerance`."""
    h = np.abs(_low_pass_kernel(f1, dt))
    beyond = np.cumsum(h)[: len(h) // 2][::-1][: len(valid)]  # weight of what lies before sample 0, 1, ...
    doubt = np.zeros(len(valid))
    doubt[: len(beyond)] += beyond
    doubt[len(valid) - len(beyond) :] += beyond[::-1]
    if not valid.all():
        doubt += fftconvolve((~valid).astype(np.float64), h)[len(h) // 2 :][: len(valid)]
    known: Mask = doubt <= tolerance
    return known


def _slowest(band: Band, dt: float) -> float | None:
    limits = [f for f in (band.high_pass_Hz, band.low_pass_Hz) if f is not None]
    return min(limits) if limits else None


@lru_cache(maxsize=64)
def statement(band: Band, dt: float, n: int) -> BandStatement:
    """Compute the statement for records of n samples from the filter's own impulse responses.

    Row t of the filter on n samples, less row t of the filter on an endless record, weighs the unknown; its
    norm is the error at t for a flat spectrum, the norm of its running sum that for a random walk. In the middle of a
    record of many periods there is none: it is computed for a shorter one.
    """
    slowest = _slowest(band, dt)
    if slowest is None:
        return BandStatement(band.name, None, None, "as it is", 0.0, 0.0, 0.0, 0.0)
    margin = int(np.ceil((16.0 if band.high_pass_Hz is None else 4.0) / (slowest * dt)))
    without = max(n - _FAR * margin, 0)  # samples
    n -= without
    at = np.unique(np.concatenate(([0], np.geomspace(1, max(n // 2, 2), 40).astype(int))))
    at = at[at < n]
    short, endless = _low_pass_rows(band, dt, n, at, margin)
    if band.high_pass_Hz is not None:  # symmetric, so that it acts on rows as on columns
        short, endless = high_pass(short, band.high_pass_Hz, dt), high_pass(endless, band.high_pass_Hz, dt)
    unknown = -endless
    unknown[margin : margin + n] += short
    middle = endless[:, -1:]
    flat = _norm(unknown) / _norm(middle)
    drift = flat
    if band.high_pass_Hz is not None:
        drift = _norm(np.cumsum(unknown, axis=0)) / _norm(np.cumsum(middle, axis=0))
    over = np.flatnonzero(np.maximum(flat, drift) > TOLERANCE)
    edge = at[min(over[-1] + 1, len(at) - 1)] * dt if len(over) else 0.0
    flagged = 0.0
    if band.low_pass_Hz is not None:
        known = known_within(np.ones(n, dtype=np.bool_), band.low_pass_Hz, dt)
        flagged = float(np.argmax(known)) if known.any() else float(n)
    valid = at >= min(flagged, float(at[-1]))
    return BandStatement(
        name=band.name,
        low_Hz=band.high_pass_Hz,
        high_Hz=band.low_pass_Hz,
        method=_step(band),
        edge_s=float(edge),
        flagged_s=flagged * dt,
        edge_error=_root_mean_square(at[valid], flat[valid], without // 2),
        edge_error_drift=_root_mean_square(at[valid], drift[valid], without // 2),
    )


def _low_pass_rows(band: Band, dt: float, n: int, at: Array, margin: int) -> tuple[Array, Array]:
    """Rows `at` of the low-pass on n samples, odd beyond its ends, and on an endless record: columns."""
    short, endless = np.zeros((n, len(at))), np.zeros((n + 2 * margin, len(at)))
    h = np.ones(1) if band.low_pass_Hz is None else _low_pass_kernel(band.low_pass_Hz, dt)
    for column, t in enumerate(at):
        index = np.arange(len(h)) - len(h) // 2 + t
        endless[index + margin, column] = h
        before, after = index < 0, index >= n
        np.add.at(short[:, column], index[~before & ~after], h[~before & ~after])
        for outside, end, mirrored in ((before, 0, -index), (after, n - 1, 2 * (n - 1) - index)):
            short[end, column] += 2.0 * h[outside].sum()  # x(-m) = 2 x(0) - x(m)
            np.add.at(short[:, column], np.clip(mirrored[outside], 0, n - 1), -h[outside])
    return short, endless


def _norm(x: Array) -> Array:
    norm: Array = np.sqrt(np.sum(x**2, axis=0))
    return norm


def _root_mean_square(at: Array, error: Array, without: int) -> float:
    """Over samples `at`, and `without` more that have no error."""
    mean = np.trapezoid(error**2, at) / (at[-1] - at[0] + without) if len(at) > 1 else error[0] ** 2
    return float(np.sqrt(mean))
