"""A verdict is decided only where the expanded uncertainty leaves no doubt."""

import numpy as np
import pytest

from kbs_process.signals.records import Signal
from kbs_process.stages.verdict import extremes, judge


@pytest.mark.parametrize(
    ("value", "sigma", "verdict"),
    [
        (0.04, 0.005, "pass"),
        (0.0499, 0.005, "pass"),
        (0.0501, 0.005, "undecided"),
        (0.0699, 0.005, "undecided"),
        (0.0701, 0.005, "fail"),
        (0.06, 0.0, "pass"),
        (0.0601, 0.0, "fail"),
    ],
)
def test_judge(value: float, sigma: float, verdict: str):
    assert judge(value, sigma, 0.06) == verdict


def run(values: np.ndarray, valid: np.ndarray) -> Signal:
    return Signal(10.0, 0.5, values, ("Tx", "Ty"), ("N m", "N m"), "S", valid)


def test_the_worst_recording_decides_and_invalid_samples_do_not_count():
    a = run(np.array([[1.0, 0.1], [-3.0, 0.2], [9.0, 0.0]]), np.array([True, True, False]))
    b = run(np.array([[2.0, -0.5], [0.0, 0.0], [0.0, 0.0]]), np.ones(3, dtype=bool))
    tx, ty = extremes([("a", a), ("b", b)], ("Tx", "Ty"), "peak")
    assert (tx.value, tx.recording, tx.time_s) == (3.0, "a", 10.5)
    assert (ty.value, ty.recording, ty.time_s) == (0.5, "b", 10.0)
    (rms,) = extremes([("a", a)], ("Tx",), "rms")
    assert rms.value == pytest.approx(np.sqrt((1 + 9) / 2))
    assert rms.time_s is None
