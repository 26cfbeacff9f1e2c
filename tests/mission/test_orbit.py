"""The orbit against what is published of it, and against an independent integration."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from sgp4.propagation import gstime

from kbs_process.mission.model import Relay
from kbs_process.mission.orbit import (
    EARTH_MU,
    EARTH_RADIUS,
    EARTH_RATE,
    GEOSTATIONARY_RADIUS,
    julian_date,
    relay,
    satellite,
    sidereal_angle,
    spacecraft,
)
from kbs_process.signals.records import Array
from mission import reference

J2 = 1.082616e-3


def node_passages(t: Array, z: Array) -> Array:
    """Times at which the spacecraft crosses the equator northwards, by linear interpolation."""
    up = np.flatnonzero((z[:-1] < 0.0) & (z[1:] >= 0.0))
    return t[up] - z[up] * (t[up + 1] - t[up]) / (z[up + 1] - z[up])


def longitude(t: Array) -> Array:
    """Longitude of the point below the spacecraft, rad."""
    r, _ = spacecraft(reference.orbit(), t)
    return np.arctan2(r[:, 1], r[:, 0]) - sidereal_angle(reference.orbit(), t)


def test_the_node_comes_round_501_times_in_35_days() -> None:
    t = np.arange(0.0, 86400.0 * 2, 10.0)
    passages = node_passages(t, spacecraft(reference.orbit(), t)[0][:, 2])
    assert np.mean(np.diff(passages)) == pytest.approx(35 * 86400 / 501, abs=0.05)


def test_the_ground_track_repeats_after_35_days() -> None:
    period = 35 * 86400 / 501
    start = node_passages(*(lambda t: (t, spacecraft(reference.orbit(), t)[0][:, 2]))(np.arange(0.0, 7000.0, 5.0)))[0]
    again = np.array([start, start + 501 * period])
    first, last = longitude(again)
    moved = np.degrees(np.angle(np.exp(1j * (last - first))))
    assert abs(moved) < 0.1  # of the 25 deg from one node to the next


def test_the_ascending_node_is_passed_at_22_h_local_time() -> None:
    t = np.arange(0.0, 86400.0, 5.0)
    passages = node_passages(t, spacecraft(reference.orbit(), t)[0][:, 2])
    epoch = reference.orbit().epoch
    universal = epoch.hour + epoch.minute / 60.0 + passages / 3600.0
    local = (universal + np.degrees(longitude(passages)) / 15.0) % 24.0
    assert np.abs(local - 22.0).max() < 1.0 / 60.0


def test_size_and_precession_are_those_of_a_sun_synchronous_orbit_of_800_km() -> None:
    made = satellite(reference.orbit())
    assert made.a * EARTH_RADIUS == pytest.approx(7159.5e3, abs=200.0)  # ENVISAT's published mean semi-major axis
    per_year = made.nodedot / 60.0 * 86400.0 * 365.2422
    assert per_year == pytest.approx(2.0 * np.pi, rel=2e-4)


def test_propagation_agrees_with_an_integration_of_gravity() -> None:
    t = np.linspace(0.0, 6000.0, 61)
    r, v = spacecraft(reference.orbit(), t)

    def gravity(_: float, y: Array) -> Array:
        x, n = y[:3], np.linalg.norm(y[:3])
        flat = 5.0 * (x[2] / n) ** 2 - np.array([1.0, 1.0, 3.0])
        return np.concatenate([y[3:], -EARTH_MU * x / n**3 * (1.0 - 1.5 * J2 * (EARTH_RADIUS / n) ** 2 * flat)])

    found = solve_ivp(gravity, (0.0, t[-1]), np.concatenate([r[0], v[0]]), t_eval=t, rtol=1e-10, atol=1e-3)
    assert np.linalg.norm(found.y[:3].T - r, axis=1).max() < 1e3  # J3, J4 and SGP4's own truncation


def test_the_velocity_is_the_position_s_derivative() -> None:
    t = np.arange(0.0, 6000.0, 0.5)
    r, v = spacecraft(reference.orbit(), t)
    assert np.abs((r[2:] - r[:-2]) / 1.0 - v[1:-1]).max() < 0.5  # m/s


def test_sidereal_angle_is_the_one_of_sgp4_and_advances_by_the_earth_s_rate() -> None:
    day, fraction = julian_date(reference.orbit())
    t = np.array([0.0, 1000.0, 86400.0])
    ours = sidereal_angle(reference.orbit(), t)
    theirs = [gstime(day + fraction + one / 86400.0) for one in t]
    assert np.abs(np.angle(np.exp(1j * (ours - theirs)))).max() < 1e-8
    assert (ours[1] - ours[0]) % (2.0 * np.pi) == pytest.approx(1000.0 * EARTH_RATE, rel=1e-8)


def test_a_relay_stays_above_its_longitude_at_the_geostationary_radius() -> None:
    t = np.linspace(0.0, 86400.0, 25)
    r = relay(Relay("X", np.radians(59.0)), reference.orbit(), t)
    assert np.linalg.norm(r, axis=1) == pytest.approx(42164e3, abs=2e3)
    east = np.arctan2(r[:, 1], r[:, 0]) - sidereal_angle(reference.orbit(), t)
    assert np.abs(np.angle(np.exp(1j * (east - np.radians(59.0))))).max() < 1e-9
    assert pytest.approx(EARTH_MU) == GEOSTATIONARY_RADIUS**3 * EARTH_RATE**2
