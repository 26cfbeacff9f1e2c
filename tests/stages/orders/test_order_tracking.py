"""Orders against closed forms: amplitude, place, what is no order, and how often chance makes one."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from kbs_process.signals.records import Array
from kbs_process.stages.orders.map import waterfall
from kbs_process.stages.orders.peaks import Peak, floor_of, peaks
from kbs_process.stages.orders.tracking import Average, Track, average, length_of

DT, BAND = 0.05, 8.0
T = DT * np.arange(4000)
RATES = {  # turns/s
    "steady": np.full(len(T), 8e-4),
    "varying": 8e-4 * (1.0 + 0.6 * np.sin(2.0 * np.pi * T / 90.0)),
    "to and fro": 0.05 * np.sin(2.0 * np.pi * T / 40.0),
    "many turns": 1e-3 + 0.3 * T / T[-1],
}


def track_of(rate: Array, sigma: float = 0.0) -> Track:
    return Track(DT * np.cumsum(rate), rate, np.ones(len(rate), dtype=np.bool_), DT, sigma, BAND)


def found(track: Track, loads: Array) -> tuple[Average, list[list[Peak]]]:
    spectrum = average(track, loads, length_of(track))
    columns = range(loads.shape[1])
    return spectrum, [peaks(track, spectrum, c, floor_of(spectrum, c, len(columns))) for c in columns]


def noise(seed: int, kind: str, channels: int = 3) -> Array:
    white = np.random.default_rng(seed).normal(size=(len(T), channels))
    if kind == "resonance":
        r, w = np.exp(-0.1 * 2.0 * np.pi * 3.0 * DT), 2.0 * np.pi * 3.0 * DT
        return lfilter([1.0], [1.0, -2.0 * r * np.cos(w), r * r], white, axis=0)
    if kind == "1/f":
        lines = np.fft.rfft(white, axis=0)
        lines[1:] /= np.sqrt(np.arange(1, len(lines)))[:, None]
        return np.fft.irfft(lines, len(T), axis=0)
    return white


@pytest.mark.parametrize(
    ("rate", "order"), [("steady", 300.0), ("varying", 300.0), ("varying", 4000.0), ("to and fro", 40.0)]
)
def test_a_torque_that_is_periodic_in_the_angle_has_its_amplitude_and_order(rate: str, order: float) -> None:
    track = track_of(RATES[rate])
    load = 0.01 * np.sin(2.0 * np.pi * order * track.turns + 1.0)[:, None] + 1e-3 * noise(1, "white", 1)
    spectrum, [(peak, *others)] = found(track, load)
    assert not others
    assert peak.order == pytest.approx(order, abs=0.1 * spectrum.resolution)
    assert abs(peak.amplitude - 0.01) < 0.02 * 0.01 + 3.0 * peak.sigma
    assert peak.sigma < 0.02 * peak.amplitude


def test_its_standard_deviation_is_the_scatter_of_its_amplitude() -> None:
    track = track_of(RATES["varying"])
    load = 0.01 * np.sin(2.0 * np.pi * 300.0 * track.turns)[:, None]
    tops = [found(track, load + 5e-3 * noise(seed, "white", 1))[1][0][0] for seed in range(60)]
    scatter = np.std([peak.amplitude for peak in tops])
    assert np.mean([peak.sigma for peak in tops]) == pytest.approx(scatter, rel=0.25)


def test_a_hum_is_no_order() -> None:
    """At a rate that varies it is smeared; at one that hardly does nobody can say what it is, and that is said."""
    hum = 0.01 * np.sin(2.0 * np.pi * 0.3 * T)[:, None] + 1e-3 * noise(2, "white", 1)
    for rate in ("varying", "many turns"):
        assert found(track_of(RATES[rate]), hum)[1] == [[]]
    for rate in ("steady", "to and fro"):
        _, [tops] = found(track_of(RATES[rate]), hum)
        assert tops and all(peak.fixed for peak in tops)
    track = track_of(RATES["varying"])
    _, [(peak,)] = found(track, hum + 0.01 * np.sin(2.0 * np.pi * 900.0 * track.turns)[:, None])
    assert not peak.fixed and peak.order == pytest.approx(900.0, rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("rate", RATES)
def test_chance_makes_no_peak(rate: str) -> None:
    """The stated rate of false alarms, 1 %, of three channels together: no more than 2 of 60."""
    track = track_of(RATES[rate])
    kinds = ("white", "1/f") if rate == "steady" else ("white", "1/f", "resonance")
    for kind in kinds:
        alarms = sum(any(found(track, noise(seed, kind))[1]) for seed in range(60))
        assert alarms <= 2, kind


def test_only_orders_that_the_samples_show_are_given() -> None:
    track = track_of(RATES["varying"])
    spectrum, _ = found(track, noise(3, "white", 1))
    assert spectrum.order[-1] == pytest.approx(BAND / track.rate.max(), rel=0.01)
    uncertain = track_of(RATES["varying"], sigma=1e-3)
    assert found(uncertain, noise(3, "white", 1))[0].order[-1] == pytest.approx(uncertain.by_angle, rel=0.01)


def test_a_joint_that_hardly_turns_has_no_spectrum() -> None:
    assert length_of(track_of(np.zeros(len(T)))) == 0.0
    assert length_of(track_of(1e-6 * np.sin(T), sigma=1e-4)) == 0.0


def test_no_window_spans_a_gap() -> None:
    track = track_of(RATES["steady"])
    whole = length_of(track)
    track.valid[2000:2040] = False
    assert length_of(track) == pytest.approx(0.5 * whole, rel=0.02)


def test_an_order_stands_upright_in_the_map() -> None:
    track = track_of(RATES["many turns"])
    load = 0.01 * np.sin(2.0 * np.pi * 12.0 * track.turns)[:, None]
    cells = waterfall(track, load, length_of(track), 6)
    assert cells.over == "rate"
    column = np.searchsorted(cells.order, 12.0) - 1
    shown = np.isfinite(cells.amplitude[:, column, 0])
    assert np.count_nonzero(shown) > 3
    np.testing.assert_allclose(np.nanmax(cells.amplitude[shown, column - 1 : column + 2, 0], axis=1), 0.01, rtol=0.1)
    assert not shown[-1] or cells.at[-1] * 12.0 < BAND


def test_a_motion_that_repeats_itself_has_no_rows_of_no_height() -> None:
    """Its windows have the same few rates, apart by rounding."""
    rates = np.repeat([0.05, 0.1, 0.2, 0.4], 1000)
    rates *= 1.0 + 1e-15 * np.random.default_rng(1).integers(-2, 3, len(rates))
    track = track_of(rates)
    cells = waterfall(track, np.zeros((len(T), 1)), 2.0, 12)
    assert len(np.unique(cells.at.astype(np.float32))) == len(cells.at) < 24


def test_time_grows_with_length_alone() -> None:
    """Ten times the recording has ten times the windows, of the same size each."""
    long = track_of(np.tile(RATES["many turns"], 10))
    short = track_of(RATES["many turns"])
    windows = [average(one, np.zeros((len(one.turns), 1)), 2.0) for one in (short, long)]
    assert windows[1].windows == pytest.approx(10 * windows[0].windows, rel=0.1)
    assert len(windows[1].order) == len(windows[0].order)
