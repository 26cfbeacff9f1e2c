"""From source files and a mapping to a campaign folder."""

from __future__ import annotations

from collections.abc import Callable
from collections.abc import Mapping as MappingOf
from pathlib import Path

import numpy as np
from msgspec.structs import replace

from kbs_process.campaign.config import Campaign, Topic
from kbs_process.campaign.documents import read, shown
from kbs_process.campaign.load import load_campaign
from kbs_process.campaign.locate import CAMPAIGN_FILE
from kbs_process.errors import OutputError, RecordingError, did_you_mean
from kbs_process.progress import Progress, SilentProgress
from kbs_process.recordings.formats import Text
from kbs_process.recordings.formats.text import TextTable
from kbs_process.recordings.mcap.messages.encoding import JOINT_PARTS, OutStream
from kbs_process.recordings.mcap.writer import write_pieces
from kbs_process.recordings.open_table import open_table
from kbs_process.recordings.tables import Table
from kbs_process.results.provenance import sha256
from kbs_process.results.store import writing
from kbs_process.signals.records import Array, Block
from kbs_process.studies.convert.description import Origin, prepare, recording_file, write_campaign
from kbs_process.studies.convert.mapping import WRENCH_FIELDS, Mapping, StreamMap, find_mapping, load_mapping
from kbs_process.studies.convert.mapping_file import Part
from kbs_process.studies.convert.orientation import Attitude
from kbs_process.studies.convert.streams import Findings, read_part

LATEST_NS = (1 << 31) * 1_000_000_000  # the seconds of a ROS 2 time stamp are a signed 32-bit number


def import_recordings(
    mapping: Path | str,
    source: Path,
    target: Path,
    *,
    progress: Progress | None = None,
    notice: Callable[[str], None] | None = None,
) -> Path:
    """Convert source files into a new campaign folder and return it.

    `mapping` is the path of a mapping or the name of a preset; `source` the folder of the files that it names,
    or, where it names one, that file; `target` the folder to make, which may hold an earlier import. It
    appears whole or not at all. `notice` is given one line for each thing that is wrong with the files but
    not fatal: cells that are no number, time stamps that repeat or go back.

    Raises ConfigError (mapping or campaign), RecordingError (source files), OutputError (target).
    """
    progress = progress or SilentProgress()
    plan = load_mapping(find_mapping(mapping))
    files = _source_files(plan, source)
    with writing(target, CAMPAIGN_FILE) as folder:
        campaign = prepare(plan, folder)
        sources = {name: sha256(path) for name, path in files.items()}
        _check_same(target, campaign.name, sources)
        checksums: dict[str, str] = {}
        findings: dict[str, tuple[str, ...]] = {}
        for part in plan.parts:
            with progress.task(f"{part.source} -> {recording_file(part.stem)}"):
                found = _convert_part(plan, part, files, campaign, folder)
                checksums[part.stem] = sha256(folder / recording_file(part.stem))
            lines = tuple(f"{part.stem}: {line}" for line in found)
            findings[part.source] = findings.get(part.source, ()) + lines
            if notice:
                for line in lines:
                    notice(f"{part.source}, {line}")
        origins = tuple(Origin(name, digest, findings.get(name, ())) for name, digest in sources.items())
        write_campaign(plan, folder, checksums, origins)
        load_campaign(folder)
    return target


def _check_same(target: Path, name: str, sources: MappingOf[str, str]) -> None:
    """Raise OutputError where the folder holds another campaign: of another name, or of none of these files."""
    remedy = "name a folder that is empty or does not exist, or move this one"
    if (target / CAMPAIGN_FILE).is_file():
        held = read(target / CAMPAIGN_FILE, role="campaign", remedy=remedy).tree
        what = f"holds the campaign '{held.get('name')}', not '{name}' of these files"
        if held.get("name") != name or not any(digest in str(held.get("source")) for digest in sources.values()):
            raise OutputError(what, where=shown(target), remedy=remedy)


