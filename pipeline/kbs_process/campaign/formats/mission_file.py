"""Mission files: orbit, relay satellites, mounting, limits and sections of a reference day."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import Annotated, Literal

from pydantic import AfterValidator, AwareDatetime, ConfigDict, Field
from pydantic_core import PydanticCustomError

from kbs_process.campaign.formats.kind import Kind
from kbs_process.campaign.formats.tables import (
    Count,
    LinkName,
    Magnitude,
    Name,
    PlainQuantity,
    PointingLimitTable,
    Positive,
    Some,
    Table,
)


def _in_utc(epoch: datetime) -> datetime:
    try:
        return epoch.astimezone(UTC)
    except OverflowError as error:
        raise PydanticCustomError("datetime_type", "beyond the calendar") from error


Angle = Annotated[PlainQuantity, Kind("rad")]
Range = Annotated[PlainQuantity, Kind("rad", (2,))]
Duration = Annotated[PlainQuantity, Kind("s", low=0.0, strict=True)]
Time = Annotated[PlainQuantity, Kind("s", low=0.0)]


class OrbitTable(Table):
    """A frozen orbit that repeats its ground track."""

    epoch: Annotated[AwareDatetime, AfterValidator(_in_utc)] = Field(
        description="UTC date and time of time zero, a TOML date-time that ends in Z"
    )
    repeat_days: Count = Field(description="nodal days in which the ground track repeats")
    repeat_orbits: Count = Field(description="nodal revolutions in them")
    inclination: Angle
    eccentricity: Annotated[PlainQuantity, Kind("1", low=0.0, high=1.0)]
    argument_of_perigee: Angle
    ascending_node_time: Time = Field(description="local mean solar time of the ascending node, from midnight")
    argument_of_latitude: Angle = Field(description="mean, at the epoch")


class RelayTable(Table):
    """A geostationary relay satellite."""

    longitude: Angle = Field(description="east")


class MountingTable(Table):
    """How the article is mounted on its satellite."""

    attitude: Annotated[PlainQuantity, Kind("rad", (3,))] = Field(
        description="rotation vector that turns the local orbital frame (x forward, z to the zenith) into T"
    )
    yaw_steering: bool = Field(description="x follows the velocity over the turning Earth")
    grazing_height: Annotated[PlainQuantity, Kind("m", low=0.0, high=1e8)] = Field(
        description="above the equatorial radius, below which a line of sight is lost"
    )


class LimitsTable(Table):
    """What the article can do."""

    azimuth: Range = Field(description="least and greatest")
    elevation: Range = Field(description="least and greatest")
    rate: Annotated[PlainQuantity, Kind("rad/s", low=0.0, strict=True)] = Field(description="of either axis")
    acceleration: Annotated[PlainQuantity, Kind("rad/s^2", low=0.0, strict=True)] = Field(description="of either axis")


class DayTable(Table):
    """How long is simulated."""

    duration: Duration
    lead: Time = Field(description="simulated before time zero, and left out")
    smoothing: Duration = Field(description="averaging time that divides slow variation from random error")


class HandOverTable(Table):
    """A satellite is left for another, although it could be held."""

    begin: Time = Field(description="when; at once after a bridge over the zenith, if that is under way")


class Published(Table):
    """A published table's figures for this section, shown beside ours."""

    azimuth_mdeg: Magnitude = Field(description="95 % of the azimuth error")
    elevation_mdeg: Magnitude = Field(description="95 % of the elevation error")
    torque_Nm: Magnitude = Field(description="greatest disturbance torque, or its bound")
    torque: str = Field(description='the same as printed: "< 0.02"')
    comment: str


class SectionEntry(Table):
    """A section of the day: from the end of the one before to an event."""

    name: Name
    until: Literal["loss", "acquisition", "azimuth-extreme", "elevation-extreme", "end"] = Field(
        description="event at which the section ends"
    )
    near: Positive = Field(alias="near_s", description="which of these events: the nearest to this time")
    published: Published | None = None


class MissionFile(Table):
    """All of a mission file."""

    model_config = ConfigDict(
        title="mission file: orbit, relay satellites, mounting, limits and sections of a reference day"
    )

    orbit: OrbitTable
    relay: Annotated[dict[LinkName, RelayTable], Field(min_length=1)] = Field(
        description="geostationary relay satellites; the first that is in view is tracked first"
    )
    mounting: MountingTable
    limits: LimitsTable
    day: DayTable
    hand_over: list[HandOverTable] = Field([], description="planned; without any, a satellite is held until lost")
    requirement: list[PointingLimitTable] = Field([])
    section: Some[SectionEntry]
