"""The lag of a repeat is found; what is no repeat is not taken for one."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kbs_process.signals.records import Signal
from kbs_process.stages.repeats import lag

DT = 0.05


def motion(t: np.ndarray, start: float) -> np.ndarray:
    """A slew by 0.3 rad in 60 s, with smooth ends, beginning at `start`."""
    x = np.clip((t - start) / 60.0, 0.0, 1.0)
    return 1.2 + 0.3 * x**3 * (10 - 15 * x + 6 * x**2)


def signal(values: np.ndarray) -> Signal:
    return Signal(0.0, DT, values[:, None], ("el",), ("rad",), "joint", np.ones(len(values), dtype=bool))


T = DT * np.arange(4000)


@settings(max_examples=30, deadline=None)
@given(late=st.floats(-15.0, 40.0))
def test_the_lag_of_a_repeat(late: float):
    found = lag(signal(motion(T, 50.0)), signal(motion(T, 50.0 + late)))
    assert found == pytest.approx(late, abs=1e-4)


def test_a_repeat_of_other_length():
    found = lag(signal(motion(T, 50.0)), signal(motion(T[:3400], 43.21)))
    assert found == pytest.approx(-6.79, abs=1e-4)


def test_another_trajectory_is_no_repeat():
    other = 1.2 + 0.3 * np.sin(2 * np.pi * T / 45.0)
    assert lag(signal(motion(T, 50.0)), signal(other)) is None
    assert lag(signal(np.full_like(T, 0.5)), signal(motion(T, 50.0))) is None
