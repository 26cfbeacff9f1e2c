"""Figures of merit have the values that their definitions give on signals with known answers."""

import numpy as np
import pytest

from kbs_process.errors import RecordingError
from kbs_process.signals.grid import overlap
from kbs_process.signals.records import Signal
from kbs_process.stages.compare import compare


def signal(values: np.ndarray, t0: float = 0.0, dt: float = 0.05, valid: np.ndarray | None = None) -> Signal:
    values = np.atleast_2d(values.T).T
    return Signal(
        t0=t0,
        dt=dt,
        values=values,
        channels=("Tx",),
        units=("N m",),
        frame="T",
        valid=np.ones(len(values), dtype=bool) if valid is None else valid,
    )


T = 0.05 * np.arange(4000)
TONE = np.sin(2 * np.pi * 0.3 * T)


def test_a_perfect_prediction():
    (merit,) = compare(signal(TONE), signal(TONE), (0.01, 1.0))
    assert merit.correlation == pytest.approx(1.0)
    assert merit.fraction_of_variance == pytest.approx(1.0)
    assert merit.residual_rms == 0.0
    assert merit.spectral_ratio == pytest.approx(1.0)
    assert merit.measured_rms == pytest.approx(np.sqrt(0.5), rel=1e-6)


def test_twice_the_size_is_pessimistic_by_two_and_explains_nothing():
    (merit,) = compare(signal(TONE), signal(2 * TONE), (0.01, 1.0))
    assert merit.pessimism == pytest.approx(2.0)
    assert merit.spectral_ratio == pytest.approx(4.0)
    assert merit.correlation == pytest.approx(1.0)
    assert merit.fraction_of_variance == pytest.approx(0.0, abs=1e-9)


def test_quadrature_is_uncorrelated_and_worse_than_nothing():
    (merit,) = compare(signal(TONE), signal(np.cos(2 * np.pi * 0.3 * T)), (0.01, 1.0))
    assert merit.correlation == pytest.approx(0.0, abs=1e-9)
    assert merit.fraction_of_variance == pytest.approx(-1.0, abs=1e-6)


def test_invalid_samples_do_not_count():
    valid = np.ones(len(T), dtype=bool)
    valid[100:200] = False
    spoiled = TONE.copy()
    spoiled[100:200] = 1e3
    (merit,) = compare(signal(spoiled, valid=valid), signal(TONE), (0.01, 1.0))
    assert merit.residual_rms == 0.0
    assert merit.measured_peak <= 1.0


def test_only_common_time_is_compared():
    late = signal(TONE[40:], t0=2.0)
    early = signal(TONE[:-40])
    a, b = overlap(early, late)
    assert a.t0 == b.t0 == 2.0
    assert len(a) == len(b) == len(T) - 80
    np.testing.assert_array_equal(a.values, b.values)


def test_a_silent_channel_has_no_correlation():
    (merit,) = compare(signal(np.zeros_like(TONE)), signal(TONE), (0.01, 1.0))
    assert merit.correlation is None
    assert merit.fraction_of_variance is None
    assert merit.pessimism is None


@pytest.mark.parametrize("other", [signal(TONE, t0=0.02), signal(TONE, dt=0.06), signal(TONE, t0=1e4)])
def test_signals_off_the_grid_are_refused(other: Signal):
    with pytest.raises(RecordingError):
        overlap(signal(TONE), other)
