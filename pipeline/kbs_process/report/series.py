"""Time histories made small enough for a page, without losing an extreme: which of them, and how finely."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kbs_process.report.panel import Channel, View
from kbs_process.signals.records import Array, Mask

BUDGET = 800_000  # points of all curves of one figure: at most 2.1 MB of page
FEWEST = 600  # points a curve, below which it says too little
_STEPS = 600  # of log x, in each of which a spectrum keeps its greatest value

_ABSENT = -32768  # the packed value of a sample that is not finite
_FULL_SCALE = 32767


@dataclass(frozen=True, slots=True, eq=False)
class Trace:
    """One channel: what was measured, what was computed and what is between them, None where unknown."""

    channel: str
    unit: str
    measured: Array
    computed: Array | None
    residual: Array | None
    limit: float | None = None

    @property
    def curves(self) -> tuple[Array, ...]:
        """Those that exist, in the order measured, computed, residual."""
        return tuple(curve for curve in (self.measured, self.computed, self.residual) if curve is not None)


def stride(samples: int, points: int) -> int:
    """Return the samples in a bin such that two points a bin make at most `points`; 1: keep every sample."""
    return 1 if samples <= points else max(3, -(-2 * samples // points))


def envelope(values: Array, bin_samples: int) -> Array:
    """Return least and greatest value of each bin, in the order in which they occur.

    Shape (2 ceil(n / bin_samples),), or `values` itself for bins of one sample. Both extremes of every
    bin survive exactly; their time is known to half a bin. A bin without a finite value gives NaN.
    """
    if bin_samples == 1:
        return values
    bins = -(-len(values) // bin_samples)
    padded = np.full(bins * bin_samples, np.nan)
    padded[: len(values)] = values
    block = padded.reshape(bins, bin_samples)
    empty = ~np.isfinite(block).any(axis=1)
    low = np.where(np.isfinite(block), block, np.inf).argmin(axis=1)
    high = np.where(np.isfinite(block), block, -np.inf).argmax(axis=1)
    first, second = np.minimum(low, high), np.maximum(low, high)
    row = np.arange(bins)
    pairs = np.stack([block[row, first], block[row, second]], axis=1)
    pairs[empty] = np.nan
    return np.asarray(pairs.ravel(), dtype=np.float64)


def times(t: Array, bin_samples: int) -> tuple[float, float]:
    """Return first time and step of the points that `envelope` gives for uniform times `t`."""
    dt = float(t[-1] - t[0]) / max(1, len(t) - 1)
    if bin_samples == 1:
        return float(t[0]), dt
    return float(t[0]) + (bin_samples / 4 - 0.5) * dt, dt * bin_samples / 2


def pack(values: Array) -> dict[str, object]:
    """Return `values` as 16-bit integers in base64 with their scale: error <= 8e-6 of the range."""
    finite = values[np.isfinite(values)]
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 0.0)
    middle, scale = (low + high) / 2, (high - low) / (2 * _FULL_SCALE) or 1.0
    codes = np.full(len(values), _ABSENT, dtype="<i2")
    codes[np.isfinite(values)] = np.rint((finite - middle) / scale)
    return {"middle": middle, "scale": scale, "codes": base64.b64encode(codes.tobytes()).decode("ascii")}


def spectra(
    recording: str,
    choice: str,
    x: Array,
    channels: Sequence[tuple[str, str, Sequence[Array]]],
    marks: tuple[tuple[float, str], ...],
) -> View:
    """Return spectra (name, unit, curves over x) for logarithmic scales, the greatest of each of many equal steps."""
    positive = x > 0.0
    x = x[positive]
    steps = np.log(x / x[0]) * (_STEPS / max(np.log(x[-1] / x[0]), 1e-9))
    starts = np.flatnonzero(np.diff(np.floor(steps), prepend=-1.0))
    counts = np.diff([*starts, len(x)])

    def packed(curve: Array) -> dict[str, object]:
        known = np.where(np.isfinite(curve[positive]) & (curve[positive] > 0.0), curve[positive], 1e-300)
        greatest = np.maximum.reduceat(known, starts)
        return pack(np.where(greatest > 1e-300, np.log10(greatest), np.nan))

    return View(
        recording,
        choice,
        t0=0.0,
        step=0.0,
        bin_s=None,
        shaded=(),
        channels=tuple(Channel(name, unit, None, tuple(map(packed, curves))) for name, unit, curves in channels),
        places=pack(np.log10(np.add.reduceat(x, starts) / counts)),
        marks=tuple(mark for mark in marks if x[0] <= mark[0] <= x[-1]),
    )


def stretches(t: Array, mask: Mask) -> tuple[tuple[float, float], ...]:
    """Return first and last time of every stretch in which `mask` holds."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], mask.astype(np.int8), [0]))))
    return tuple((float(t[start]), float(t[end - 1])) for start, end in zip(edges[::2], edges[1::2], strict=True))


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """All channels of one recording in one band and frame."""

    recording: str
    choice: str
    t: Array
    valid: Mask
    traces: tuple[Trace, ...]

    @property
    def curves(self) -> int:
        """How many curves there are."""
        return sum(len(trace.curves) for trace in self.traces)


def views(scenes: Sequence[Scene], budget: int = BUDGET) -> tuple[View, ...]:
    """Return as many scenes as the page can carry, first come first served, at the best common detail."""
    kept: list[Scene] = []
    for scene in scenes:
        if sum(other.curves for other in (*kept, scene)) * FEWEST > budget and kept:
            break
        kept.append(scene)
    points = _points([len(scene.t) for scene in kept for _ in range(scene.curves)], budget)
    return tuple(_view(scene, points) for scene in kept)


def _points(lengths: Sequence[int], budget: int) -> int:
    """Return the greatest number of points a curve that keeps all curves together within the budget."""
    left, remaining = budget, sorted(lengths)
    for done, length in enumerate(remaining):
        share = left // (len(remaining) - done)
        if length > share:
            return max(share, FEWEST)
        left -= length
    return max(remaining, default=0)


def _view(scene: Scene, points: int) -> View:
    size = stride(len(scene.t), points)
    t0, step = times(scene.t, size)
    channels = tuple(Channel(trace.channel, trace.unit, trace.limit, _packed(trace, size)) for trace in scene.traces)
    bin_s = 2.0 * step if size > 1 else None
    shaded = stretches(scene.t, np.logical_not(scene.valid))
    return View(scene.recording, scene.choice, t0, step, bin_s, shaded, channels)


def _packed(trace: Trace, size: int) -> tuple[dict[str, object] | None, ...]:
    """Pack the curves; of three that are whole the middle one is left to be worked out by the page."""
    derived = trace.computed if size == 1 and len(trace.curves) == 3 else None
    return tuple(None if curve is derived else pack(envelope(curve, size)) for curve in trace.curves)
