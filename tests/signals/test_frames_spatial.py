"""Properties of rotations and of wrench and twist transforms."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation

from kbs_process.signals import frames, spatial

vectors = arrays(float, 3, elements=st.floats(-3, 3))
sixes = arrays(float, 6, elements=st.floats(-10, 10))
quick = settings(max_examples=60, deadline=None)


@quick
@given(vectors)
def test_rotation_vector_agrees_with_scipy_and_survives_a_round_trip(phi):
    R = frames.from_rotation_vector(phi)
    np.testing.assert_allclose(R, Rotation.from_rotvec(phi).as_matrix(), atol=1e-13)
    if np.linalg.norm(phi) < np.pi - 1e-6:
        np.testing.assert_allclose(Rotation.from_matrix(R).as_rotvec(), phi, atol=1e-9)


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-4, 3.1, np.pi - 1e-7])
def test_round_trip_near_zero_and_near_half_a_turn(angle):
    phi = angle * np.array([[0.6, 0.0, -0.8], [0.0, 1.0, 0.0]])
    back = Rotation.from_matrix(frames.from_rotation_vector(phi)).as_rotvec()
    np.testing.assert_allclose(back, phi, rtol=1e-9, atol=1e-15)


def test_about_axis_is_vectorised_and_right_handed():
    R = frames.about_axis(np.array([0.0, -1.0, 0.0]), np.array([0.0, np.pi / 2]))
    np.testing.assert_allclose(frames.rotate(R, np.array([1.0, 0, 0])), [[1, 0, 0], [0, 0, 1]], atol=1e-15)


def test_tilt_turns_gravity_as_the_convention_says():
    tx, ty = 0.3, -0.2
    gravity = frames.from_tilt(np.array([tx, ty])).T @ [0, 0, -1.0]
    expected = [np.sin(ty), -np.sin(tx) * np.cos(ty), -np.cos(tx) * np.cos(ty)]
    np.testing.assert_allclose(gravity, expected, atol=1e-15)


def _transform_twist(twist, R_GT, r_GT):
    """The same motion [v, omega] at G's origin in G's axes: omega' = R omega, v' = R v + r x omega'."""
    omega = R_GT @ twist[3:]
    return np.concatenate([R_GT @ twist[:3] + np.cross(r_GT, omega), omega])


@quick
@given(vectors, vectors, sixes, sixes)
def test_power_is_invariant_and_transforms_invert(phi, r, wrench, twist):
    R = frames.from_rotation_vector(phi)
    moved, carried = spatial.transform_wrench(wrench, R, r), _transform_twist(twist, R, r)
    assert moved @ carried == pytest.approx(wrench @ twist, abs=1e-9)
    back = spatial.inverse_pose(R, r)
    np.testing.assert_allclose(spatial.transform_wrench(moved, *back), wrench, atol=1e-11)
    np.testing.assert_allclose(_transform_twist(carried, *back), twist, atol=1e-11)
    np.testing.assert_allclose(spatial.wrench_matrix(R, r) @ wrench, moved, atol=1e-12)


def test_force_at_an_offset_makes_the_moment_r_cross_f():
    wrench = np.array([[0, 0, -10.0, 0, 0, 0]])
    moved = spatial.transform_wrench(wrench, np.eye(3), np.array([0.5, 0.25, 0]))
    np.testing.assert_allclose(moved, [[0, 0, -10, -2.5, 5.0, 0]])


def test_into_xyz_is_the_turns_undone():
    rng = np.random.default_rng(5)
    angles, a = rng.uniform(-1.0, 1.0, (2, 7, 3))
    np.testing.assert_allclose(frames.rotate(frames.from_xyz(angles), frames.into_xyz(angles, a)), a, atol=1e-14)
