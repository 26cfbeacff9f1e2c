"""The format of mappings, stated once: which columns of a file are which channels, in which units, and when."""

from __future__ import annotations

from math import inf
from typing import Annotated, ClassVar, Literal

from pydantic import AwareDatetime, ConfigDict, Field

from kbs_process.campaign.config import Role
from kbs_process.campaign.formats.tables import (
    NUMBER,
    STREAM,
    TEXT,
    TRUTH,
    Count,
    LinkName,
    Magnitude,
    Name,
    NotNegative,
    Positive,
    Some,
    SomeDistinct,
    Table,
    Version,
    by_kind,
)
from kbs_process.campaign.formats.tables import Text as Words
from kbs_process.stages.align.clocks import UNKNOWN_OFFSET_S

Which = Annotated[Annotated[Words, TEXT] | Annotated[Count, NUMBER], by_kind]
OneCharacter = Annotated[str, Field(min_length=1, max_length=1)]


StreamKey = Annotated[str, Field(pattern=STREAM)]


class TextTable(Table):
    """How delimited text is written; what is left out is found from the first lines."""

    delimiter: OneCharacter | None = Field(None, description='" ": any number of blanks')
    header: bool | None = Field(None, description="is there a line with the names of the columns?")
    units_row: bool | None = Field(None, description="is there a line with their units below it?")
    skip_rows: Annotated[int, Field(ge=0, le=1_000_000)] | None = Field(None, description="lines above all that")
    rows: Annotated[int, Field(ge=1)] | None = Field(None, description="rows that are read, of more")
    decimal: Literal[".", ","] | None = None
    thousands: Literal[".", ",", " ", "'"] | None = Field(None, description="what parts thousands")
    comment: Annotated[str, Field(min_length=1, max_length=20)] | None = Field(
        None, description="what begins a comment"
    )
    encoding: Words | None = None


class TextsTable(TextTable):
    """Delimited text of all files. Streams in files of their own have tables of their own, whole."""

    wrench: TextTable | None = None
    effort: TextTable | None = None
    encoder: TextTable | None = None
    rate: TextTable | None = None
    command: TextTable | None = None
    field: TextTable | None = None
    temperature: TextTable | None = None


class Time(Table):
    """Where the time of a stream's samples is."""

    column: Which | None = Field(None, description="a column's name, or its number counted from 1")
    unit: Literal["s", "ms", "us", "ns", "min", "datetime"] = "s"
    format: Words | None = Field(
        None, description='of dates that are not ISO 8601, as Python writes it: "%d.%m.%Y %H:%M:%S,%f"'
    )
    rate_Hz: Positive | None = Field(
        None, description="sampling rate, Hz: the column counts samples, or, without a column, so do the rows"
    )
    start: AwareDatetime | None = Field(
        None, description="date and time, with offset from UTC, of time zero; default: 1970-01-01T00:00:00Z"
    )


class TimesTable(Time):
    """Time of the samples; left out: the file's own (TDMS, MDF4). Other streams have tables of their own."""

    wrench: Time | None = None
    effort: Time | None = None
    encoder: Time | None = None
    rate: Time | None = None
    command: Time | None = None
    field: Time | None = None
    temperature: Time | None = None


class ColumnTable(Table):
    """One channel: which column, and in which unit."""

    column: Which = Field(description="a column's name, or its number counted from 1")
    unit: Words = Field(description="in which the file has it")
    scale: Magnitude = Field(1.0, description="multiplies the file's numbers; -1 turns the sign")
    offset: Magnitude = Field(0.0, description="added after that, in `unit`")
    radius_m: Positive | None = Field(
        None,
        description="the file has the way or the speed of a surface at this radius, in a unit of length or velocity",
    )
    unwrap: Annotated[Annotated[bool, TRUTH] | Annotated[Positive, NUMBER], by_kind] = Field(
        False,
        description="an angle that starts again at every turn: make it continuous; a number is what it starts again "
        "at, in the file's numbers, where that is no turn of the joint",
    )


Joints = Annotated[dict[LinkName, ColumnTable], Field(min_length=1)]


class WrenchTable(Table):
    """Force and moment on the transducer, as recorded: no bias removed, no cross-coupling undone."""

    filled: ClassVar[bool] = True

    Fx: ColumnTable | None = None
    Fy: ColumnTable | None = None
    Fz: ColumnTable | None = None
    Tx: ColumnTable | None = None
    Ty: ColumnTable | None = None
    Tz: ColumnTable | None = None


class CommandTable(Table):
    """What was commanded."""

    filled: ClassVar[bool] = True

    position: Joints | None = Field(None, description="desired angle of each joint")
    velocity: Joints | None = Field(None, description="desired rate of each joint")


