"""From a recording's file to a run at the working rate."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

from kbs_process.campaign.config import Campaign, RecordingEntry
from kbs_process.errors import RecordingError
from kbs_process.recordings.mcap.source import Source, open_recording
from kbs_process.recordings.mcap.streams import Stream
from kbs_process.reduction.losses import foremost
from kbs_process.signals.records import Block, Loss, Run
from kbs_process.stages.align.condense import CondenseSettings, condense

# A recorder need not have these; everything else that the campaign names has to be there.
OPTIONAL_STREAMS = frozenset({"field", "temperature", "pointing", "accelerometer", "gyro"})
# What to do where messages do not name a joint that they are expected to.
_OTHERWISE = {
    "angle": "if encoders do not read every joint, list those that they do as `joints` of [topics.encoder] in "
    "campaign.toml"
}


Blocks = Iterator[tuple[str, Block]]
Through = Callable[[Blocks], Blocks]


def read_run(campaign: Campaign, entry: RecordingEntry, through: Through = iter, *, keep_spikes: bool = False) -> Run:
    """Read one recording chunk by chunk and reduce it; what it lost is listed in the run's losses.

    What is read goes `through` whatever may leave some of it out. Single bad samples are interpolated, but for
    `keep_spikes`.
    """
    source = open_recording(entry.path)
    there = {summary.topic for summary in source.topics}
    topics = [topic for topic in campaign.topics.present() if topic.topic in there or topic.key not in OPTIONAL_STREAMS]
    blocks = source.read(
        [Stream(topic.key, topic.topic, topic.fields, _OTHERWISE.get(topic.key, ""), topic.channel) for topic in topics]
    )
    try:
        run = condense(
            entry.name,
            through(_within(_of_one_publisher(blocks, source), entry.start, entry.end)),
            {topic.key: topic.channels for topic in topics},
            CondenseSettings(working_rate_Hz=campaign.bands.working_rate),
            units={topic.key: topic.units for topic in topics},
            file=str(entry.path),
            keep_spikes=keep_spikes,
        )
    except RecordingError as error:
        if first := foremost(source.losses):
            raise RecordingError(f"{first}; and {error.what}", where=error.where, remedy=error.remedy) from error
        raise
    late = ((source.start_ns or run.log_epoch_ns) - run.log_epoch_ns) * 1e-9
    return replace(run, losses=(*(_later(loss, late) for loss in source.losses), *run.losses))


def _of_one_publisher(blocks: Blocks, source: Source) -> Blocks:
    """Raise RecordingError where several channels of the file bring one stream by turns."""
    for key, block in blocks:
        if found := source.publishers.get(key):
            named = "encoder" if key == "angle" else key
            raise RecordingError(
                f"{len(found)} publishers bring the topic of '{named}' by turns, in channels "
                f"{', '.join(map(str, found))} of the file",
                where=str(source.path),
                remedy=f"choose one in campaign.toml: under [topics.{named}], give `topic` and `channel`",
            )
        yield key, block


def _later(loss: Loss, by: float) -> Loss:
    """A loss of the file, located from its first message, on the run's time axis."""
    return replace(
        loss,
        start_s=None if loss.start_s is None else loss.start_s + by,
        end_s=None if loss.end_s is None else loss.end_s + by,
    )


def _within(blocks: Blocks, start: float | None, end: float | None) -> Blocks:
    """Leave out what the recorder wrote before `start` or after `end`, s from its first message."""
    first: int | None = None
    for key, block in blocks:
        if first is None and len(block):
            first = int(block.log[0])
        since = (block.log - (first or 0)) * 1e-9
        # Another topic's first message may be older than that of the topic that is read first.
        inside = (since >= (float("-inf") if start is None else start)) & (since < (end or float("inf")))
        yield (key, block if inside.all() else Block(block.stamp[inside], block.log[inside], block.values[inside]))
