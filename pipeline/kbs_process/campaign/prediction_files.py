"""What a single prediction leaves on disk: a Parquet table a stream, an MCAP file, and where it comes from."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from kbs_process.campaign import provenance
from kbs_process.campaign.config import Campaign
from kbs_process.campaign.documents import shown
from kbs_process.campaign.store import writing
from kbs_process.ingest.encoding import OutStream
from kbs_process.ingest.writer import write_mcap
from kbs_process.signals.records import WRENCH_CHANNELS, WRENCH_UNITS, Block

MARKER = "provenance.json"  # what makes a folder one of ours
HISTORY = "true wrench behind the amplifier, without cross-coupling, bias, noise and resolution"


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
    with writing(target, marker=MARKER) as folder:
        whole = _gather(streams)
        for key, block in whole.items():
            _write_table(folder / f"{key}.parquet", campaign, key, block, name)
        outputs = [_out_stream(campaign, key, block, epoch_ns) for key, block in whole.items()]
        write_mcap(folder / f"{kind}.mcap", outputs)
        about = {
            "campaign": campaign.name,
            kind: name,
            "sources": [{"file": shown(path), "sha256": provenance.sha256(path)} for path in sources],
            "description": [
                {"file": shown(path), "sha256": provenance.sha256(path)} for path in campaign.inputs
            ],
            "effects": list(campaign.effects),
            "parameters": provenance.parameters(campaign.rig),
            "software": provenance.software(),
        }
        (folder / MARKER).write_text(json.dumps(about, indent=2) + "\n", encoding="utf-8")
    return target


def _gather(streams: Iterable[tuple[str, Block]]) -> dict[str, Block]:
    blocks: dict[str, list[Block]] = {}
    for key, block in streams:
        blocks.setdefault(key, []).append(block)
    return {
        key: Block(
            np.concatenate([block.stamp for block in parts]),
            np.concatenate([block.log for block in parts]),
            np.concatenate([block.values for block in parts]),
        )
        for key, parts in sorted(blocks.items())
    }


def _write_table(path: Path, campaign: Campaign, key: str, block: Block, name: str) -> None:
    channels = WRENCH_CHANNELS if key == "wrench" else campaign.rig.joint_names
    units = WRENCH_UNITS if key == "wrench" else ("rad",) * len(channels)
    columns = {"t": block.stamp * 1e-9}
    columns |= {channel: block.values[:, index] for index, channel in enumerate(channels)}
    about = {
        "recording": name,
        "frame": "T" if key == "wrench" else "joint",
        "units": {"t": "s"} | dict(zip(channels, units, strict=True)),
        "history": [HISTORY] if key == "wrench" else [],
    }
    table = pa.table({column: pa.array(values) for column, values in columns.items()})
    table = table.replace_schema_metadata({"kbs": json.dumps(about, sort_keys=True)})
    pq.write_table(table, path, compression="zstd")


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
