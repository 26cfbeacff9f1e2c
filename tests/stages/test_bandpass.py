"""Bands: gains as stated, no phase, edges as stated, sound at 0.01 Hz."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import solveh_banded
from scipy.signal import butter, sosfiltfilt

from kbs_process.signals.records import Signal
from kbs_process.stages.align.resample import resample
from kbs_process.stages.bandpass import UNFILTERED, Band, apply, bridged, bridging_error, gain, statement
from kbs_process.stages.lowfrequency import high_pass

DT = 0.05
BELOW_1 = Band("lt1Hz", 0.01, 1.0)
BELOW_2 = Band("lt2Hz", 0.01, 2.0)


def signal(values: np.ndarray, valid: np.ndarray | None = None) -> Signal:
    n, c = values.shape
    flags = np.ones(n, dtype=bool) if valid is None else valid
    return Signal(0.0, DT, values, tuple(f"c{k}" for k in range(c)), ("N m",) * c, "T", flags)


@pytest.mark.parametrize("band", [BELOW_1, BELOW_2, Band("hp", 0.02, None), Band("lp", None, 2.0)])
def test_tones_come_out_with_the_stated_gain_and_no_phase(band: Band) -> None:
    f = np.array([0.003, 0.01, 0.02, 0.1, 0.5, 1.0, 1.4, 2.0, 3.0, 5.0])
    t = DT * np.arange(60_000)
    x = np.cos(2.0 * np.pi * f * (t[:, None] - 1500.0))
    y = apply(signal(x), band).values
    middle = slice(10_000, -10_000)
    np.testing.assert_allclose(y[middle], gain(band, f, DT) * x[middle], atol=2e-5)


def test_gain_is_half_at_the_limits_and_small_at_a_resonance_next_to_them() -> None:
    f = np.array([0.01, 1.0, 0.1, 3.0])
    np.testing.assert_allclose(gain(BELOW_1, f, DT)[:2], 0.5, atol=1e-6)
    assert abs(gain(BELOW_1, f, DT)[2] - 1.0) < 2e-4
    assert gain(BELOW_2, f, DT)[3] < 0.04


def test_the_unfiltered_band_is_the_identity() -> None:
    x = signal(np.random.default_rng(0).normal(size=(500, 2)))
    y = apply(x, UNFILTERED)
    assert y.values is x.values and y.valid is x.valid and y.history[-1].endswith("as it is")


@pytest.mark.parametrize("band", [BELOW_1, Band("hp", 0.01, None), Band("lp", None, 1.0)])
def test_bands_are_symmetric_and_commute_with_time_reversal(band: Band) -> None:
    x = np.random.default_rng(1).normal(size=(4000, 2)).cumsum(axis=0)
    forwards, backwards = apply(signal(x), band), apply(signal(x[::-1].copy()), band)
    np.testing.assert_allclose(backwards.values[::-1], forwards.values, atol=1e-7 * np.abs(x).max())
    np.testing.assert_array_equal(backwards.valid[::-1], forwards.valid)
    impulse = np.zeros((8001, 1))
    impulse[4000] = 1.0
    h = apply(signal(impulse), band).values[:, 0]
    np.testing.assert_allclose(h, h[::-1], atol=1e-10)


def test_on_long_records_it_is_the_plain_zero_phase_filter() -> None:
    x = np.random.default_rng(2).normal(size=(40_000, 1)).cumsum(axis=0)
    plain = sosfiltfilt(butter(2, 0.01, "high", output="sos", fs=1.0 / DT), x, axis=0)
    ours = high_pass(x, 0.01, DT)
    middle = slice(6000, -6000)  # 300 s
    assert np.abs(ours - plain)[middle].max() < 1e-4 * plain[middle].std()


@pytest.mark.parametrize("n", [1, 2, 3, 4, 5, 6, 4000])
def test_the_solution_is_that_of_a_general_banded_solver(n: int) -> None:
    x = np.random.default_rng(6).normal(size=(n, 3)).cumsum(axis=0)
    expected = np.zeros_like(x)
    if n > 2:
        band = np.zeros((3, n - 2))
        band[0], band[1, : n - 3], band[2, : max(n - 4, 0)] = (6.0 + (2.0 * np.sin(np.pi * 0.01 * DT)) ** 4, -4.0, 1.0)
        z = solveh_banded(band[: min(3, n - 2)], np.diff(x, 2, axis=0), lower=True)
        expected[:-2] += z
        expected[1:-1] -= 2.0 * z
        expected[2:] += z
    np.testing.assert_allclose(high_pass(x, 0.01, DT), expected, atol=1e-6 * np.abs(x).max())


def test_lines_are_trend_entirely_and_offsets_cost_no_digits() -> None:
    t = DT * np.arange(4000)[:, None]
    assert np.abs(high_pass(9.0 + 0.05 * t, 0.01, DT)).max() < 1e-10
    x = 0.01 * np.random.default_rng(3).normal(size=(4000, 1))
    assert np.abs(high_pass(x + 275.0, 0.01, DT) - high_pass(x, 0.01, DT)).max() < 1e-8


def test_ten_kilohertz_at_a_hundredth_of_a_hertz() -> None:
    t = np.arange(3_000_000) / 10_000.0
    wanted = 0.02 * np.sin(2.0 * np.pi * 0.3 * t)
    raw = wanted + 9.0 + 0.01 * t + 0.5 * np.sin(2.0 * np.pi * 370.0 * t)
    y = apply(signal(resample(raw[:, None], 10_000.0, 20.0)), BELOW_1)
    expected = gain(BELOW_1, np.array([0.3]), DT) * wanted[::500]
    inside = slice(3 * 20, -3 * 20)
    assert np.abs(y.values[inside, 0] - expected[inside]).max() < 0.05 * 0.02  # a tone cut off at both ends
    assert np.abs(y.values[2500:3500, 0] - expected[2500:3500]).max() < 1e-3 * 0.02


def test_bands_that_cannot_be_computed_are_refused() -> None:
    with pytest.raises(ValueError, match=r"high-pass at 0\.001 Hz"):
        apply(signal(np.zeros((100, 1))), Band("deep", 0.001, None))


def test_what_is_invented_is_flagged_as_far_as_the_filter_carries_it() -> None:
    valid = np.ones(4000, dtype=bool)
    valid[2000:2010] = False
    y = apply(signal(np.zeros((4000, 1)), valid), BELOW_1)
    t = DT * np.arange(4000)
    assert not y.valid[np.abs(t - 100.2) < 1.0].any()
    assert not y.valid[[0, -1]].any()
    assert y.valid[(t > 3.5) & (t < 96.0)].all() and y.valid[(t > 104.0) & (t < 196.0)].all()


def cut(x: np.ndarray, n: int, band: Band) -> tuple[float, np.ndarray]:
    """Rms of the error of n samples filtered alone, over the rms of the band's signal; and the error itself."""
    whole = apply(signal(x), band)
    start = (len(x) - n) // 2
    alone = apply(signal(x[start : start + n]), band)
    error = alone.values - whole.values[start : start + n]
    rms = np.sqrt(np.mean(whole.values[8000:-8000] ** 2))
    return float(np.sqrt(np.mean(error[alone.valid] ** 2)) / rms), error / rms