class QuaternionTable(Table):
    """Columns of a quaternion."""

    w: Which = Field(description="the scalar: cos of half the angle")
    x: Which
    y: Which
    z: Which


Row = Annotated[list[Which], Field(min_length=3, max_length=3)]


class OrientationTable(Table):
    """Angles of joints from the orientation of the link that the last one carries, against what carries the first."""

    joints: Annotated[SomeDistinct[LinkName], Field(max_length=3)] = Field(
        description="from the laboratory outwards: all that turn between the two"
    )
    quaternion: QuaternionTable | None = None
    matrix: Annotated[list[Row], Field(min_length=3, max_length=3)] | None = Field(
        None, description="columns of a rotation matrix, row by row"
    )
    maps: Literal["link to base", "base to link"] = Field(
        description="whose axes a vector is given in, and gets components in; the base carries the first joint"
    )
    at_zero: Annotated[list[Magnitude], Field(min_length=4, max_length=9)] | None = Field(
        None,
        description="w, x, y, z or the matrix row by row, as the file has it where all joints are at zero, however the "
        "sensor is mounted; default: no rotation",
    )


class Turn(Table):
    """For a file whose forces and moments are in the axes of a link that does not turn with the transducer."""

    joint: Words = Field(description="its angle of the same row is taken")
    axis: Annotated[list[Magnitude], Field(min_length=3, max_length=3)] = Field(description="unit vector, in T")
    factor: Magnitude = Field(
        description="force and moment are turned by this times the angle, right-handed about the axis"
    )


class Source(Table):
    """Where the files come from; copied into the campaign."""

    origin: Words | None = Field(None, description="who measured, and where the files are published")
    licence: Words | None = None
    reference: Words | None = Field(None, description="publication")


class Part(Table):
    """One recording, or the part of a source file that becomes one."""

    source: Words = Field(description="file in the source folder")
    file: dict[StreamKey, Words] = Field({}, description="other files there, of streams that lie in one")
    shift_s: dict[StreamKey, Annotated[float, Field(ge=-4e9, le=4e9)]] = Field(
        {}, description="added to the times of a stream, s, so that its clock agrees with that of the other files"
    )
    shift_sigma_s: NotNegative = Field(
        UNKNOWN_OFFSET_S, description="standard deviation of `shift_s`, s; it counts in the uncertainty of results"
    )
    name: Name | None = Field(None, description="of the recording; default: trajectory_repeat")
    trajectory: Name
    role: Role
    repeat: Count = 1
    section: Count | None = Field(
        None, description="of a text that repeats its line of names, counted from 1; holds for each of its texts"
    )
    start_s: NotNegative = Field(0.0, description="leave out what is before, s from the file's first sample")
    end_s: Positive = Field(inf, description="leave out this moment and what is after")

    @property
    def stem(self) -> str:
        """Name of the recording's file, without suffix."""
        return self.name or f"{self.trajectory}_{self.repeat}"

    def file_of(self, stream: str) -> str:
        """Name of the file that a stream is in."""
        return self.file.get(stream, self.source)

    def shift_of(self, stream: str) -> float:
        """Return what is added to a stream's times, s: of several files, the streams of one share their shift."""
        shared = (
            shift for key, shift in self.shift_s.items() if self.file and self.file_of(key) == self.file_of(stream)
        )
        return self.shift_s.get(stream, next(shared, 0.0))


class MappingFile(Table):
    """All of a mapping."""

    model_config = ConfigDict(title="mapping: how files of other formats become the recordings of a campaign")

    schema_: Version = Field(alias="schema", description="version of this format")
    campaign: Words = Field(
        description="a campaign.toml, relative to the mapping: its text and its parameter files are taken over, its "
        "recordings replaced"
    )
    format: Words | None = Field(
        None, description="of the source files, by name: text, hdf5, ...; default: by their suffix"
    )
    text: TextsTable = TextsTable.model_construct()
    time: TimesTable = TimesTable.model_construct()
    wrench: WrenchTable | None = None
    turn: Turn | None = None
    effort: Joints | None = Field(
        None,
        description="force, torque, current or voltage of each joint's drive, in the unit that the campaign reads "
        "after scale",
    )
    encoder: Joints | None = Field(None, description="angle of each joint, or way of a prismatic one")
    orientation: Some[OrientationTable] | None = Field(None, description="of links, instead of their joints' angles")
    rate: Joints | None = Field(None, description="rate of each joint")
    command: CommandTable | None = None
    field: Joints | None = Field(None, description="position of each motor's field")
    temperature: ColumnTable | None = None
    source: Source = Source.model_construct()
    recording: Some[Part]
