"""What a mission is given by: an orbit, relay satellites, the mounting of the mechanism and its limits. SI, rad."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime

from kbs_process.signals.records import Array


@dataclass(frozen=True, slots=True)
class Orbit:
    """A near-circular orbit whose ground track repeats, by its mean elements at `epoch`."""

    epoch: datetime  # UTC; time zero of the mission
    repeat_days: int  # nodal days, in which the ground track repeats
    repeat_orbits: int  # nodal revolutions in them
    inclination: float  # rad
    eccentricity: float
    argument_of_perigee: float  # rad
    ascending_node_time: float  # s, local mean solar time of the ascending node
    argument_of_latitude: float  # rad, at epoch: mean anomaly plus argument of perigee

    @property
    def nodal_period(self) -> float:
        """Time from one ascending node to the next, s; a nodal day is 86400 s where the node follows the sun."""
        return 86400.0 * self.repeat_days / self.repeat_orbits


@dataclass(frozen=True, slots=True)
class Relay:
    """A geostationary relay satellite."""

    name: str
    longitude: float  # rad, east


@dataclass(frozen=True, slots=True, eq=False)
class Limits:
    """What the mechanism may be commanded; each array has azimuth first, elevation second."""

    low: Array  # (2,) rad
    high: Array  # (2,) rad
    rate: float  # rad/s, of each axis
    acceleration: float  # rad/s^2, of each axis


@dataclass(frozen=True, slots=True, eq=False)
class Mission:
    """A stretch of a mission, from the orbit's epoch on."""

    orbit: Orbit
    relays: tuple[Relay, ...]
    attitude: Array  # (3,) rad, rotation vector that turns the local orbital frame's axes into T's
    yaw_steering: bool  # x follows the velocity over the turning Earth, not the inertial one
    limits: Limits
    grazing_height: float  # m above the equatorial radius, below which a line of sight counts as occulted
    duration: float  # s
    cycle: float  # s, between commands
    hand_overs: tuple[float, ...] = ()  # s, when a satellite is left for another although it could be held
