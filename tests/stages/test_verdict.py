"""A verdict is decided only where the expanded uncertainty leaves no doubt."""

from dataclasses import replace

import numpy as np
import pytest

from kbs_process.signals.records import Signal
from kbs_process.stages.bandpass import Band, apply, crossing_rate
from kbs_process.stages.verdict import extremes, interval, judge, peak_coverage


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


def test_every_recording_has_its_own_peak_and_invalid_samples_do_not_count():
    a = run(np.array([[1.0, 0.1], [-3.0, 0.2], [9.0, 0.0]]), np.array([True, True, False]))
    b = run(np.array([[2.0, -0.5], [0.0, 0.0], [0.0, 0.0]]), np.ones(3, dtype=bool))
    tx, other, _, ty = extremes([("a", a), ("b", b)], ("Tx", "Ty"), "peak")
    assert (other.value, other.recording) == (2.0, "b")
    assert (tx.value, tx.recording, tx.time_s) == (3.0, "a", 10.5)
    assert (ty.value, ty.recording, ty.time_s) == (0.5, "b", 10.0)
    (rms,) = extremes([("a", a)], ("Tx",), "rms")
    assert rms.value == pytest.approx(np.sqrt((1 + 9) / 2))
    assert rms.time_s is None


def test_noise_alone_breaks_no_limit_by_its_peak():
    # The peak of ten minutes of noise is some 3.5 sigma: two sigma less would still be above a limit of one.
    band, dt, sigma = Band("lt1Hz", 0.01, 1.0), 0.05, 1e-3
    rng = np.random.default_rng(7)
    below = peak_coverage(crossing_rate(band, dt) * 600.0)
    failed = by_two_sigma = above = 0
    for _ in range(40):
        x = run(rng.normal(size=(12_000, 2)), np.ones(12_000, dtype=bool))
        noise = apply(replace(x, dt=dt), band)
        noise = noise.derive(noise.values * sigma / noise.values[noise.valid].std(axis=0), "scaled")
        for found in extremes([("noise", noise)], ("Tx", "Ty"), "peak"):
            failed += judge(found.value, sigma, sigma, below) == "fail"
            by_two_sigma += judge(found.value, sigma, sigma) == "fail"
            above += found.value > 3.3 * sigma
    assert failed <= 5  # of 80, each with a probability of 2.3 %
    assert by_two_sigma > 60
    assert above > 40


def test_the_interval_of_a_peak_reaches_further_down_than_up():
    below = peak_coverage(700.0)
    assert interval(1.0, 0.1, below) == pytest.approx((1.0 - 0.1 * below, 1.2))
    assert interval(0.3, 0.1, below) == pytest.approx((0.0, 0.5))
    assert interval(1.0, 0.1) == pytest.approx((0.8, 1.2))


def test_how_often_noise_in_a_band_crosses_zero():
    band, dt, n = Band("lt2Hz", 0.01, 2.0), 0.05, 200_000
    x = apply(replace(run(np.random.default_rng(8).normal(size=(n, 2)), np.ones(n, dtype=bool)), dt=dt), band).column(
        "Tx"
    )
    up = np.count_nonzero((x[:-1] < 0.0) & (x[1:] >= 0.0)) / (n * dt)
    assert crossing_rate(band, dt) == pytest.approx(up, rel=0.02)


def test_a_peak_well_above_the_noise_still_fails():
    assert judge(0.1, 0.005, 0.06, peak_coverage(700.0)) == "fail"
    assert judge(0.075, 0.005, 0.06, peak_coverage(700.0)) == "undecided"
    assert peak_coverage(0.0) >= 2.0
