"""The reduction to the working rate keeps what it says it keeps: gain, phase, aliases, ends."""

from __future__ import annotations

import numpy as np
import pytest

from kbs_process.stages.align.resample import Reducer, design, resample

WORKING = 20.0
RATES = [10.0, 13.7, 20.0, 31.0, 100.0, 240.0, 1000.0, 1000.03, 10000.0]


def tones(rate: float, frequencies: np.ndarray, seconds: float) -> np.ndarray:
    t = np.arange(int(seconds * rate)) / rate
    return np.cos(2.0 * np.pi * frequencies * t[:, None] + 0.3)


@pytest.mark.parametrize("rate", RATES)
def test_tones_in_the_passband_keep_gain_and_phase(rate: float) -> None:
    frequencies = design(rate, WORKING).passband * np.array([0.0, 0.01, 0.2, 0.5, 0.8, 0.95, 1.0])
    y = resample(tones(rate, frequencies, 40.0), rate, WORKING)
    t = np.arange(len(y)) / WORKING
    error = np.abs(y - np.cos(2.0 * np.pi * frequencies * t[:, None] + 0.3))[100:-100]
    assert error.max() < 1e-5


@pytest.mark.parametrize("rate", [31.0, 100.0, 240.0, 1000.0, 1000.03, 10000.0])
def test_tones_that_would_alias_are_120_db_down(rate: float) -> None:
    frequencies = np.geomspace(12.0, 0.499 * rate, 60)
    alias = np.abs(frequencies - WORKING * np.round(frequencies / WORKING))
    y = resample(tones(rate, frequencies, 40.0), rate, WORKING)[100:-100]
    into_passband = np.abs(y[:, alias <= 8.0]).max()
    assert 20.0 * np.log10(into_passband) < -120.0


@pytest.mark.parametrize("rate", [10.0, 13.7])
def test_a_slow_input_is_interpolated_without_images(rate: float) -> None:
    tone = np.array([0.39 * rate])
    y = resample(tones(rate, tone, 60.0), rate, WORKING)[150:-150, 0]
    spectrum = np.abs(np.fft.rfft(y * np.kaiser(len(y), 18.0)))
    f = np.fft.rfftfreq(len(y), 1.0 / WORKING)
    images = spectrum[np.abs(f - tone[0]) > 0.5]
    assert images.max() < 1e-5 * spectrum.max()


@pytest.mark.parametrize("rate", [100.0, 1000.0, 10000.0])
def test_the_impulse_response_is_symmetric(rate: float) -> None:
    n = int(8.0 * rate)
    x = np.zeros((n + 1, 1))
    x[n // 2] = 1.0  # at 4 s, on the working grid
    y = resample(x, rate, WORKING)[:, 0]
    np.testing.assert_allclose(y, y[::-1], atol=1e-12 * y.max())
    assert int(np.argmax(y)) == 80


def test_filter_and_time_reversal_commute() -> None:
    x = np.random.default_rng(3).normal(size=(10_001, 2)).cumsum(axis=0)
    np.testing.assert_allclose(resample(x[::-1], 1000.0, WORKING), resample(x, 1000.0, WORKING)[::-1], atol=1e-10)


def test_constants_pass_exactly_and_trends_continue_at_the_ends() -> None:
    t = np.arange(30_000) / 1000.0
    y = resample(np.column_stack((np.full_like(t, 275.0), 9.0 + 0.3 * t)), 1000.0, WORKING)
    np.testing.assert_allclose(y[:, 0], 275.0, rtol=1e-13)
    np.testing.assert_allclose(y[:, 1], 9.0 + 0.3 * np.arange(len(y)) / WORKING, rtol=1e-6)


def test_the_result_does_not_depend_on_where_rows_are_cut() -> None:
    x = np.random.default_rng(5).normal(size=(30_000, 3))
    results = []
    for size in (8192, 1000, 17_001):
        reducer = Reducer(design(1000.0, WORKING))
        for start in range(0, len(x), size):
            reducer.push(x[start : start + size], None)
        kept = reducer.finish()
        assert kept is not None
        results.append(kept.x)
    np.testing.assert_allclose(results[1], results[0], atol=1e-13)
    np.testing.assert_allclose(results[2], results[0], atol=1e-13)


def test_the_weight_of_invented_samples_is_carried_through_both_filters() -> None:
    x = np.zeros((20_000, 1))
    lost = np.zeros(len(x), dtype=bool)
    lost[10_000:10_100] = True
    reducer = Reducer(design(1000.0, WORKING))
    reducer.push(x, lost)
    kept = reducer.finish()
    assert kept is not None
    t = np.arange(400) / WORKING
    _, doubt = kept.at(t)
    away = np.minimum(np.abs(t - 10.05), np.minimum(t, t[-1] - t))  # s from the gap or from an end
    assert doubt[201] > 0.5  # in the gap's middle
    assert doubt[0] > 0.5  # half of the filter looks before the beginning
    assert doubt[away > 1.2].max() < 1e-6 < doubt[away < 0.9].min()


def test_too_few_samples_are_refused() -> None:
    with pytest.raises(ValueError, match="too few"):
        resample(np.zeros((500, 1)), 1000.0, WORKING)
