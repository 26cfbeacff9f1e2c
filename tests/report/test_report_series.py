"""Decimation, packing and wording: no extreme is lost, no number distorted."""

from __future__ import annotations

import base64

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kbs_process.report import series, text


@settings(max_examples=60, deadline=None)
@given(n=st.integers(3, 400), points=st.integers(2, 100), seed=st.integers(0, 2**31))
def test_an_envelope_keeps_both_extremes_of_every_bin(n: int, points: int, seed: int) -> None:
    values = np.random.default_rng(seed).standard_normal(n)
    size = series.stride(n, points)
    drawn = series.envelope(values, size)
    if size == 1:
        assert drawn is values
        return
    assert len(drawn) <= points + 2
    for index in range(0, n, size):
        pair = drawn[2 * (index // size) : 2 * (index // size) + 2]
        piece = values[index : index + size]
        assert sorted(pair) == [piece.min(), piece.max()]
        if piece.argmin() < piece.argmax():
            assert pair[0] <= pair[1]


def test_an_envelopes_times_stay_within_half_a_bin() -> None:
    t = 5.0 + 0.05 * np.arange(1000)
    values = np.zeros(1000)
    values[537] = 1.0
    first, step = series.times(t, 20)
    drawn = series.envelope(values, 20)
    assert abs(first + step * int(drawn.argmax()) - t[537]) <= 0.5 * 20 * 0.05


def test_a_bin_without_numbers_stays_empty() -> None:
    values = np.array([np.nan] * 4 + [1.0, np.nan, 3.0, 2.0])
    np.testing.assert_array_equal(series.envelope(values, 4), [np.nan, np.nan, 1.0, 3.0])


@pytest.mark.parametrize("values", [[0.0, 1.0, -3.0], [5.0, 5.0], [np.nan, 2.0, 7.0], [np.nan], [1e-9, 2e-9]])
def test_packing_errs_by_less_than_a_part_in_a_hundred_thousand(values: list[float]) -> None:
    packed = series.pack(np.array(values))
    codes = np.frombuffer(base64.b64decode(str(packed["codes"])), dtype="<i2").astype(float)
    codes[codes == -32768] = np.nan
    back = float(str(packed["middle"])) + float(str(packed["scale"])) * codes
    spread = np.nanmax(values) - np.nanmin(values) if np.isfinite(values).any() else 0.0
    np.testing.assert_allclose(back, values, rtol=0, atol=8e-6 * spread + 1e-300)


def test_stretches_are_closed_intervals() -> None:
    mask = np.array([True, False, False, True, True])
    assert series.stretches(np.arange(5.0), mask) == ((0.0, 0.0), (3.0, 4.0))


def _scene(n: int, curves: int) -> series.Scene:
    trace = series.Trace("Tx", "N m", np.zeros(n), None, None)
    return series.Scene("run", "band", np.arange(float(n)), np.ones(n, dtype=bool), (trace,) * curves)


def test_curves_share_the_pages_budget() -> None:
    scenes = [_scene(1000, 3), _scene(50_000, 6)]
    short, long = series.views(scenes, budget=20_000)
    lengths = [len(base64.b64decode(str(c.curves[0]["codes"]))) // 2 for c in (*short.channels, *long.channels)]
    assert lengths[:3] == [1000] * 3, "a short recording is kept sample by sample"
    assert sum(lengths) <= 20_000 * 1.02
    assert short.bin_s is None
    assert long.bin_s == pytest.approx(36.0, abs=1.0)


def test_what_the_page_cannot_carry_is_left_out() -> None:
    assert len(series.views([_scene(10_000, 6)] * 40, budget=60 * series.FEWEST)) == 10


@pytest.mark.parametrize(
    ("value", "sigma", "said"),
    [
        (0.0412, 0.0031, "0.0412 ± 0.0031"),
        (-274.6, 1.23, "−274.6 ± 1.2"),
        (14.0213, 0.0041, "14.0213 ± 0.0041"),
        (2.1e-6, 3e-7, "(2.10 ± 0.30) × 10⁻⁶"),
        (10000.0, 500.0, "10000 ± 500"),
        (0.0, 0.003, "0.0000 ± 0.0030"),
        (0.5, 0.0, "0.5000"),
        (None, 0.1, "–"),
        (float("nan"), 0.1, "–"),
    ],
)
def test_a_value_is_written_to_its_uncertainty(value: float | None, sigma: float, said: str) -> None:
    assert text.measure(value, sigma).replace("\u00a0", " ") == said


@pytest.mark.parametrize(
    ("value", "said"),
    [
        (0.0, "0"),
        (12345.6, "12346"),
        (0.06, "0.0600"),
        (9.99e6, "9.99 × 10⁶"),
        (-3.0e-7, "−3.00 × 10⁻⁷"),
        (9.999e6, "1.00 × 10⁷"),
        # Next to nothing, as the probability of a law that is not it: there is no power of ten to divide it by.
        (5e-324, "4.94 × 10⁻³²⁴"),
    ],
)
def test_numbers_have_three_digits(value: float, said: str) -> None:
    assert text.number(value).replace("\u00a0", " ") == said


@pytest.mark.parametrize(
    ("edges", "said"),
    [
        ((0.01, 1.0), "0.01 to 1 Hz"),
        ((None, 2.0), "below 2 Hz"),
        ((0.02, None), "above 0.02 Hz"),
        ((None, None), "unfiltered"),
    ],
)
def test_bands_in_words(edges: tuple[float | None, float | None], said: str) -> None:
    assert text.band_hz(*edges).replace("\u00a0", " ") == said
