"""Lines of sight, computed a second way; frames; occultation."""

from __future__ import annotations

import hypothesis.extra.numpy as npst
import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from kbs_process.mission.geometry import azimuth_elevation, boresight, line_of_sight, local_frame, occulted, separation
from kbs_process.mission.orbit import EARTH_RADIUS, EARTH_RATE, relay, spacecraft
from kbs_process.signals.records import Array
from mission import reference

T = np.arange(0.0, 14600.0, 20.0)


def test_elevation_and_azimuth_by_triangles() -> None:
    """From the sides of the triangle Earth - spacecraft - relay, and from the orbit's normal: no frame is built."""
    for one in reference.mission().relays:
        u, _ = line_of_sight(reference.mission(), one, T)
        q = azimuth_elevation(u)
        r, v = spacecraft(reference.orbit(), T)
        target = relay(one, reference.orbit(), T)
        distance = np.linalg.norm(target - r, axis=1)
        high = np.linalg.norm(r, axis=1)
        along = np.sum(r * target, axis=1) / high
        assert np.sin(q[:, 1]) == pytest.approx((along - high) / distance, abs=1e-12)
        normal = np.cross(r, v)
        across = np.sum(normal * target, axis=1) / np.linalg.norm(normal, axis=1) / distance
        assert np.sin(q[:, 0]) * np.cos(q[:, 1]) == pytest.approx(across, abs=1e-12)
        ahead = np.sum(v * (target - r), axis=1)  # nearly horizontal: the orbit is nearly circular
        clear = np.abs(ahead) > 0.01 * distance * np.linalg.norm(v, axis=1)
        assert (np.sign(ahead) == np.sign(np.cos(q[:, 0])))[clear].all()


def test_a_satellite_is_lost_at_the_earth_s_limb() -> None:
    u, hidden = line_of_sight(reference.mission(), reference.mission().relays[0], T)
    elevation = azimuth_elevation(u)[:, 1]
    r, _ = spacecraft(reference.orbit(), T)
    limb = -np.arccos((EARTH_RADIUS + reference.mission().grazing_height) / np.linalg.norm(r, axis=1))
    assert hidden.any() and not hidden.all()
    assert np.array_equal(hidden, elevation < limb)


@given(npst.arrays(np.float64, (2, 3), elements=st.floats(-5.0, 5.0)))
def test_occultation_is_what_points_along_the_segment_say(ends: Array) -> None:
    a, b = ends
    assume(np.linalg.norm(b - a) > 0.01)
    along = np.linspace(0.0, 1.0, 2001)[:, None]
    nearest = np.linalg.norm(a + along * (b - a), axis=1).min()
    if abs(nearest - 1.0) > 0.01:
        assert bool(occulted(a[None], b[None], 1.0)[0]) == bool(nearest < 1.0)


@given(st.floats(-3.1, 3.1), st.floats(-1.5, 1.5))
def test_angles_survive_a_round_trip(az: float, el: float) -> None:
    q = np.array([[az, el]])
    assert azimuth_elevation(boresight(q)) == pytest.approx(q, abs=1e-9)


@given(st.floats(1e-9, 3.0))
def test_separation_is_exact_at_small_and_large_angles(angle: float) -> None:
    a, b = boresight(np.zeros((1, 2))), boresight(np.array([[angle, 0.0]]))
    assert separation(a, b)[0] == pytest.approx(angle, rel=1e-7)


def test_the_local_frame_looks_up_forward_and_along_the_normal() -> None:
    r, v = spacecraft(reference.orbit(), T)
    R = local_frame(r, v)
    assert np.linalg.det(R) == pytest.approx(1.0)
    up = r / np.linalg.norm(r, axis=1, keepdims=True)
    assert R[:, :, 2] == pytest.approx(up, abs=1e-12)
    assert (np.sum(R[:, :, 0] * v, axis=1) > 0.99 * np.linalg.norm(v, axis=1)).all()
    assert (R[:, 2, 1] < 0.0).all()  # the normal of a retrograde orbit points south of the equator


def test_yaw_steering_follows_the_ground_track() -> None:
    r, v = spacecraft(reference.orbit(), T)
    plain, steered = local_frame(r, v), local_frame(r, v, yaw_steering=True)
    yaw = np.arccos(np.clip(np.sum(plain[:, :, 0] * steered[:, :, 0], axis=1), -1.0, 1.0))
    node = np.argmin(np.abs(r[:, 2]))
    speed, i = np.linalg.norm(v[node]), reference.orbit().inclination
    turned = np.array([speed * np.cos(i) - EARTH_RATE * np.linalg.norm(r[node]), speed * np.sin(i)])
    expected = np.arccos(turned @ [np.cos(i), np.sin(i)] / np.linalg.norm(turned))
    assert yaw[node] == pytest.approx(expected, rel=0.02)
    assert np.degrees(yaw.max()) == pytest.approx(3.9, abs=0.2)
    assert steered[:, :, 2] == pytest.approx(plain[:, :, 2])
