"""MCAP: numbers of messages, "/topic.wrench.force.x", "/topic.position[az]", and a topic's clocks.

"/topic: time" is the sensor's, where messages carry a stamp, "/topic: log time" the recorder's.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from kbs_process.errors import RecordingError
from kbs_process.recordings.formats import Format, Text
from kbs_process.recordings.mcap.source import TopicSummary, open_recording
from kbs_process.recordings.mcap.streams import Sample, Stream
from kbs_process.recordings.tables import Cells, Column, LeftOut

_WRENCH = {"force": "N", "torque": "N m"}  # as geometry_msgs/Wrench defines them


class McapTable:
    """A recording whose topics have a clock each: a piece has the rows of one, and none of the others."""

    def __init__(self, path: Path, _: Text) -> None:
        self.path = path
        self.odd = Counter[str]()
        self._source = open_recording(path)
        samples = self._source.samples()
        left_out: list[str] = []
        self._places: dict[str, tuple[str, str]] = {}  # topic and field of a column
        columns: list[Column] = []
        for topic in self._source.topics:
            sample = samples.get(topic.topic)
            if fault := "it has no messages" if sample is None else _fault(sample):
                left_out.append(f"{topic.topic}: {fault}")
            elif isinstance(sample, Sample) and (fields := sample.numbers()):
                columns += self._columns(topic, fields)
        self.columns, self.left_out = tuple(columns), LeftOut(left_out)
        if not columns:
            raise RecordingError("holds no topic with numbers", where=str(path), remedy="; ".join(left_out[:5]))

    def _columns(self, topic: TopicSummary, fields: Sequence[str]) -> Iterator[Column]:
        time, written = f"{topic.topic}: time", f"{topic.topic}: log time"
        wrench = "geometry_msgs" in topic.type and "Wrench" in topic.type
        for field in fields:
            name = f"{topic.topic}.{field}"
            unit = next((unit for part, unit in _WRENCH.items() if wrench and part in field), "")
            self._places[name] = topic.topic, field
            yield Column(name, unit, time, written)
        for clock in (time, written):
            self._places[clock] = topic.topic, ""
            yield Column(clock, "datetime")

    def chunks(self, names: Sequence[str]) -> Iterator[tuple[Cells, ...]]:
        """Yield the messages of one topic after the other, as the file has them."""
        self.odd.clear()
        fields: dict[str, dict[str, None]] = {}
        for topic, field in map(self._places.__getitem__, names):
            fields.setdefault(topic, {}).update({field: None} if field else {})
        streams = [Stream(topic, topic, tuple(wanted), lenient=True) for topic, wanted in fields.items()]
        for topic, block in self._source.read(streams):
            own = {f"{topic}.{field}": cells for field, cells in zip(fields[topic], block.values.T, strict=True)}
            own |= {f"{topic}: time": block.stamp.view("M8[ns]"), f"{topic}: log time": block.log.view("M8[ns]")}
            yield tuple(own.get(name, np.empty(0)) for name in names)
        if twice := self._source.publishers:
            topic, channels = next(iter(twice.items()))
            raise RecordingError(
                f"several publishers bring {topic} by turns: its channels {', '.join(map(str, channels))}",
                where=str(self.path),
                remedy="record one alone; a campaign that reads this file itself may choose one in [topics]",
            )
        for loss in self._source.losses:
            if loss.kind not in ("non-finite", "missing field"):
                self.odd[f"of {loss.where}: {loss.kind}" + (f" ({loss.detail})" if loss.detail else "")] += loss.count


def _fault(sample: Sample | RecordingError) -> str:
    return sample.what if isinstance(sample, RecordingError) else sample.fault()


FORMAT = Format(suffixes=(".mcap",), read=McapTable, isolated=False)
