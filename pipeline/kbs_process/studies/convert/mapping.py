"""The mapping: a TOML file that says how files of other formats become the recordings of a campaign."""

from __future__ import annotations

import math
from collections.abc import Mapping as MappingOf
from datetime import datetime
from pathlib import Path
from typing import Any, Literal

import msgspec

from kbs_process.campaign.documents import Document, Key, read, shown
from kbs_process.campaign.problems import Problems
from kbs_process.campaign.schema import violations
from kbs_process.campaign.units import UnitMismatchError, alike, factor
from kbs_process.errors import ConfigError, did_you_mean
from kbs_process.recordings.formats import Text, formats
from kbs_process.signals.records import WRENCH_CHANNELS, WRENCH_UNITS
from kbs_process.studies.convert import PRESETS, preset_names

KELVIN = 273.15  # 0 degC, K

TimeUnit = Literal["s", "ms", "us", "ns", "min", "datetime"]


class Time(msgspec.Struct, frozen=True):
    """Where the time of a stream's samples is."""

    column: int | str | None = None
    unit: TimeUnit = "s"
    rate_Hz: float | None = None
    start: datetime | None = None


class Source(msgspec.Struct, frozen=True):
    """Where the files come from."""

    origin: str = ""
    licence: str = ""
    reference: str = ""


class Part(msgspec.Struct, frozen=True):
    """One recording, or the part of a source file that becomes one."""

    source: str
    trajectory: str
    role: Literal["calibration", "fit", "held-out"]
    repeat: int = 1
    name: str = ""
    start_s: float = 0.0
    end_s: float = float("inf")

    @property
    def stem(self) -> str:
        """Name of the recording's file, without suffix."""
        return self.name or f"{self.trajectory}_{self.repeat}"


class Channel(msgspec.Struct, frozen=True):
    """One channel of a stream: value in `unit` = gain * cell + offset."""

    field: str  # place in the message: "wrench.force.x", "position[az]"
    column: int | str
    unit: str  # SI
    gain: float
    offset: float = 0.0
    turn: float = 0.0  # at which an angle that is to be unwrapped starts again, in `unit`


class StreamMap(msgspec.Struct, frozen=True):
    """One stream of the recordings to be."""

    key: str  # as in campaign.toml's [topics]: "wrench", "encoder", ...
    time: Time | None  # None: the file's own
    channels: tuple[Channel, ...]


class Turn(msgspec.Struct, frozen=True):
    """Forces and moments are turned by `factor` times the angle of `joint` about `axis`, to be in T's axes."""

    joint: str
    axis: tuple[float, float, float]
    factor: float


class Mapping(msgspec.Struct, frozen=True):
    """A mapping that passed every check."""

    path: Path
    template: Path  # campaign.toml
    format: str | None  # of all source files; None: each by its suffix
    text: Text
    streams: tuple[StreamMap, ...]
    turn: Turn | None
    source: Source
    parts: tuple[Part, ...]


WRENCH_FIELDS = dict(
    zip(WRENCH_CHANNELS, [f"wrench.{kind}.{axis}" for kind in ("force", "torque") for axis in "xyz"], strict=True)
)
STREAMS = ("wrench", "effort", "encoder", "rate", "command", "field", "temperature")
# SI units that the numbers of a joint may have: of one that turns first, then of one that slides.
JOINT_UNITS = {"position": ("rad", "m"), "velocity": ("rad/s", "m/s"), "effort": ("N m", "N", "A", "V")}


def find_mapping(mapping: Path | str) -> Path:
    """Return the path of a mapping, given that path or a preset's name."""
    if str(mapping) in preset_names():
        return PRESETS / f"{mapping}.toml"
    path = Path(mapping)
    if not path.exists() and path.suffix != ".toml":
        raise ConfigError(
            f"no preset '{mapping}'", remedy=did_you_mean(str(mapping), preset_names()) + "; or give a mapping file"
        )
    return path


def load_mapping(path: Path) -> Mapping:
    """Read and check a mapping.

    Raises ConfigError, naming file, line and key, and what to do.
    """
    document = read(path, role="mapping", remedy="give a mapping file, or a preset: " + ", ".join(preset_names()))
    problems = Problems(shown(path))
    for violation in violations(document.tree, "import"):
        problems.add(document.place(violation.key), violation.what, violation.remedy)
    problems.raise_any()
    tree = document.tree
    if "format" in tree and tree["format"] not in formats():
        remedy = did_you_mean(tree["format"], formats())
        problems.add(document.place(("format",)), f"'{tree['format']}' is not allowed", remedy)
    streams = tuple(_stream(document, key, problems) for key in STREAMS if key in tree)
    parts = tuple(msgspec.convert(part, Part) for part in tree["recording"])
    _check_parts(document, parts, problems)
    turn = msgspec.convert(tree["turn"], Turn) if "turn" in tree else None
    if turn:
        _check_turn(document, turn, streams, problems)
    problems.raise_any()
    return Mapping(
        path=path,
        template=path.parent / tree["campaign"],
        format=tree.get("format"),
        text=msgspec.convert(tree.get("text", {}), Text),
        streams=streams,
        turn=turn,
        source=msgspec.convert(tree.get("source", {}), Source),
        parts=parts,
    )


