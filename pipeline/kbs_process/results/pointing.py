"""Pointing errors in any kind of results. Angles in rad."""

from __future__ import annotations

from typing import Literal

from kbs_process.results.records import Record

Instrument = Literal["encoder", "external", "predicted"]


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
    """Pointing error of one axis in a recording: what an instrument reads, or the model predicts, less the command."""

    recording: str
    instrument: Instrument
    estimate: PointingEstimate


class JudgedPointing(Record, frozen=True, kw_only=True):
    """A limit on the pointing error, and what was found: the worst recording and axis decide."""

    name: str
    statistic: str
    limit: float
    verdict: Literal["pass", "fail", "undecided"]
    value: float | None = None  # of the magnitude; None: no recording tells
    sigma: float | None = None  # with what the encoder's offset and rounding leave unknown
    where: str = ""  # axis, recording, instrument
    predicted: float | None = None  # the largest of any recording and axis
    doubt: str = ""  # why it is undecided, whatever the figures are
