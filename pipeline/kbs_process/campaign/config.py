"""A campaign as frozen data: what `load` makes of campaign.toml and the parameter files."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from kbs_process.rig.model import Quantity, Rig

DrivenBy = Literal["command", "motion"]
Load = Literal["torque", "force"]
Frame = Literal["S", "T"]  # at the spacecraft's centre of mass, or at the transducer
Statistic = Literal["peak", "rms"]
Axis = Literal["x", "y", "z"]
PointingStatistic = Literal["random", "bias", "orbit", "percentile"]
Role = Literal["calibration", "fit", "held-out"]


@dataclass(frozen=True, slots=True)
class Requirement:
    """A limit on the disturbance; each of its axes must meet it alone."""

    name: str
    quantity: Load
    frame: Frame
    statistic: Statistic
    limit: float  # in `unit`
    unit: str  # "N m" or "N"
    band: tuple[float, float]  # Hz
    source: str
    axes: tuple[Axis, ...] = ("x", "y", "z")

    @property
    def channels(self) -> tuple[str, ...]:
        """The channels of a wrench that it is about."""
        return tuple(("T" if self.quantity == "torque" else "F") + axis for axis in self.axes)


@dataclass(frozen=True, slots=True)
class PointingRequirement:
    """A limit on a statistic of the pointing error; each axis must meet it alone."""

    name: str
    statistic: PointingStatistic
    limit: float  # rad
    source: str


@dataclass(frozen=True, slots=True)
class Bands:
    """The frequency bands in which histories are compared."""

    high_pass: float  # Hz, lower edge of all bands; 0 is none
    low_pass: tuple[float, ...]  # Hz, upper edges, ascending
    working_rate: float  # Hz, sampling rate of all stages


@dataclass(frozen=True, slots=True)
class Topic:
    """Where a stream of the pipeline is in a recording."""

    key: str  # the stream: "wrench", "effort", "angle", "rate", "command", "field", "temperature", "pointing",
    # "accelerometer" or "gyro"
    topic: str
    fields: tuple[str, ...]  # place of each channel in a message: "wrench.force.x", "position[az]"
    channels: tuple[str, ...]  # names of the channels: "Fx"; "az"; "az.rate"
    units: tuple[str, ...]  # of the channels, SI
    channel: int | None = None  # of the file, where several publishers bring the topic; None: all


@dataclass(frozen=True, slots=True)
class Topics:
    """The streams of a campaign's recordings; None where the rig records no such thing."""

    wrench: Topic | None
    effort: Topic | None
    angle: Topic | None
    rate: Topic | None
    command: Topic | None
    field: Topic | None
    temperature: Topic | None
    pointing: Topic | None  # angles by an external instrument
    accelerometer: Topic | None = None
    gyro: Topic | None = None

    def present(self) -> tuple[Topic, ...]:
        """Return the streams that the campaign names, loads first."""
        streams = (
            self.wrench,
            self.effort,
            self.angle,
            self.rate,
            self.command,
            self.field,
            self.temperature,
            self.pointing,
            self.accelerometer,
            self.gyro,
        )
        return tuple(stream for stream in streams if stream is not None)

    def channels(self) -> Mapping[str, tuple[str, ...]]:
        """Return the names of the channels by stream key."""
        return {stream.key: stream.channels for stream in self.present()}

    def units(self) -> Mapping[str, tuple[str, ...]]:
        """Return the units of the channels by stream key."""
        return {stream.key: stream.units for stream in self.present()}


@dataclass(frozen=True, slots=True)
class RecordingEntry:
    """One recording of a campaign, and what it is used for."""

    name: str  # the file's stem; names the tables of this run
    path: Path
    trajectory: str
    role: Role
    repeat: int
    sha256: str | None  # as the campaign states it, already found right
    start: float | None  # s from the recording's start; what is before is left out
    end: float | None  # s from the recording's start; what is after is left out
    without: tuple[str, ...] = ()  # effects of the model that did not act in it
    clock_sigma: float = 0.0  # s, of how its streams' clocks stand to each other, beyond what stamps tell


@dataclass(frozen=True, slots=True, eq=False)
class SensingLaw:
    """What a sensor or its clock does to the prediction of one recording."""

    law: str  # its name in the catalogue
    # Channel; two or three of them, READS<-ACTS or READS<-ACTS<-ACTS; joint of an encoder; "wrench" or "encoder".
    site: str
    parameters: Mapping[str, Quantity]


@dataclass(frozen=True, slots=True)
class Campaign:
    """A campaign that passed every check."""

    folder: Path
    name: str
    title: str
    article: str
    configuration: str
    drive: DrivenBy
    requirements: tuple[Requirement, ...]
    bands: Bands
    topics: Topics
    effects: tuple[str, ...]  # of the nominal model, in the catalogue's order
    recordings: tuple[RecordingEntry, ...]
    rig: Rig
    inputs: tuple[Path, ...]  # files of the description: campaign.toml, parameter files, CSV matrices
    mission: Path | None = None  # orbit, relay satellites and limits of a reference day
    mast: Path | None = None  # modes of the unit on its mast; None: rigid
    pointing: tuple[PointingRequirement, ...] = ()  # of recordings
    flight_pointing: tuple[PointingRequirement, ...] = ()  # of the flight model alone
    document: dict[str, str] = field(default_factory=dict)  # number, revision, operator, serial_number, date
    modal: Path | None = None  # modes of the article on its transducer; None: derived from the plant
    sensing: tuple[SensingLaw, ...] = ()  # acting on predictions of one recording alone
    sources: Mapping[str, str] = field(default_factory=dict)  # SHA-256 of the files that recordings were imported from

    @property
    def files(self) -> tuple[Path, ...]:
        """Every file that results depend on: the description, then the recordings."""
        return tuple(dict.fromkeys((*self.inputs, *(entry.path for entry in self.recordings))))

    def acting(self, entry: RecordingEntry) -> tuple[str, ...]:
        """Return the effects of the nominal model that acted in a recording."""
        return tuple(name for name in self.effects if name not in entry.without)

    def recording(self, name: str) -> RecordingEntry:
        """Return the recording of that name."""
        return next(entry for entry in self.recordings if entry.name == name)

    def with_role(self, *roles: str) -> tuple[RecordingEntry, ...]:
        """Return the recordings that have one of `roles`, in the campaign's order."""
        return tuple(entry for entry in self.recordings if entry.role in roles)
