"""What a recording lacks, as a notice to its reader."""

from __future__ import annotations

import re
from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence

from kbs_process.campaign.config import RecordingEntry
from kbs_process.results.records import Notice
from kbs_process.signals.records import TRUNCATED, Loss


def lost(entry: RecordingEntry, losses: Sequence[Loss]) -> Iterable[Notice]:
    """Yield one notice of what a recording lacks, if that is anything."""
    kinds: dict[str, list[Loss]] = defaultdict(list)
    for loss in losses:
        kinds[loss.kind].append(loss)
    if kinds:
        yield Notice(
            severity="warning" if any(loss.real for loss in losses) else "info",
            what="; ".join(f"{kind}: {_extent(own, entry.path.name)}" for kind, own in kinds.items()),
            where=entry.name,
            remedy=f"kbs-process inspect recordings/{entry.path.name} lists each with its time",
        )


def _extent(losses: Sequence[Loss], file: str) -> str:
    """How many of what, and from when to when: "3 of wrench, 1 of encoder, between 12.0 s and 14.2 s".

    What the reader of the file found and a stage behind it found again counts once.
    """
    by_reader, behind_it = Counter[str](), Counter[str]()
    for loss in losses:
        stream = "" if loss.where == file else re.split("[:,] ", loss.where)[-1]
        found = by_reader if loss.where.startswith(file) else behind_it
        found["encoder" if stream == "angle" else stream] += max(loss.count, 1)
    told = max(behind_it, by_reader, key=Counter.total)
    count = ", ".join(f"{many} of {stream}" if stream else f"{many}" for stream, many in told.items())
    starts = [loss.start_s for loss in losses if loss.start_s is not None]
    ends = [loss.end_s for loss in losses if loss.end_s is not None]
    if not starts:
        return count
    first, last = min(starts), max([*ends, *starts])
    if losses[0].kind == TRUNCATED:  # how long it would have been, a file that breaks off does not say
        return f"{count}, from {first:.1f} s on"
    start, end = f"{first:.1f} s", f"{last:.1f} s"
    return f"{count}, at {start}" if start == end else f"{count}, between {start} and {end}"


def in_words(loss: Loss) -> str:
    """Return one line for a loss: what, how many, when, where."""
    start, end = loss.start_s, loss.end_s
    when = (
        ""
        if start is None
        else f", from {start:.4f} s on"
        if loss.kind == TRUNCATED
        else f" at {start:.4f} s"
        if end in (None, start)
        else f", {start:.4f} to {end:.4f} s"
    )
    detail = f" ({loss.detail})" if loss.detail else ""
    count = f"{loss.count} x " if loss.count else ""
    return f"{count}{loss.kind}{when}, {loss.where}{detail}"


def foremost(losses: Sequence[Loss]) -> str:
    """What most of a recording was lost by, as its listing has it; nothing of one that lost nothing."""
    real = [loss for loss in losses if loss.real]
    return in_words(max(real, key=lambda loss: loss.count)) if real else ""
