"""What a simulated reference day has to say: the contents of its results.json, typed. Angles in rad."""

from __future__ import annotations

from typing import Literal

from kbs_process.results.pointing import PointingEstimate
from kbs_process.results.records import Constant, Record, ResultsFile, Status


class PublishedSection(Record, frozen=True, kw_only=True):
    """A published table's figures, in the units that it is printed in."""

    azimuth_mdeg: float
    elevation_mdeg: float
    torque_Nm: float
    torque: str
    comment: str
    end_s: float


class Spread(Record, frozen=True, kw_only=True):
    """What units that the parameters' uncertainties allow differ by in a figure, in its unit."""

    mean: float
    sigma: float
    least: float
    greatest: float


class Without(Record, frozen=True, kw_only=True):
    """The rms of a torque as it is without something, in its unit."""

    name: str
    value: float


class Cause(Record, frozen=True, kw_only=True):
    """What makes a torque."""

    frequency_Hz: float  # the strongest about its moment
    mode_Hz: float | None  # the nearest mode of gears and rotors, where it is near
    without: tuple[Without, ...]  # of its section, least first


class Torque(Record, frozen=True, kw_only=True):
    """Greatest disturbance torque at the spacecraft's centre of mass, over all axes."""

    band: str  # names its table
    label: str
    value: float  # N m
    axis: str
    time_s: float
    rms: float = 0.0  # of the resultant over the section
    units: Spread | None = None
    cause: Cause | None = None  # of what is above the other bands


class MastIn(Record, frozen=True, kw_only=True):
    """What a mast changes in a section."""

    rigid: tuple[float, ...]  # N m: the torques below the widest, as they are on a rigid interface
    cross_elevation: float  # rad: greatest turn of the boresight by its head
    elevation: float


class Mast(Record, frozen=True, kw_only=True):
    """The modes of the unit on its mast; each range is over the poses."""

    source: str
    frequency_Hz: tuple[tuple[float, float], ...]  # least and greatest of each mode
    damping: tuple[tuple[float, float], ...]


class Section(Record, frozen=True, kw_only=True):
    """A section of the day."""

    name: str
    start_s: float
    end_s: float
    ends_with: str  # event
    modes: tuple[str, ...]  # what the antenna does, in order: "tracking DRS59"
    greatest_rate: float  # rad/s, commanded on either axis
    azimuth: PointingEstimate
    elevation: PointingEstimate
    torques: tuple[Torque, ...]  # narrowest band first
    azimuth_units: Spread | None = None  # of its 95 %
    elevation_units: Spread | None = None
    published: PublishedSection | None = None
    mast: MastIn | None = None

    @property
    def axes(self) -> tuple[PointingEstimate, PointingEstimate]:
        """Azimuth and elevation."""
        return self.azimuth, self.elevation


class Judged(Record, frozen=True, kw_only=True):
    """A requirement and the worst section and axis."""

    name: str
    statistic: str
    limit: float
    unit: str
    value: float
    sigma: float
    verdict: Status
    where: str
    source: str


class Phase(Record, frozen=True, kw_only=True):
    """A stretch of the trajectory in one mode."""

    mode: str
    relay: str
    start_s: float
    end_s: float


class Geometry(Record, frozen=True, kw_only=True):
    """The orbit, and what the trajectory asks of the mechanism."""

    epoch: str
    nodal_period_s: float
    semi_major_axis_m: float
    node_rate: float  # rad/s
    greatest_rate: float  # rad/s
    greatest_acceleration: float  # rad/s^2
    rate_limit: float
    acceleration_limit: float
    azimuth: tuple[float, float]  # least and greatest
    elevation: tuple[float, float]


class ReferenceDayResults(ResultsFile, frozen=True, kw_only=True):
    """results.json of a simulated reference day."""

    name: str
    title: str
    article: str
    kind: Literal["reference-day"] = "reference-day"
    geometry: Geometry
    phases: tuple[Phase, ...]
    sections: tuple[Section, ...]
    requirements: tuple[Judged, ...]
    boresight: tuple[PointingEstimate, ...]  # over the whole day
    mast: Mast | None = None  # None: rigid
    samples: int = 0  # units beside the nominal one
    failed: int = 0  # that could not be simulated
    seed: int = 0
    discussion: tuple[str, ...] = ()
    parameters: tuple[Constant, ...] = ()
    notes: tuple[str, ...] = ()
