"""An inspection of a recording as lines for a terminal."""

from __future__ import annotations

import math
from collections.abc import Iterator
from datetime import UTC, datetime

from kbs_process.reduction.inspection import Inspection, TopicInspection
from kbs_process.reduction.losses import in_words


def describe_inspection(inspection: Inspection) -> Iterator[str]:
    """Yield the listing: state, then every topic with its rate, times, disorder and ranges, then losses."""
    reason = f": {inspection.reason}" if inspection.reason else ""
    yield f"{inspection.path}: {inspection.state}{reason}"
    for topic in inspection.topics:
        yield from _topic(topic)
    for loss in inspection.losses:
        yield f"  {'lost' if loss.real else 'told'}: {in_words(loss)}"


def _topic(topic: TopicInspection) -> Iterator[str]:
    yield f"  {topic.topic}  {topic.type}  {topic.encoding}"
    line = f"    {topic.count} messages"
    if topic.rate_Hz is not None:
        line += f" at {topic.rate_Hz:.6g} Hz"
    if topic.start_ns is not None and topic.end_ns is not None:
        line += f", {(topic.end_ns - topic.start_ns) * 1e-9:.3f} s from {_clock(topic.start_ns)}"
    yield line
    if topic.note:
        yield f"    {topic.note}"
    width = max((len(entry.field) for entry in topic.ranges), default=0)
    for entry in topic.ranges:
        bad = f"  {entry.not_finite} not finite" if entry.not_finite else ""
        held = f"{entry.low + 0.0:>13.6g} to {entry.high + 0.0:<13.6g}{bad}".rstrip()
        yield f"    {entry.field:<{width}}  {'no reading' if math.isnan(entry.low) else held}"


def _clock(stamp_ns: int) -> str:
    """Return a stamp as UTC; a clock that counts from its own start shows a date of 1970."""
    return f"{datetime.fromtimestamp(stamp_ns // 10**9, UTC):%Y-%m-%d %H:%M:%S}.{stamp_ns % 10**9 // 10**6:03d} UTC"
