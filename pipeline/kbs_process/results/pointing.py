"""Pointing errors in any kind of results. Angles in rad."""

from __future__ import annotations

from typing import Literal

from kbs_process.results.records import Record


class PointingEstimate(Record, frozen=True, kw_only=True):
    """Pointing error of one axis over a stretch of time; a sigma is that of the estimate before it."""

    axis: str
    bias: float
    bias_sigma: float
    random: float  # 2 sigma about the bias
    random_sigma: float
    percentile: float  # 95 % of the magnitude
    percentile_sigma: float
    orbit: float  # slow part: half its range within any one orbit, or the whole stretch if that is shorter
    greatest: float


class RecordedPointing(Record, frozen=True, kw_only=True):
    """Pointing error of one axis in a recording: what an instrument reads less what was commanded."""

    recording: str
    instrument: Literal["encoder", "external"]
    estimate: PointingEstimate
