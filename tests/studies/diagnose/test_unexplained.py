"""What is left, as requirements count it: statistic, band, frame, and which recordings."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import archived
from diagnosis import bench
from kbs_process.campaign.config import Requirement
from kbs_process.diagnosis.experiments.experiment import Experiment
from kbs_process.signals.records import Array
from kbs_process.studies.diagnose.unexplained import unexplained

pytestmark = pytest.mark.slow

SECONDS = 120.0
PEAK = Requirement("peak at T", "torque", "T", "peak", 0.1, "N m", (0.01, 1.0), "here")


@pytest.fixture(scope="module")
def made() -> Experiment:
    """Recordings of nothing at all."""
    whole = bench.experiment(bench.rig(), ("fit", "held-out"), 11, SECONDS)
    return replace(whole, trials=tuple(replace(one, measured=0.0 * one.measured) for one in whole.trials))


def predicted(*left: Array) -> list[Array]:
    """What a model predicts of each recording that leaves these wrenches (n, 6)."""
    return [-np.pad(wrench, ((0, 0), (0, 2))) for wrench in left]


def wave(f: float, amplitude: float, channel: int, made: Experiment) -> Array:
    """(n, 6)."""
    t = made.dt * np.arange(made.drives[0].n)
    wrench = np.zeros((len(t), 6))
    wrench[:, channel] = amplitude * np.sin(2.0 * np.pi * f * t)
    return wrench


def test_a_wave_in_the_band_counts_by_its_peak_and_its_rms(made: Experiment) -> None:
    campaign = archived.campaign("EL089", recordings=False)
    both = [PEAK, replace(PEAK, name="rms at T", statistic="rms")]
    campaign = replace(campaign, requirements=tuple(both))
    nothing = predicted(*[wave(0.2, 0.0, 4, made)] * 2)
    whole = predicted(*[wave(0.2, 0.02, 4, made)] * 2)
    peak, rms = unexplained(campaign, made, whole, nothing)
    assert (peak.known, rms.known) == pytest.approx((0.02, 0.02 / np.sqrt(2.0)), rel=0.05)
    assert peak.corrected == pytest.approx(0.0, abs=1e-12) and peak.share == pytest.approx(0.0, abs=1e-10)
    (peak, _) = unexplained(campaign, made, nothing, whole)
    assert (peak.channel, peak.recording) == ("Ty", "r0") and peak.share == pytest.approx(0.2, rel=0.05)


def test_the_worst_recording_counts_and_what_is_out_of_the_band_does_not(made: Experiment) -> None:
    campaign = replace(archived.campaign("EL089", recordings=False), requirements=(PEAK,))
    nothing = predicted(*[wave(0.2, 0.0, 4, made)] * 2)
    (one,) = unexplained(campaign, made, nothing, predicted(*[wave(6.0, 0.02, 4, made)] * 2))
    assert one.corrected < 1e-4
    opposed = predicted(wave(0.2, 0.01, 4, made), wave(0.2, -0.02, 4, made))
    (one,) = unexplained(campaign, made, nothing, opposed)
    assert one.corrected == pytest.approx(0.02, rel=0.05) and one.recording == "r1"


def test_calibrations_and_what_was_not_recorded_are_judged_by_none(made: Experiment) -> None:
    campaign = archived.campaign("EL089", recordings=False)
    strange = replace(PEAK, name="forces of a joint", frame="nowhere")
    campaign = replace(campaign, requirements=(strange, PEAK))
    nothing = predicted(*[wave(0.2, 0.0, 4, made)] * 2)
    loud = predicted(wave(0.2, 0.02, 4, made), wave(0.2, 0.0, 4, made))
    trials = (replace(made.trials[0], role="calibration"), *made.trials[1:])
    (one,) = unexplained(campaign, replace(made, trials=trials), nothing, loud)
    assert one.name == PEAK.name and one.corrected < 1e-9


def test_a_force_is_a_torque_at_the_spacecraft(made: Experiment) -> None:
    campaign = archived.campaign("EL089", recordings=False)
    spacecraft = campaign.rig.spacecraft
    assert spacecraft is not None
    campaign = replace(campaign, requirements=(PEAK, replace(PEAK, frame="S")))
    nothing = predicted(*[wave(0.2, 0.0, 0, made)] * 2)
    pushed = predicted(*[wave(0.2, 1.0, 0, made)] * 2)
    at_transducer, at_spacecraft = unexplained(campaign, made, nothing, pushed)
    assert at_transducer.corrected < 1e-9
    # The greatest part of p x F that one axis of S sees is no more than the whole, and no less than it over root three.
    lever = float(np.linalg.norm(np.cross(spacecraft.position.value, [1.0, 0.0, 0.0])))
    assert lever / np.sqrt(3.0) < at_spacecraft.corrected < 1.05 * lever