def _stream(document: Document, key: str, problems: Problems) -> StreamMap:
    table = document.tree[key]
    rows: list[tuple[Key, str, tuple[str, ...], dict[str, Any]]] = []  # key, field, SI units, column table
    match key:
        case "wrench":
            units = dict(zip(WRENCH_CHANNELS, WRENCH_UNITS, strict=True))
            rows = [((key, name), WRENCH_FIELDS[name], (units[name],), cell) for name, cell in table.items()]
        case "command":
            rows = [
                ((key, kind, joint), f"{kind}[{joint}]", JOINT_UNITS[kind], cell)
                for kind, joints in table.items()
                for joint, cell in joints.items()
            ]
        case "temperature":
            rows = [((key,), "temperature", ("degC",), table)]
        case _:
            part = {"rate": "velocity", "effort": "effort"}.get(key, "position")
            rows = [((key, joint), f"{part}[{joint}]", JOINT_UNITS[part], cell) for joint, cell in table.items()]
    channels = tuple(_channel(document, *row, problems) for row in rows)
    return StreamMap(key, _time(document, key, problems), channels)


def _channel(
    document: Document, key: Key, field: str, allowed: tuple[str, ...], cell: MappingOf[str, Any], problems: Problems
) -> Channel:
    unit, scale, radius = cell["unit"], float(cell.get("scale", 1.0)), cell.get("radius_m")
    # A way along a surface of some radius is an angle; any other unit tells by itself which one it is of.
    kin = [] if radius is not None else [si for si in allowed if alike(unit, si)]
    si = kin[0] if kin else allowed[0]
    if cell.get("unwrap") and si != "rad":
        problems.add(document.place((*key, "unwrap")), "only an angle can be unwrapped", "delete unwrap")
    if radius is not None and si not in ("rad", "rad/s"):
        problems.add(document.place((*key, "radius_m")), "goes with angles and rates only", "delete radius_m")
        radius = None
    gain, offset = 1.0, 0.0
    if (unit, si) == ("K", "degC"):
        offset = -KELVIN
    else:
        try:
            gain = factor(unit, si) if radius is None else factor(unit, si.replace("rad", "m")) / radius
        except UnitMismatchError as error:
            problems.add(document.place((*key, "unit")), str(error), error.remedy)
    again = cell.get("unwrap", False)
    turn = 2.0 * math.pi * again if isinstance(again, bool) else abs(float(again) * gain * scale)
    return Channel(field, cell["column"], si, gain * scale, offset, turn)


def _time(document: Document, key: str, problems: Problems) -> Time | None:
    common = document.tree.get("time", {})
    own = key in common
    table = common[key] if own else {name: value for name, value in common.items() if name not in STREAMS}
    place: Key = ("time", key) if own else ("time",)
    if not table:
        return None
    start = table.get("start")
    if start is not None and not (isinstance(start, datetime) and start.tzinfo is not None):
        problems.add(
            document.place((*place, "start")),
            "is no date and time with an offset from UTC",
            "write start = 2026-01-31T12:00:00Z",
        )
        table = {name: value for name, value in table.items() if name != "start"}
    if "column" not in table and "rate_Hz" not in table:
        problems.add(document.place(place), "says nothing about the samples' time", "give column and unit, or rate_Hz")
    if "unit" in table and "rate_Hz" in table:
        problems.add(
            document.place((*place, "unit")),
            "goes with a column of times, rate_Hz with one that counts samples",
            "delete one of the two",
        )
    return msgspec.convert(table, Time)


def _check_parts(document: Document, parts: tuple[Part, ...], problems: Problems) -> None:
    stems: set[str] = set()
    for index, part in enumerate(parts):
        if part.stem in stems:
            problems.add(
                document.place(("recording", index)),
                f"a second recording named '{part.stem}'",
                "give it another repeat, or a name",
            )
        stems.add(part.stem)
        if part.end_s <= part.start_s:
            problems.add(document.place(("recording", index, "end_s")), "is not after start_s", "give a later moment")
        if Path(part.source).is_absolute() or ".." in Path(part.source).parts:
            problems.add(
                document.place(("recording", index, "source")),
                f"'{part.source}' is no file of the source folder",
                "name it relative to that folder; the folder is given on the command line",
            )


def _check_turn(document: Document, turn: Turn, streams: tuple[StreamMap, ...], problems: Problems) -> None:
    mapped = {stream.key: stream for stream in streams}
    angles = mapped.get("encoder")
    fields = [channel.field for channel in angles.channels] if angles else []
    if "wrench" not in mapped:
        problems.add(document.place(("turn",)), "no wrench is mapped, and only that is turned", "delete [turn]")
        return
    if f"position[{turn.joint}]" not in fields:
        problems.add(
            document.place(("turn", "joint")),
            f"no angle of '{turn.joint}' is mapped",
            did_you_mean(turn.joint, document.tree.get("encoder", {})),
        )
    elif angles and (angles.time is None or angles.time != mapped["wrench"].time):
        problems.add(document.place(("turn",)), "needs wrench and angle row by row", "give both the same time column")
    for kind in ("F", "T"):
        given = [name for name in document.tree["wrench"] if name.startswith(kind)]
        if len(given) in (1, 2):
            problems.add(
                document.place(("turn",)),
                f"cannot turn {', '.join(given)} alone",
                f"map {kind}x, {kind}y and {kind}z, or none of them",
            )
    if abs(sum(x * x for x in turn.axis) - 1.0) > 1e-9:
        problems.add(document.place(("turn", "axis")), "is no unit vector", "give one, such as [0, 0, 1]")
