"""The mapping: a TOML file that says how files of other formats become the recordings of a campaign."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import msgspec

from kbs_process.campaign.documents import Document, Key, read, shown
from kbs_process.campaign.formats.faults import checked
from kbs_process.campaign.problems import Problems
from kbs_process.campaign.units import UnitMismatchError, alike, factor
from kbs_process.errors import ConfigError, did_you_mean
from kbs_process.recordings.formats import Text, formats
from kbs_process.signals.records import WRENCH_CHANNELS, WRENCH_UNITS
from kbs_process.studies.convert import PRESETS, preset_names
from kbs_process.studies.convert.mapping_file import (
    ColumnTable,
    MappingFile,
    OrientationTable,
    Part,
    Source,
    TextTable,
    Time,
    TimesTable,
    Turn,
)
from kbs_process.studies.convert.orientation import Orientation

KELVIN = 273.15  # 0 degC, K


class Channel(msgspec.Struct, frozen=True):
    """One channel of a stream: value in `unit` = gain * cell + offset."""

    field: str  # place in the message: "wrench.force.x", "position[az]"
    column: int | str
    given: str  # unit of the file's numbers, as the mapping says
    scale: float  # that multiplies them
    unit: str  # SI
    gain: float
    offset: float = 0.0
    turn: float = 0.0  # at which an angle that is to be unwrapped starts again, in `unit`


class StreamMap(msgspec.Struct, frozen=True):
    """One stream of the recordings to be."""

    key: str  # as in campaign.toml's [topics]: "wrench", "encoder", ...
    time: Time | None  # None: the file's own
    channels: tuple[Channel, ...]
    orientations: tuple[Orientation, ...] = ()

    @property
    def units(self) -> dict[str, str]:
        """SI units of all numbers, by their places in the message."""
        angles = {field: "rad" for one in self.orientations for field in one.fields}
        return {channel.field: channel.unit for channel in self.channels} | angles


class Mapping(msgspec.Struct, frozen=True):
    """A mapping that passed every check."""

    path: Path
    template: Path  # campaign.toml
    format: str | None  # of all source files; None: each by its suffix
    texts: dict[str, Text]  # by stream
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
    file = checked(document, MappingFile, problems)
    if file.format is not None and file.format not in formats():
        remedy = did_you_mean(file.format, formats())
        problems.add(document.place(("format",)), f"'{file.format}' is not allowed", remedy)
    given = file.model_fields_set | ({"encoder"} if file.orientation else set())
    streams = tuple(_stream(document, file, key, problems) for key in STREAMS if key in given)
    _check_parts(document, file.recording, streams, problems)
    if file.turn:
        _check_turn(document, file.turn, streams, file.recording, problems)
    problems.raise_any()
    return Mapping(
        path=path,
        template=path.parent / file.campaign,
        format=file.format,
        texts={key: _text(file, key) for key in STREAMS},
        streams=streams,
        turn=file.turn,
        source=file.source,
        parts=tuple(file.recording),
    )


def _text(file: MappingFile, key: str) -> Text:
    own: TextTable | None = getattr(file.text, key)
    return Text(**(own or file.text).model_dump(exclude_none=True, exclude=set(STREAMS)))


def _stream(document: Document, file: MappingFile, key: str, problems: Problems) -> StreamMap:
    table = getattr(file, key)
    rows: list[tuple[Key, str, tuple[str, ...], ColumnTable]] = []  # key, field, SI units, column
    # In the order of the file.
    match key:
        case "wrench":
            units = dict(zip(WRENCH_CHANNELS, WRENCH_UNITS, strict=True))
            rows = [
                ((key, name), WRENCH_FIELDS[name], (units[name],), getattr(table, name)) for name in document.tree[key]
            ]
        case "command":
            rows = [
                ((key, kind, joint), f"{kind}[{joint}]", JOINT_UNITS[kind], cell)
                for kind in document.tree[key]
                for joint, cell in getattr(table, kind).items()
            ]
        case "temperature":
            rows = [((key,), "temperature", ("degC",), table)]
        case _:
            part = {"rate": "velocity", "effort": "effort"}.get(key, "position")
            rows = [
                ((key, joint), f"{part}[{joint}]", JOINT_UNITS[part], cell) for joint, cell in (table or {}).items()
            ]
    channels = tuple(_channel(document, *row, problems) for row in rows)
    orientations = [
        _orientation(document, index, one, problems)
        for index, one in enumerate(file.orientation or ())
        if key == "encoder"
    ]
    stream = StreamMap(key, _time(document, file.time, key, problems), channels, tuple(orientations))
    fields = [*(channel.field for channel in channels), *(field for one in orientations for field in one.fields)]
    if twice := [field for field, count in Counter(fields).items() if count > 1]:
        problems.add(document.place(("orientation",)), f"{twice[0]} is mapped twice", "give each joint's angle once")
    return stream


def _orientation(document: Document, index: int, one: OrientationTable, problems: Problems) -> Orientation:
    q, matrix = one.quaternion, one.matrix
    columns = [] if q is None else [q.w, q.x, q.y, q.z]
    columns += [] if matrix is None else [column for row in matrix for column in row]
    if (q is None) == (matrix is None):
        remedy = "give quaternion = { w, x, y, z } or matrix"
        problems.add(document.place(("orientation", index)), "has no columns, or those of two", remedy)
    elif one.at_zero and len(one.at_zero) != len(columns):
        remedy = "w, x, y, z of a quaternion, a matrix row by row"
        problems.add(document.place(("orientation", index, "at_zero")), f"has not {len(columns)} numbers", remedy)
    return Orientation(tuple(one.joints), tuple(columns), one.maps == "base to link", tuple(one.at_zero or ()))


def _channel(
    document: Document, key: Key, field: str, allowed: tuple[str, ...], cell: ColumnTable, problems: Problems
) -> Channel:
    unit, scale, radius, again = cell.unit, cell.scale, cell.radius_m, cell.unwrap
    # A way along a surface of some radius is an angle; any other unit tells by itself which one it is of.
    kin = [] if radius is not None else [si for si in allowed if alike(unit, si)]
    si = kin[0] if kin else allowed[0]
    if again and si != "rad":
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
    turn = 2.0 * math.pi * again if isinstance(again, bool) else abs(again * gain * scale)
    return Channel(field, cell.column, unit, scale, si, gain * scale, offset + gain * cell.offset, turn)


def _time(document: Document, common: TimesTable, key: str, problems: Problems) -> Time | None:
    own: Time | None = getattr(common, key)
    table, place = (common, ("time",)) if own is None else (own, ("time", key))
    given = table.model_fields_set & Time.model_fields.keys()
    if not given:
        return None
    if not given & {"column", "rate_Hz"}:
        problems.add(document.place(place), "says nothing about the samples' time", "give column and unit, or rate_Hz")
    if {"unit", "rate_Hz"} <= given:
        problems.add(
            document.place((*place, "unit")),
            "goes with a column of times, rate_Hz with one that counts samples",
            "delete one of the two",
        )
    return Time.model_construct(**{name: getattr(table, name) for name in Time.model_fields})


def _check_parts(document: Document, parts: Sequence[Part], streams: Sequence[StreamMap], problems: Problems) -> None:
    mapped = [stream.key for stream in streams]
    dated = all(one.time is None or one.time.unit == "datetime" or one.time.start for one in streams)
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
        for place, name in ((("source",), part.source), *((("file", key), name) for key, name in part.file.items())):
            if Path(name).is_absolute() or ".." in Path(name).parts:
                problems.add(
                    document.place(("recording", index, *place)),
                    f"'{name}' is no file of the source folder",
                    "name it relative to that folder; the folder is given on the command line",
                )
        for key in part.file:
            if key not in mapped:
                problems.add(document.place(("recording", index, "file", key)), "is not mapped", f"add [{key}]")
        stated = {part.file_of(key) for key in part.shift_s}
        unstated = [name for name in dict.fromkeys(map(part.file_of, mapped)) if name not in stated]
        if len(unstated) > 1 and not dated:
            problems.add(
                document.place(("recording", index, "file")),
                f"'{unstated[0]}' and '{unstated[1]}' have a clock each: nothing says how they stand to each other",
                "give shift_s = { encoder = ... }, s that are added to the times of a stream, or dates in both files",
            )


def _check_turn(
    document: Document, turn: Turn, streams: tuple[StreamMap, ...], parts: Sequence[Part], problems: Problems
) -> None:
    apart = any(part.file_of("encoder") != part.file_of("wrench") for part in parts)
    mapped = {stream.key: stream for stream in streams}
    angles = mapped.get("encoder")
    fields = angles.units if angles else {}
    if "wrench" not in mapped:
        problems.add(document.place(("turn",)), "no wrench is mapped, and only that is turned", "delete [turn]")
        return
    if f"position[{turn.joint}]" not in fields:
        problems.add(
            document.place(("turn", "joint")),
            f"no angle of '{turn.joint}' is mapped",
            did_you_mean(turn.joint, [field[9:-1] for field in fields]),
        )
    elif angles and (angles.time is None or angles.time != mapped["wrench"].time or apart):
        problems.add(document.place(("turn",)), "needs wrench and angle row by row", "give both the same file and time")
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
