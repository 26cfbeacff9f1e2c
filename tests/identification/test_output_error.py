"""The plant explains the archived sweeps of configuration 1 to the noise with the true numbers, and only with them."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from kbs_process.campaign.config import Campaign
from kbs_process.campaign.load import load_campaign
from kbs_process.identification.output_error import Experiment, residual, sensor_spectra
from kbs_process.identification.screening import match_resonances, phases
from kbs_process.identification.unknowns import frictions, gearbox, others, prior
from kbs_process.reduction.reading import read_run
from kbs_process.studies.identify.measured import measured

pytestmark = pytest.mark.slow

TESTS = Path(__file__).parents[1]
STEP = 5e-4  # s


@pytest.fixture(scope="module")
def campaign() -> Campaign:
    return load_campaign(TESTS.parent / "campaigns" / "DUMMY1", checksums=False)


@pytest.fixture(scope="module")
def sweep(campaign: Campaign) -> Experiment:
    full = replace(campaign, bands=replace(campaign.bands, working_rate=100.0))
    recording = measured(read_run(full, replace(campaign.recordings[0], end=40.0)), campaign.rig)
    gears = gearbox(campaign.rig, campaign.effects)
    free = (*gears, *others(campaign.rig, gears))
    return Experiment(campaign.rig, campaign.effects, free, (recording,), 0.05, STEP)


@pytest.fixture(scope="module")
def truth(sweep: Experiment) -> np.ndarray:
    """The run's own hardware, which nothing of the pipeline reads."""
    told = json.loads((TESTS / "archive" / "truth" / "DUMMY1.json").read_text())
    values = told["hardware"] | told["recordings"][0]["hardware_in_this_run"]
    return np.array([np.asarray(values[scalar.quantity])[scalar.element] for scalar in sweep.free])


def test_true_numbers_leave_noise_and_nominal_ones_do_not(sweep: Experiment, truth: np.ndarray) -> None:
    recording = sweep.recordings[0]
    noise = sensor_spectra(sweep, recording)
    right, nominal = (residual(sweep, recording, values, noise) for values in (truth, sweep.nominal))
    assert np.mean(right**2) == pytest.approx(1.0, abs=0.06)
    assert np.mean(nominal**2) > 2.0


def test_resonances_are_matched_whatever_the_phases(sweep: Experiment, truth: np.ndarray) -> None:
    """From a stiffness 8 % off, with all phases wrong, the effective one comes out to 2 %."""
    names = [scalar.name for scalar in sweep.free]
    stiff = names.index("transducer.stiffness[1]")
    begin = truth.copy()
    begin[stiff] *= 1.08
    for phase in phases(sweep.rig, sweep.effects, sweep.free):
        begin[phase.phase] += 2.0
    found = match_resonances(sweep, begin, [sensor_spectra(sweep, sweep.recordings[0])])
    assert found[stiff] == pytest.approx(truth[stiff], rel=0.02)


def test_what_is_free_and_what_is_known_of_it(sweep: Experiment) -> None:
    names = [scalar.name for scalar in sweep.free]
    known = prior(sweep)
    assert "joint.az.drive.Kangle" not in names  # exact by definition
    for phase in phases(sweep.rig, sweep.effects, sweep.free):
        assert np.isinf(known.sigma[phase.phase])
        pair = (names[phase.amplitude].rpartition(".")[2], names[phase.phase].rpartition(".")[2])
        assert pair in {("tcog", "phi_cog"), ("d1", "phi_dyn"), ("Ts0", "phi_stat")}
        assert phase.smooth == (pair[0] != "Ts0")
    assert {names[index].rpartition(".")[2] for index in frictions(sweep)} == {"b_m", "d0", "d1", "Ts0"}
