"""Transfers of one axis: their ends, their limits, and the times that no transfer can beat."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from kbs_process.mission.profile import State, stopping_distance, transfer

RATE, ACCELERATION = 2.0, 0.015  # deg/s, deg/s^2: units cancel

rates = st.floats(-1.0, 1.0)
places = st.floats(-165.0, 165.0)


@given(places, rates, places, rates, st.floats(1.0, 2000.0))
def test_a_transfer_keeps_its_ends_and_its_limits(p0: float, v0: float, p1: float, v1: float, duration: float) -> None:
    made = transfer(State(p0, v0), State(p1, v1), duration, RATE, ACCELERATION)
    assume(made is not None)
    assert made is not None
    t = np.linspace(0.0, duration, 4001)
    p = made.position(t)
    dt = t[1]
    assert p[0] == pytest.approx(p0, abs=1e-9)
    assert p[-1] == pytest.approx(p1, abs=1e-9)
    v = np.diff(p) / dt
    assert np.abs(v).max() <= RATE * (1.0 + 1e-9)
    assert v[0] == pytest.approx(v0, abs=0.51 * ACCELERATION * dt + 1e-9)
    assert v[-1] == pytest.approx(v1, abs=0.51 * ACCELERATION * dt + 1e-9)
    assert np.abs(np.diff(v)).max() <= ACCELERATION * dt * (1.0 + 1e-6) + 1e-11 / dt


@given(st.floats(1.0, 330.0))
def test_from_rest_to_rest_takes_as_long_as_the_limits_make_it(distance: float) -> None:
    ramps = RATE**2 / ACCELERATION
    least = 2.0 * np.sqrt(distance / ACCELERATION) if distance < ramps else distance / RATE + RATE / ACCELERATION
    rest = State(0.0, 0.0), State(distance, 0.0)
    assert transfer(*rest, 0.999 * least, RATE, ACCELERATION) is None
    made = transfer(*rest, 1.001 * least, RATE, ACCELERATION)
    assert made is not None and 0.0 < made.cruise <= RATE


def test_more_time_makes_a_slower_transfer() -> None:
    cruises = [transfer(State(0.0, 0.0), State(100.0, 0.0), T, RATE, ACCELERATION) for T in (200.0, 400.0, 2000.0)]
    found = [one.cruise for one in cruises if one is not None]
    assert len(found) == 3 and found[0] > found[1] > found[2] == pytest.approx(0.05, rel=0.01)


def test_stopping_distance_is_what_braking_covers() -> None:
    for v in (-1.5, 0.3):
        x, rate, dt = 0.0, v, 1e-3
        while rate * v > 0.0:
            x, rate = x + rate * dt, rate - np.sign(v) * ACCELERATION * dt
        assert stopping_distance(np.array([v]), ACCELERATION)[0] == pytest.approx(x, rel=1e-3)
