"""The interactive time histories: which curves go into the page, and how finely."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kbs_process.report import series
from kbs_process.report.panel import Channel, View
from kbs_process.signals.records import Array, Mask

BUDGET = 800_000  # points of all curves of one figure: at most 2.1 MB of page
FEWEST = 600  # points a curve, below which it says too little


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """All channels of one recording in one band and frame."""

    recording: str
    choice: str
    t: Array
    valid: Mask
    traces: tuple[series.Trace, ...]

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
    size = series.stride(len(scene.t), points)
    t0, step = series.times(scene.t, size)
    channels = tuple(Channel(trace.channel, trace.unit, trace.limit, _packed(trace, size)) for trace in scene.traces)
    bin_s = 2.0 * step if size > 1 else None
    shaded = series.stretches(scene.t, np.logical_not(scene.valid))
    return View(scene.recording, scene.choice, t0, step, bin_s, shaded, channels)


def _packed(trace: series.Trace, size: int) -> tuple[dict[str, object] | None, ...]:
    """Pack the curves; of three that are whole the middle one is left to be worked out by the page."""
    derived = trace.computed if size == 1 and len(trace.curves) == 3 else None
    return tuple(None if curve is derived else series.pack(series.envelope(curve, size)) for curve in trace.curves)
