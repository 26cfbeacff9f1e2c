"""Every entry of the uncertainty budget is the rms of an error that can be simulated."""

import numpy as np
import pytest

from kbs_process.signals.records import WRENCH_CHANNELS, WRENCH_UNITS, Signal
from kbs_process.stages import budget
from kbs_process.stages.bandpass import Band, apply, noise_bandwidth, statement

DT = 0.05


@pytest.fixture
def rng() -> np.random.Generator:
    """Begins anew in every test, so that none depends on which ran before."""
    return np.random.default_rng(20)


def signal(values: np.ndarray) -> Signal:
    return Signal(0.0, DT, values, WRENCH_CHANNELS, WRENCH_UNITS, "T", np.ones(len(values), dtype=bool))


def cut(one: Signal) -> Signal:
    return apply(one, Band("lt1Hz", 0.01, 1.0))


def test_sensor_noise_within_a_band(rng):
    rate, sigma = 20.0, np.array([0.02] * 3 + [0.002] * 3)
    noise = signal(rng.normal(size=(200_000, 6)) * sigma)
    bandwidth = noise_bandwidth(Band("lt1Hz", 0.01, 1.0), DT)
    assert 0.8 < bandwidth < 1.0  # a filter run both ways passes less than the rectangle of its half-gain limits
    entry = budget.sensor_noise(sigma, rate, bandwidth)
    np.testing.assert_allclose(budget.rms(cut(noise)), entry.sigma, rtol=0.02)


def test_cross_coupling_error(rng):
    wrench = signal(rng.normal(size=(3000, 6)) * [1.0, 2.0, 0.5, 0.1, 0.2, 0.3])
    sigma = np.abs(rng.normal(size=(6, 6))) * 1e-3
    squares = np.zeros(6)
    for _ in range(800):
        squares += np.mean((wrench.values @ (rng.normal(size=(6, 6)) * sigma).T) ** 2, axis=0) / 800
    np.testing.assert_allclose(budget.cross_coupling(wrench, sigma).sigma, np.sqrt(squares), rtol=0.1)


def test_shapes_add_in_quadrature_within_the_band():
    t = DT * np.arange(40_000)
    inside = np.zeros((len(t), 6))
    inside[:, 0] = 3.0 * np.sqrt(2.0) * np.sin(2 * np.pi * 0.2 * t)
    outside = np.zeros((len(t), 6))
    outside[:, 0] = 100.0 * np.sin(2 * np.pi * 5.0 * t)
    other = np.zeros((len(t), 6))
    other[:, 0] = 4.0 * np.sqrt(2.0) * np.sin(2 * np.pi * 0.31 * t)
    entry = budget.from_shapes("s", "x", [signal(inside), signal(outside), signal(other)], cut)
    assert entry.sigma[0] == pytest.approx(5.0, rel=5e-3)
    assert not entry.sigma[1:].any()


def test_a_late_clock_errs_by_the_slope():
    t = DT * np.arange(8000)
    wave = np.zeros((len(t), 6))
    wave[:, 4] = np.sin(2 * np.pi * 0.1 * t)
    late = np.zeros((len(t), 6))
    late[:, 4] = np.sin(2 * np.pi * 0.1 * (t - 1e-3))
    entry = budget.clock(signal(wave), 1e-3, cut)
    assert entry.sigma[4] == pytest.approx(budget.rms(cut(signal(late - wave)))[4], rel=0.01)


def test_repeats_count_only_beyond_what_is_explained():
    excess = budget.repeatability(np.array([5.0, 3.0]), np.array([4.0, 3.5])).sigma
    np.testing.assert_allclose(excess, [3.0, 0.0])


@pytest.mark.parametrize(("frequency", "gain"), [(10.0, 1 / 99), (2.0, 1 / 3), (1.0, 1.0), (0.5, 1.0)])
def test_a_resonance_amplifies_what_lies_below_it(frequency: float, gain: float):
    wave = signal(np.ones((100, 6)))
    np.testing.assert_allclose(budget.resonance(wave, frequency, (0.01, 1.0)).sigma, gain)


def test_without_a_resonance_there_is_no_amplification():
    assert not budget.resonance(signal(np.ones((100, 6))), None, (0.01, 1.0)).sigma.any()


def test_neither_rest_nor_motion_makes_the_other_better_known():
    t = DT * np.arange(8000)
    moving = t > 300.0
    burst = np.zeros((len(t), 6))
    burst[moving, 0] = np.sin(2 * np.pi * 0.2 * t[moving])
    rest = signal(burst * [1, 0, 0, 0, 0, 0] + [0.0, 1.0, 0.0, 0.0, 0.0, 0.0])
    assert budget.rms(rest)[0] == pytest.approx(0.5 * budget.rms(rest, moving)[0], rel=0.01)
    assert budget.rms(rest, moving)[1] == pytest.approx(1.0)  # what is as large at rest is not lost
    entry = budget.from_shapes("s", "x", [rest, rest], lambda one: one, moving)
    np.testing.assert_allclose(entry.sigma, np.sqrt(2.0) * budget.rms(rest, moving))
    np.testing.assert_allclose(budget.rms(rest, np.zeros(len(t), dtype=bool)), budget.rms(rest))


def test_ends_err_by_what_drifts_and_by_what_is_flat(rng):
    band, n, runs = Band("lt1Hz", 0.01, 1.0), 4000, 20
    stated = statement(band, DT, n)
    for integrated, share in ((False, 0.0), (True, 1.0)):
        errors, budgeted, parts = np.zeros(6), np.zeros(6), np.zeros(6)
        for _ in range(runs):
            x = rng.normal(size=(3 * n, 6))
            whole = signal(np.cumsum(x, axis=0) if integrated else x)
            known = cut(signal(whole.values[n : 2 * n]))
            part = budget.drifting_part(known, band)
            entries = budget.filter_edges(known, stated.edge_error, stated.edge_error_drift, part)
            wrong = known.derive(known.values - cut(whole).values[n : 2 * n], "error")
            errors += budget.rms(wrong) ** 2
            budgeted += budget.total(entries) ** 2
            parts += part / runs
        assert parts == pytest.approx(share, abs=0.2)  # every channel: 0.82 to 0.97 over seeds
        assert np.sqrt(errors.sum() / budgeted.sum()) == pytest.approx(1.0, abs=0.3)


def test_the_total_is_the_root_of_the_sum_of_squares():
    entries = [budget.Entry("a", "", np.array([3.0, 0.0])), budget.Entry("b", "", np.array([4.0, 1.0]))]
    np.testing.assert_allclose(budget.total(entries), [5.0, 1.0])
