"""Signal and noise of repeats, unbiased and with an interval that covers."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt

from kbs_process.errors import RecordingError
from kbs_process.signals.records import Signal
from kbs_process.stages.repeatability import fit, on_common_axis

DT = 0.05


def repeats(count: int, n: int, noise: float, seed: int, amplitude: float = 0.03) -> list[Signal]:
    rng = np.random.default_rng(seed)
    t = DT * np.arange(n)
    common = amplitude * np.column_stack((np.sin(2.0 * np.pi * 0.2 * t), np.sin(2.0 * np.pi * 0.7 * t)))
    sos = butter(4, 1.0, output="sos", fs=1.0 / DT)
    out = []
    for _ in range(count):
        e = sosfiltfilt(sos, rng.normal(size=(n + 400, 2)), axis=0)[200:-200]
        e *= noise / 0.30  # rms of white noise below 1 Hz at 20 Hz
        out.append(Signal(0.0, DT, common + e, ("Tx", "Ty"), ("N m", "N m"), "T", np.ones(n, dtype=bool)))
    return out


def test_signal_and_noise_are_recovered() -> None:
    found = [fit(repeats(3, 4000, 0.01, seed)) for seed in range(20)]
    assert np.mean([r.signal for r in found]) == pytest.approx(0.03 / np.sqrt(2.0), rel=0.01)
    # The filtered noise's true rms, from a long record:
    long = repeats(2, 400_000, 0.01, 99, amplitude=0.0)
    truth = long[0].values.std()
    assert np.mean([r.noise for r in found]) == pytest.approx(truth, rel=0.02)
    covered = [np.mean((r.noise_low < truth) & (truth < r.noise_high)) for r in found]
    assert 0.85 <= np.mean(covered) <= 1.0
    spread = np.std([r.noise for r in found], axis=0).mean() / truth
    width = np.mean([(r.noise_high - r.noise_low) / (2.0 * 1.96) for r in found]) / truth
    assert width == pytest.approx(spread, rel=0.4)  # the interval is as wide as the scatter, not wider
    np.testing.assert_allclose(found[0].ratio, found[0].signal / found[0].noise)


def test_without_a_signal_there_is_none() -> None:
    result = fit(repeats(3, 4000, 0.01, 7, amplitude=0.0))
    assert np.all(result.signal < 0.3 * result.noise)


def test_identical_repeats_have_no_noise() -> None:
    one = repeats(1, 1000, 0.0, 1)[0]
    result = fit([one, one])
    assert np.all(result.noise == 0.0) and np.all(np.isinf(result.ratio))


def test_different_lengths_are_cut_and_flagged_samples_left_out() -> None:
    a, b = repeats(2, 4000, 0.01, 3)
    b.values[100:200] = 1e3
    b.valid[100:200] = False
    result = fit([a, b.derive(b.values, "same")])
    short = Signal(0.0, DT, b.values[:3000], b.channels, b.units, "T", b.valid[:3000])
    assert result.samples == 3900 and fit([a, short]).samples == 2900
    assert np.all(result.noise < 0.02)


def test_repeats_are_laid_on_each_other() -> None:
    t = DT * np.arange(2000)
    starts = [10.0, 12.34, 7.0]
    waves = [np.sin(2.0 * np.pi * 0.4 * (t - start))[:, None] for start in starts]
    runs = [Signal(0.0, DT, wave, ("Ty",), ("N m",), "T", np.ones(2000, dtype=bool)) for wave in waves]
    aligned = on_common_axis(runs, starts)
    assert len({(run.t0, len(run)) for run in aligned}) == 1
    assert aligned[0].t0 == pytest.approx(3.0)
    result = fit(aligned)
    assert result.noise[0] < 1e-4 * result.signal[0]


def test_repeats_that_cannot_be_compared_are_refused() -> None:
    a, b = repeats(2, 500, 0.01, 3)
    with pytest.raises(RecordingError, match="two repeats"):
        fit([a])
    with pytest.raises(RecordingError, match="differ"):
        fit([a, Signal(1.0, DT, b.values, b.channels, b.units, "T", b.valid)])
    with pytest.raises(RecordingError, match="no valid sample"):
        fit([a, b.derive(b.values, "lost", valid=np.zeros(500, dtype=bool))])
