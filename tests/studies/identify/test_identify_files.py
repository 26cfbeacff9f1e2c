"""What an identification writes: results that load, a page, and parameter files that the campaign takes at once."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from kbs_process.campaign.load import load_campaign
from kbs_process.estimation.fit import Check, Fit
from kbs_process.estimation.linearise import Unpredicted
from kbs_process.estimation.profile import Profile
from kbs_process.identification.estimate import Identification, Settings
from kbs_process.identification.output_error import Experiment, sensor_spectra
from kbs_process.identification.unknowns import frictions, gearbox, prior, with_factors
from kbs_process.reduction.reading import read_run
from kbs_process.results.records import load
from kbs_process.studies.identify.files import PARAMETERS, write_identification
from kbs_process.studies.identify.findings import Outcomes, Prediction
from kbs_process.studies.identify.measured import measured
from kbs_process.studies.identify.results import IdentifyResults

pytestmark = pytest.mark.slow

DUMMY1 = Path(__file__).parents[3] / "campaigns" / "DUMMY1"


def test_folder(tmp_path: Path) -> None:
    campaign = load_campaign(DUMMY1, checksums=False)
    full = replace(campaign, bands=replace(campaign.bands, working_rate=100.0))
    recording = measured(read_run(full, replace(campaign.recordings[0], end=12.0)), campaign.rig)
    setting = Experiment(campaign.rig, campaign.effects, gearbox(campaign.rig, campaign.effects), (recording,), 0.05)
    parameters = with_factors(prior(setting), setting, 0.02)
    names = parameters.names
    assert len(names) == len(setting.free) + len(frictions(setting))
    value = parameters.value.copy()
    at, phase = names.index("joint.el.drive.Ka"), names.index("joint.el.drive.phi_cog")
    value[at], value[phase] = 10321.0, 4.0
    sigma = np.where(np.isfinite(parameters.sigma), 0.1 * parameters.sigma, 0.01)
    fit = Fit(
        names,
        value,
        sigma,
        np.diag(sigma**2),
        parameters.sigma,
        (Check("converged", True, "3"),),
        1.0,
        9,
        0 * value,
        np.diag(sigma**2),
    )
    noise = sensor_spectra(setting, recording)
    found = Identification(
        setting, fit, np.zeros((9, len(names))), (noise,), (), Unpredicted(np.zeros((9, 2))), (), parameters
    )
    x = value[at] + sigma[at] * np.array([-2.0, 0.0, 2.0])
    profile = Profile("joint.el.drive.Ka", x, np.array([4.0, 0.0, 4.0]), float(x[0]), float(x[2]))
    shape = (len(recording.valid), len(setting.channels))
    after = np.random.default_rng(1).standard_normal(shape) * 1e-3
    outcomes = Outcomes(found, Settings(), (profile,), (Prediction(recording, "held-out", noise, 10.0 * after, after),))
    target = tmp_path / "results"
    told = write_identification(campaign, outcomes, target, False)
    assert told.report.is_file()
    results = load(target, IdentifyResults)
    wrapped = next(one for one in results.parameters if one.name == names[phase])
    assert abs(wrapped.value - (4.0 - 2.0 * np.pi)) < 1e-12
    assert all(0.05 < misfit.after / misfit.before < 0.2 for misfit in results.misfits)
    folder = tmp_path / "DUMMY1"
    shutil.copytree(DUMMY1, folder)
    shutil.copytree(target / PARAMETERS, folder / "parameters", dirs_exist_ok=True)
    stiffness = load_campaign(folder, checksums=False).rig.quantities()["joint.el.drive.Ka"]
    assert (float(stiffness.value), float(stiffness.sigma)) == (10321.0, sigma[at])
    assert stiffness.source == f"identified from {recording.name}"
