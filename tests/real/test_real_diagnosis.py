"""Two rigs of others, diagnosed: what their nominal models leave out is found, and predicts recordings set apart.

Known figures as in `test_real_efforts`: plain least squares of as many laws, trained and tested on the same recordings.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt

from kbs_process.campaign.load import load_campaign
from kbs_process.diagnosis.acceptance.outcome import Outcome
from kbs_process.diagnosis.selection.explain import explain
from kbs_process.diagnosis.selection.rounds import diagnose
from kbs_process.progress import SilentProgress
from kbs_process.signals.records import Array
from kbs_process.studies.convert.run import import_recordings
from kbs_process.studies.diagnose.reading import experiment_of
from kbs_process.studies.diagnose.simulators import simulating
from real.campaigns import sampling_error
from real.test_real_efforts import EMPS, EMPS_S, ODRIVE
from stages.gravity.real_sets import DATA

pytestmark = [
    pytest.mark.validation,
    pytest.mark.skipif(
        not (DATA / "emps").is_dir() or not (DATA / "odrive_cogging").is_dir(),
        reason="real recordings (../shared/data) are not here",
    ),
]
BAND_HZ = 20.0  # in which a residual is scored


def diagnosed(preset: str, source: Path, folder: Path) -> Outcome:
    """The campaign of a preset through import, refit and search."""
    progress = SilentProgress()
    campaign = load_campaign(import_recordings(preset, source, folder))
    experiment = experiment_of(campaign, progress)
    with simulating(experiment) as simulate:
        found = explain(experiment, simulate, progress.task)
        return diagnose(found.known, found.floor, simulate, found.after, found.near)


def left(outcome: Outcome) -> tuple[Array, Array]:
    """Standard deviations of what the nominal model's and the corrected model's predictions leave, held out."""
    known, standing = outcome.known, outcome.standing
    experiment = known.experiment
    rows = []
    for k in experiment.held_out:
        trial = experiment.trials[k]
        shown = known.shown[trial.drive].values, standing.shown(k)
        low = butter(2, 2.0 * BAND_HZ * experiment.dt, output="sos")
        rows.append([float(np.std(sosfiltfilt(low, trial.measured - one, axis=0)[trial.valid, 0])) for one in shown])
    before, after = np.array(rows).T
    return before, after


def test_cogging_is_named_by_its_orders_and_predicts_other_runs(tmp_path: Path) -> None:
    outcome = diagnosed("odrive", DATA / "odrive_cogging", tmp_path / "odrive")
    first = outcome.finds[0]
    orders = [one.value for one in first.estimates if one.unit == "1"]
    before, after = left(outcome)
    print(f"\nODrive: {[find.identity.law for find in outcome.finds]}, orders {orders}")
    print(f"  below {BAND_HZ:g} Hz: {np.round(before, 3)} -> {np.round(after, 3)} A; known {ODRIVE[12]}")
    assert (first.identity.place.port, first.identity.place.site) == ("motor torque", "motor")
    assert first.identity.family == "motor order"
    assert 7.0 in orders  # pole pairs
    assert 12.0 in orders  # slots
    assert before.min() > 0.95 * ODRIVE[0]
    assert after.max() <= ODRIVE[12]


def test_friction_is_named_and_predicts_a_run_with_pulses(tmp_path: Path) -> None:
    outcome = diagnosed("emps", DATA / "emps", tmp_path / "emps")
    first = outcome.finds[0]
    before, after = left(outcome)
    print(f"\nEMPS: {[find.identity.law for find in outcome.finds]}: {first.estimates}")
    print(f"  below {BAND_HZ:g} Hz: {np.round(before, 2)} -> {np.round(after, 2)} N; known {EMPS[3]}")
    assert (first.identity.place.port, first.identity.place.site) == ("joint torque", "axis")
    assert first.identity.family == "friction"
    assert first.estimates[0].value == pytest.approx(20.3935, abs=0.5)  # N, as published
    assert before.min() > 0.9 * EMPS[0]
    assert after.max() <= EMPS[3] * (1 + 0.5 * sampling_error(BAND_HZ, EMPS_S))
