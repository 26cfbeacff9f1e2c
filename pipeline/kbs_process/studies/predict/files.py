"""What a single prediction leaves on disk: a Parquet table a stream, an MCAP file, and where it comes from."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from kbs_process.campaign.config import Campaign
from kbs_process.campaign.documents import shown
from kbs_process.recordings.mcap.messages.encoding import OutStream
from kbs_process.recordings.mcap.writer import write_pieces
from kbs_process.reduction.reading_laws import columns, laws_on
from kbs_process.results import provenance
from kbs_process.results.store import writing
from kbs_process.signals.records import WRENCH_UNITS, Block

ROWS = 1 << 16  # of a row group
HISTORY = {
    "wrench": "true wrench behind the amplifier, without cross-coupling, bias, noise and resolution",
    "effort": "what the drives put into the joints, without noise and resolution",
}


def write_prediction(
    campaign: Campaign,
    streams: Iterable[tuple[str, Block]],
    target: Path,
    kind: str,
    name: str,
    sources: Sequence[Path],
    *,
    epoch_ns: int = 0,
) -> Path:
    """Write the streams to `target`, replacing an earlier prediction there; return `target`.

    `kind` is "simulated" or "predicted", `name` says what of; `epoch_ns` is the sensor clock at time zero.
    """
    with writing(target, f"{kind}.mcap") as folder:
        tables: dict[str, _Table] = {}
        with ExitStack() as open_tables:

            def pieces() -> Iterator[OutStream]:
                for key, block in streams:
                    if key not in tables:
                        table = _Table(folder / f"{key}.parquet", campaign, key, kind, name)
                        tables[key] = open_tables.enter_context(table)
                    tables[key].add(block)
                    yield _out_stream(campaign, key, block, epoch_ns)

            write_pieces(folder / f"{kind}.mcap", pieces())
        about = {
            "campaign": campaign.name,
            kind: name,
            "sources": [{"file": shown(path), "sha256": provenance.sha256(path)} for path in sources],
            "description": [{"file": shown(path), "sha256": provenance.sha256(path)} for path in campaign.inputs],
            "effects": list(campaign.effects),
            "parameters": provenance.parameters(campaign.rig),
            "software": provenance.software(),
        }
        (folder / "provenance.json").write_text(json.dumps(about, indent=2) + "\n", encoding="utf-8")
    return target


class _Table:
    """A Parquet table of one stream, written as the blocks come, in row groups of `ROWS` or more."""

    def __init__(self, path: Path, campaign: Campaign, key: str, kind: str, name: str) -> None:
        channels, units = _columns(campaign, key)
        read = [f"read through {law.law} at {law.site}" for law in laws_on(campaign.sensing, key, channels)]
        about = {
            "recording": name,
            "frame": "T" if key == "wrench" else "joint",
            "units": {"t": "s"} | dict(zip(channels, units, strict=True)),
            "history": [*([HISTORY[key]] if key in HISTORY else []), *(read if kind == "predicted" else [])],
        }
        metadata = {"kbs": json.dumps(about, sort_keys=True)}
        self._schema = pa.schema([(column, pa.float64()) for column in ("t", *channels)], metadata=metadata)
        self._writer = pq.ParquetWriter(path, self._schema, compression="zstd")
        self._blocks: list[Block] = []

    def __enter__(self) -> _Table:
        return self

    def __exit__(self, *_: object) -> None:
        self._flush()
        self._writer.close()

    def add(self, block: Block) -> None:
        """Append a block."""
        self._blocks.append(block)
        if sum(map(len, self._blocks)) >= ROWS:
            self._flush()

    def _flush(self) -> None:
        if self._blocks:
            t = np.concatenate([block.stamp for block in self._blocks]) * 1e-9
            values = np.concatenate([block.values for block in self._blocks])
            columns = [pa.array(t), *(pa.array(column) for column in values.T)]
            self._writer.write_table(pa.Table.from_arrays(columns, schema=self._schema))
            self._blocks = []


def _columns(campaign: Campaign, key: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names and units of a stream's columns."""
    rig = campaign.rig
    channels = columns(key, rig)
    if key == "wrench":
        return channels, WRENCH_UNITS
    if key == "effort":
        rates = (f"{joint.unit}/s" for joint in rig.joints)
        efforts = (joint.effort.unit if joint.effort else joint.unit_of("N m") for joint in rig.joints)
        return channels, (*(joint.unit for joint in rig.joints), *rates, *efforts)
    return channels, tuple(joint.unit if key == "angle" else "rad" for joint in rig.joints)


def _out_stream(campaign: Campaign, key: str, block: Block, epoch_ns: int) -> OutStream:
    topics = {topic.key: topic.topic for topic in campaign.topics.present()}
    return OutStream(
        topic=topics.get(key, f"/{key}"),
        kind="wrench" if key == "wrench" else "joints",
        stamp=block.stamp + epoch_ns,
        log=block.log + epoch_ns,
        values=block.values,
        names=() if key == "wrench" else campaign.rig.joint_names,
        frame="T" if key == "wrench" else "",
    )