@pytest.mark.parametrize("band", [BELOW_1, BELOW_2, Band("hp02", 0.02, 1.0)])
def test_the_statement_holds_on_200_s_cut_out_of_long_records(band: Band) -> None:
    said = statement(band, DT, 4000)
    white = np.random.default_rng(4).normal(size=(40_000, 60))
    assert cut(white, 4000, band)[0] == pytest.approx(said.edge_error, rel=0.2)
    assert cut(white.cumsum(axis=0), 4000, band)[0] == pytest.approx(said.edge_error_drift, rel=0.2)


def test_beyond_the_stated_edge_the_error_is_below_a_thousandth() -> None:
    edge = statement(BELOW_1, DT, 16_001).edge_s
    assert 100.0 < edge < 230.0
    drift = np.random.default_rng(5).normal(size=(60_000, 40)).cumsum(axis=0)
    error = np.sqrt(np.mean(cut(drift, 20_000, BELOW_1)[1] ** 2, axis=1))
    k = int(edge / DT)
    assert error[k:-k].max() < 1.3e-3 and error[k // 3] > 1e-3


def test_a_low_pass_alone_is_over_in_seconds() -> None:
    said = statement(Band("lp", None, 1.0), DT, 4000)
    assert said.edge_error < 1e-3 and 1.0 < said.flagged_s < 4.0
    assert statement(UNFILTERED, DT, 4000).edge_s == 0.0


def test_what_was_invented_in_a_gap_leaks_nowhere():
    rng = np.random.default_rng(5)
    x = rng.normal(size=(4000, 1))
    valid = np.ones(4000, dtype=bool)
    valid[2000:2100] = False
    valid[3500:] = False  # to the end: a stream that stopped
    wild = np.where(valid[:, None], x, 300.0)
    y, clean = apply(signal(wild, valid), BELOW_1), apply(signal(x, valid), BELOW_1)
    np.testing.assert_allclose(y.values[y.valid], clean.values[clean.valid], atol=1e-9)
    whole = apply(signal(x), BELOW_1)
    assert np.abs(y.values - whole.values)[y.valid].max() < 0.3 * whole.values.std()


def test_a_line_across_a_gap_that_is_short_in_the_band_is_what_was_there() -> None:
    """A sample in 50 ms is lost each 10 s, two seconds once; flags are as wide as the filter to this rate reaches."""
    t = DT * np.arange(2400)
    x = np.column_stack((np.sin(2.0 * np.pi * 0.4 * t), np.cos(2.0 * np.pi * 0.9 * t)))
    lost, valid = x.copy(), np.ones(2400, dtype=bool)
    gaps = np.array([*((at - DT, at + DT) for at in np.arange(10.0, 110.0, 10.0)), (73.0, 75.0)])
    for start, end in gaps:
        inside = (t > start + 1e-9) & (t < end - 1e-9)
        lost[inside] = np.column_stack([np.interp(t[inside], t[~inside], column[~inside]) for column in x.T])
        valid[(t > start - 0.7) & (t < end + 0.7)] = False
    valid[[0, -1]] = False
    known = bridged(signal(lost, valid), gaps, BELOW_1, 0.7)
    unknown = (t > 73.0 - 0.7) & (t < 75.0 + 0.7)
    unknown[[0, -1]] = True
    assert np.array_equal(known.valid, ~unknown)
    assert np.array_equal(bridged(signal(lost, valid), gaps, UNFILTERED, 0.7).valid, valid)
    short = (t < 60.0)[:, None]
    filtered, truth = (
        apply(signal(np.where(short, lost, x), known.valid | ~short[:, 0]), BELOW_1),
        apply(signal(x), BELOW_1),
    )
    assert filtered.valid[100:-100].all()
    assert np.abs(filtered.values - truth.values)[100:-100].max() < 1.5 * bridging_error(gaps, BELOW_1) < 0.015


@pytest.mark.parametrize("band", [Band("lt1Hz", 0.05, 1.0), Band("lp", None, 1.0)])
def test_the_statement_of_a_long_record_is_that_of_its_ends(band: Band) -> None:
    """Errors are over the whole record: of one four times as long they are half as large, if its middle has none."""
    n = int((60.0 if band.high_pass_Hz is None else 1600.0) / (0.25 * DT))
    short, long = statement(band, DT, n), statement(band, DT, 4 * n)
    assert long.edge_s == pytest.approx(short.edge_s, rel=0.2)
    for one, other in ((short.edge_error, long.edge_error), (short.edge_error_drift, long.edge_error_drift)):
        assert other == pytest.approx(0.5 * one, rel=0.05)
