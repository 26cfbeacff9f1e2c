"""Where the spacecraft and the relay satellites are, in the true-equator, mean-equinox frame of SGP4 (TEME)."""

from __future__ import annotations

import numpy as np
from sgp4.api import WGS72, Satrec, jday

from kbs_process.errors import MissionError
from kbs_process.mission.model import Orbit, Relay
from kbs_process.signals.records import Array

EARTH_RADIUS = 6378135.0  # m, equatorial, WGS 72 as in SGP4
EARTH_RATE = 1.00273790935 * 2.0 * np.pi / 86400.0  # rad/s, against the mean equinox (IAU 1982)
EARTH_MU = 3.986008e14  # m^3/s^2, WGS 72
GEOSTATIONARY_RADIUS = (EARTH_MU / EARTH_RATE**2) ** (1.0 / 3.0)  # m; the Earth's oblateness adds 0.5 km

_SGP4_EPOCH = 2433281.5  # Julian date of 1949 December 31, 0 h UT, from which SGP4 counts days


def julian_date(orbit: Orbit) -> tuple[float, float]:
    """Return the Julian date of the epoch as day and fraction: together they resolve 1e-11 s."""
    e = orbit.epoch
    day, fraction = jday(e.year, e.month, e.day, e.hour, e.minute, e.second + 1e-6 * e.microsecond)
    return float(day), float(fraction)


def sidereal_angle(orbit: Orbit, t: Array) -> Array:
    """Greenwich mean sidereal angle, rad, at t (n,) s after the epoch.

    IAU 1982 (Aoki et al., Astron. Astrophys. 105:359), UT1 taken as UTC: the error of up to 0.9 s turns the Earth by
    at most 7e-5 rad, and relay satellites are kept in their place to 1e-3 rad.
    """
    day, fraction = julian_date(orbit)
    days = day - 2451545.0 + fraction + t / 86400.0  # UT1 days from J2000
    T = days / 36525.0
    seconds = 67310.54841 + 8640184.812866 * T + 0.093104 * T**2 - 6.2e-6 * T**3  # plus whole turns
    turn: Array = np.mod(2.0 * np.pi * (seconds / 86400.0 + days), 2.0 * np.pi)
    return turn


def satellite(orbit: Orbit) -> Satrec:
    """Return SGP4's satellite with the mean elements of `orbit`.

    The mean motion is the one for which SGP4's own secular rates make the nodal period that of the repeat
    cycle: dM/dt + d omega/dt = 2 pi / P. The node lies where its local mean solar time makes it lie:
    RAAN = sidereal angle + 15 deg/h (LTAN - UT). Drag is left out: over a day it moves ENVISAT by some 10 m.
    """
    day, fraction = julian_date(orbit)
    now = np.mod(86400.0 * (day + fraction - 0.5), 86400.0)
    sun = 2.0 * np.pi / 86400.0 * (orbit.ascending_node_time - now)
    node = float(sidereal_angle(orbit, np.zeros(1))[0]) + sun
    wanted = 2.0 * np.pi / (orbit.nodal_period / 60.0)  # rad/min
    motion = wanted
    for _ in range(10):  # the rates change by 1e-3 of the motion: each round gains three digits
        made = _initialised(orbit, day + fraction, float(np.mod(node, 2.0 * np.pi)), motion)
        motion += wanted - (made.mdot + made.argpdot)
    return made


def _initialised(orbit: Orbit, date: float, node: float, motion: float) -> Satrec:
    made = Satrec()
    anomaly = np.mod(orbit.argument_of_latitude - orbit.argument_of_perigee, 2.0 * np.pi)
    made.sgp4init(
        WGS72, "i", 0, date - _SGP4_EPOCH, 0.0, 0.0, 0.0, orbit.eccentricity, orbit.argument_of_perigee,
        orbit.inclination, float(anomaly), motion, node,
    )  # fmt: skip
    if made.error:
        raise MissionError(
            f"SGP4 refuses these elements (code {made.error})",
            where="[orbit]",
            remedy="check repeat cycle, eccentricity and inclination",
        )
    return made


def spacecraft(orbit: Orbit, t: Array) -> tuple[Array, Array]:
    """Position (n, 3) m and velocity (n, 3) m/s in TEME at t (n,) s after the epoch.

    SGP4 (Vallado et al., AIAA 2006-6753). Against a real orbit of 800 km it errs by about 1 km after a day, 3e-5 rad
    seen from a relay satellite; the geometry of a reference day needs no better.
    """
    day, fraction = julian_date(orbit)
    errors, position, velocity = satellite(orbit).sgp4_array(np.full(len(t), day), fraction + t / 86400.0)
    if errors.any():
        raise MissionError(
            f"SGP4 cannot propagate the orbit (code {errors.max()})", where="[orbit]", remedy="check its elements"
        )
    return 1e3 * position, 1e3 * velocity


def relay(satellite: Relay, orbit: Orbit, t: Array) -> Array:
    """Position (n, 3) m in TEME of a geostationary satellite: on the equator, turning with the Earth."""
    angle = sidereal_angle(orbit, t) + satellite.longitude
    place: Array = GEOSTATIONARY_RADIUS * np.stack([np.cos(angle), np.sin(angle), np.zeros_like(t)], axis=1)
    return place
