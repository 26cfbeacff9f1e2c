"""campaign.toml: what was tested, what it must meet, and which recordings there are."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal

from pydantic import ConfigDict, Field

from kbs_process.campaign.config import Axis, DrivenBy, Frame, Load, Role, Statistic
from kbs_process.campaign.formats.tables import (
    TABLE,
    TEXT,
    Checksum,
    Count,
    Distinct,
    LimitTable,
    Name,
    NotNegative,
    PlainQuantity,
    PointingLimitTable,
    Positive,
    Some,
    SomeDistinct,
    Table,
    Text,
    Version,
    by_kind,
)


class RequirementTable(Table):
    """A limit on the disturbance."""

    name: Text
    quantity: Load
    frame: Frame = Field(description='"S": at the spacecraft\'s centre of mass; "T": at the transducer')
    statistic: Statistic = Field(description="of every axis alone")
    axes: SomeDistinct[Axis] | None = Field(None, description="axes that the requirement is about; default: all three")
    limit: LimitTable
    band_Hz: Annotated[list[NotNegative], Field(min_length=2, max_length=2)] = Field(
        description="lower and upper edge, Hz"
    )
    source: Text


class PointingTable(Table):
    """A limit on the pointing error of the flight model."""

    name: Text
    statistic: Literal["random", "bias", "percentile"] = Field(
        description="2 sigma about the bias; mean; 95 % of the magnitude; of every joint alone"
    )
    limit: LimitTable
    source: Text


class BandsTable(Table):
    """The frequency bands in which histories are compared."""

    high_pass_Hz: NotNegative = Field(description="lower edge of every band, Hz; 0 is none")
    low_pass_Hz: Annotated[SomeDistinct[Positive], Field(max_length=20)] = Field(
        description="upper edges, Hz: one band each"
    )
    working_rate_Hz: Annotated[float, Field(ge=0.01, le=1e6)] = Field(
        description="sampling rate after decimation, Hz; all stages work at this rate"
    )


ChannelNumber = Annotated[int, Field(ge=0, le=65535)]  # in an MCAP file


class TopicTable(Table):
    """A topic whose messages are laid out in some other way than plain ROS 2 messages."""

    topic: Text
    fields_: Some[Text] | None = Field(
        None,
        alias="fields",
        description='where in the message each channel is: "wrench.force.x", "position[az]"; default: plain ROS 2 '
        "messages whose names are the joints'",
    )
    channel: ChannelNumber | None = Field(
        None, description="number of the MCAP channel that is read, where several publishers bring the topic"
    )


class EncoderTable(TopicTable):
    """The topic of the encoders, where they do not read every joint."""

    joints: SomeDistinct[Text] | None = Field(None, description="joints that are read; default: all")


Topic = Annotated[Annotated[Text, TEXT] | Annotated[TopicTable, TABLE], by_kind]
Encoder = Annotated[Annotated[Text, TEXT] | Annotated[EncoderTable, TABLE], by_kind]


class TopicsTable(Table):
    """Where the streams are in the recordings."""

    filled: ClassVar[bool] = True

    wrench: Topic | None = Field(None, description="transducer, N and N m")
    effort: Topic | None = Field(
        None, description="what the drive of each joint puts in, in the unit that the joint's effort is described in"
    )
    encoder: Encoder | None = Field(None, description="angle of each joint, rad; way of a prismatic one, m")
    rate: Topic | None = Field(None, description="rate of each joint, rad/s or m/s, on rigs that record that")
    command: Topic | None = Field(None, description="desired angle (rad) and rate (rad/s) of each joint")
    field: Topic | None = Field(None, description="position of each motor's field, motor rad")
    temperature: Topic | None = Field(None, description="transducer, degC")
    pointing: Topic | None = Field(None, description="angle of each joint by an external instrument, rad")
    accelerometer: Topic | None = Field(None, description="on a link that parameter files name, m/s^2")
    gyro: Topic | None = Field(None, description="on a link that parameter files name, rad/s")


class ParametersTable(Table):
    """Where the rig's numbers are."""

    files: SomeDistinct[Text] = Field(
        description="parameter files, relative to the campaign's folder; together they describe the rig"
    )


class MissionTable(Table):
    """Where the mission is described."""

    file: Text = Field(
        description="orbit, relay satellites and limits, relative to the campaign's folder; with it, a campaign may "
        "have no recordings"
    )
    mast: Text | None = Field(
        None,
        description="modes of the unit on its mast, a modal file, relative to the campaign's folder; left out: rigid",
    )