def _source_files(mapping: Mapping, source: Path) -> dict[str, Path]:
    """Return the source files by the names that the mapping gives them."""
    names = list(dict.fromkeys(part.file_of(stream.key) for part in mapping.parts for stream in mapping.streams))
    if not source.is_dir() and source.exists():
        if len(names) > 1:
            raise RecordingError(
                f"is one file, where the mapping names {len(names)}: {', '.join(names)}",
                where=shown(source),
                remedy="give the folder that holds them",
            )
        return {names[0]: source}
    if not source.is_dir():
        raise RecordingError(
            "there is no such file or folder",
            where=shown(source),
            remedy=f"give the folder that holds {', '.join(names)}",
        )
    found = [path.name for path in source.iterdir() if not path.name.startswith(".")]
    for name in names:
        if not _is_there(source / name):
            origin = f" (published: {mapping.source.origin})" if mapping.source.origin else ""
            raise RecordingError(
                f"there is no '{name}', which the mapping names",
                where=shown(source),
                remedy=did_you_mean(name, found) + origin,
            )
    return {name: source / name for name in names}


def _is_there(path: Path) -> bool:
    try:
        return path.exists()
    except OSError:  # no disk can hold a file of that name
        return False


def _convert_part(
    mapping: Mapping, part: Part, files: MappingOf[str, Path], campaign: Campaign, folder: Path
) -> tuple[str, ...]:
    """Write one recording; return what was found wrong with its source."""
    opened: dict[tuple[str, Text], Table] = {}
    texts = {key: replace(text, section=part.section) for key, text in mapping.texts.items()}
    for key, name in ((stream.key, part.file_of(stream.key)) for stream in mapping.streams):
        if (name, texts[key]) not in opened:
            opened[name, texts[key]] = open_table(files[name], mapping.format, texts[key])
    if part.section and not any(isinstance(table, TextTable) for table in opened.values()):
        remedy = f"leave out `section` of '{part.stem}' in the mapping; start_s and end_s take a part of a file"
        raise RecordingError("only delimited text has sections", where=shown(files[part.source]), remedy=remedy)
    tables = {stream.key: opened[part.file_of(stream.key), texts[stream.key]] for stream in mapping.streams}
    findings = Findings()
    topics = {"encoder" if topic.key == "angle" else topic.key: topic for topic in campaign.topics.present()}
    orientations = (one for stream in mapping.streams for one in stream.orientations)
    attitudes = [Attitude(one, campaign.rig, shown(mapping.path)) for one in orientations]
    pieces = (
        _out_stream(stream, block, topics[stream.key], tables[stream.key].path)
        for stream, block in read_part(tables, mapping, part, findings, attitudes)
    )
    write_pieces(folder / recording_file(part.stem), pieces)
    return findings.lines()


def _out_stream(stream: StreamMap, block: Block, topic: Topic, path: Path) -> OutStream:
    """Return the stream as messages; what the file does not have is NaN in them."""
    if len(block) and (int(block.stamp.min()) < 0 or int(block.stamp.max()) >= LATEST_NS):
        raise RecordingError(
            f"times of '{stream.key}' reach from {block.stamp.min() / 1e9:g} s to {block.stamp.max() / 1e9:g} s "
            "after 1970, where recordings hold 0 to 2147483648 s",
            where=shown(path),
            remedy="check column and unit in [time]; where times begin below zero, give the date of time "
            "zero, such as start = 2026-01-31T12:00:00Z",
        )
    columns = dict(zip(stream.units, block.values.T, strict=True))
    match stream.key:
        case "wrench":
            values = _columns(columns, list(WRENCH_FIELDS.values()), len(block))
            return OutStream(topic.topic, "wrench", block.stamp, block.log, values, frame="T")
        case "temperature":
            return OutStream(topic.topic, "temperature", block.stamp, block.log, block.values)
        case _:
            names = tuple(dict.fromkeys(field.partition("[")[2].rstrip("]") for field in columns))
            # A message has its parts in this order; those before the last that is known may hold nothing.
            last = max(JOINT_PARTS.index(field.partition("[")[0]) for field in columns)
            fields = [f"{part}[{name}]" for part in JOINT_PARTS[: last + 1] for name in names]
            values = _columns(columns, fields, len(block))
            return OutStream(topic.topic, "joints", block.stamp, block.log, values, names)


def _columns(columns: MappingOf[str, Array], fields: list[str], count: int) -> Array:
    return np.column_stack([columns.get(field, np.full(count, np.nan)) for field in fields])