class SensingTable(Table):
    """What one sensor or its clock does."""

    law: str = Field(description="a sensor's or a clock's law of the catalogue")
    site: str = Field(
        description="channel; two or three of them, READS<-ACTS or READS<-ACTS<-ACTS; joint of an encoder; or a "
        "stream, wrench or encoder"
    )
    parameters: dict[str, PlainQuantity]


class ModelTable(Table):
    """The nominal model."""

    effects: Distinct[str] = Field(description="names of the effects that the nominal model contains")
    modal: Text | None = Field(
        None, description="TOML file with the modes of the article on its transducer (modal.schema.json)"
    )
    sensing: list[SensingTable] = Field(
        [], description="what sensors and their clocks do to a prediction of one recording"
    )


class RecordingTable(Table):
    """One recording, and what it is used for."""

    file: Text = Field(description="MCAP file, relative to the campaign's folder")
    trajectory: Name
    role: Role = Field(
        description='"calibration": pseudo-static, for the gravity fit; "fit": models may be fitted to it; "held-out": '
        "only compared"
    )
    repeat: Count = Field(1, description="number of this run of the trajectory, from 1")
    sha256: Checksum | None = Field(None, description="of the file; checked")
    start_s: NotNegative | None = Field(None, description="leave out what is before, s from the recording's start")
    end_s: Positive | None = Field(None, description="leave out what is after, s from the recording's start")
    clock_sigma_s: NotNegative = Field(
        0.0,
        description="standard deviation of how its streams' clocks stand to each other, s, beyond what timestamps tell",
    )
    without: Distinct[str] = Field(
        [], description="effects of the model that did not act in this recording, as a cord that was not attached"
    )


class FlightTable(Table):
    """The flight model, predicted in orbit: no gravity, on a rigid spacecraft."""

    article: Text | None = Field(None, description="hardware that flies")
    pointing: list[PointingTable] = Field(
        [], description="what its pointing error must meet, beside the requirements on the disturbance"
    )
    substitute: Distinct[Text] = Field(description="parameter files whose values take the place of those of the test")


class SourceFileTable(Table):
    """A file that recordings were imported from."""

    name: Text
    sha256: Checksum
    findings: list[Text] = Field([], description="what was found wrong with it, and what was done")


class SourceTable(Table):
    """Where imported recordings come from; written by the importers."""

    origin: Text | None = Field(None, description="who measured, and where the files are published")
    licence: Text | None = None
    reference: Text | None = Field(None, description="publication")
    file: list[SourceFileTable] = Field([])


class DocumentTable(Table):
    """What stands at the head of the report, beside name and title."""

    number: Text | None = Field(None, description="of the report, as a document")
    revision: Text | None = None
    operator: Text | None = Field(None, description="who ran the test")
    serial_number: Text | None = Field(None, description="of the article")
    date: Text | None = Field(None, description="of the test; default: what the recordings say")


class CampaignFile(Table):
    """All of campaign.toml."""

    model_config = ConfigDict(title="campaign.toml: one test campaign")
    rules: ClassVar[dict[str, Any]] = {"if": {"not": {"required": ["mission"]}}, "then": {"required": ["recording"]}}

    schema_: Version = Field(alias="schema", description="version of this format")
    name: Name = Field(description="short name of the campaign; names its results folder")
    title: Text = Field(description="what was tested, in one line")
    article: str = Field("", description="hardware under test")
    configuration: str = Field("", description="how it was set up")
    document: DocumentTable = DocumentTable.model_construct()
    drive: DrivenBy = Field(
        description='"command": the plant is driven by the commands; "motion": by the measured angles or rates'
    )
    requirement: list[RequirementTable] = Field(
        [], description="what the article must meet; the compliance table has one row each"
    )
    pointing: list[PointingLimitTable] = Field(
        [], description="what the pointing error of its recordings must meet, against what was commanded"
    )
    bands: BandsTable
    topics: TopicsTable
    parameters: ParametersTable
    mission: MissionTable | None = None
    model: ModelTable | None = None
    recording: Some[RecordingTable] = Field([])
    flight: FlightTable | None = None
    source: SourceTable | None = None

    @property
    def effects(self) -> list[str]:
        """Names of the effects of the nominal model."""
        return self.model.effects if self.model else []
