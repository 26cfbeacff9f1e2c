"""A corrected model loads at once, with what was left out in its plant."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from campaign.campaign_folder import make_folder
from kbs_process.campaign.config import SensingLaw
from kbs_process.campaign.load import load_campaign
from kbs_process.campaign.mission import load_day
from kbs_process.campaign.writing.corrected_model import write_model
from kbs_process.diagnosis.experiments.hypothesis import Hypothesis
from kbs_process.diagnosis.facts import Estimate, Identity, Place
from kbs_process.errors import ConfigError
from kbs_process.identification.output_error import Scalar
from kbs_process.plant.attach import attach
from kbs_process.plant.laws import select
from kbs_process.reduction.reading_laws import readings
from kbs_process.rig.model import Quantity, substitute
from kbs_process.signals.records import WRENCH_CHANNELS
from kbs_process.studies.diagnose.corrected import write_corrected

CAMPAIGN = Path(__file__).parents[3] / "campaigns" / "EL089"


def test_it_loads_with_the_effect_that_was_found(tmp_path: Path) -> None:
    campaign = load_campaign(CAMPAIGN, checksums=False)
    (harness,) = select(["harness"])
    amplitudes = {entry.name: 0.5 for entry in harness.parameters if entry.role == "amplitude"}
    rig = attach(campaign.rig, harness, amplitudes, joints=["el"])
    changed = {name: entry for name, entry in rig.quantities().items() if entry.value.ndim > 1}
    write_model(campaign, rig, (*campaign.effects, "harness"), changed, tmp_path, "by a test")
    corrected = load_campaign(tmp_path, checksums=False)
    assert set(corrected.effects) == {*campaign.effects, "harness"}
    assert [entry.path.resolve() for entry in corrected.recordings] == [
        entry.path.resolve() for entry in campaign.recordings
    ]
    found, before = corrected.rig.quantities(), rig.quantities()
    assert set(found) == set(before)
    for name in found:
        assert found[name].value.tolist() == before[name].value.tolist(), name


def gain(site: str, value: float) -> SensingLaw:
    return SensingLaw(
        "channel_gain", site, {"gain": Quantity("sensing", np.asarray(value), "1", np.asarray(1e-3), "a test")}
    )


def test_laws_of_sensors_are_written_and_read(tmp_path: Path) -> None:
    campaign = load_campaign(CAMPAIGN, checksums=False)
    write_model(campaign, campaign.rig, campaign.effects, {}, tmp_path, "by a test", [gain("Ty", 0.02)])
    (law,) = load_campaign(tmp_path, checksums=False).sensing
    assert (law.law, law.site, float(law.parameters["gain"])) == ("channel_gain", "Ty", 0.02)


@pytest.mark.parametrize(
    ("law", "message"),
    [
        (gain("Tq", 0.1), "'Tq' is no site of 'channel_gain'"),
        (SensingLaw("drift_linear", "Ty", {}), "'drift_linear' is no law"),
        (SensingLaw("channel_gain", "Ty", {}), "has no 'gain'"),
    ],
)
def test_wrong_laws_of_sensors_are_told(tmp_path: Path, law: SensingLaw, message: str) -> None:
    campaign = load_campaign(CAMPAIGN, checksums=False)
    write_model(campaign, campaign.rig, campaign.effects, {}, tmp_path, "by a test", [law])
    with pytest.raises(ConfigError, match=message):
        load_campaign(tmp_path, checksums=False)


def test_readings_are_what_the_laws_make_of_a_prediction() -> None:
    rig = load_campaign(CAMPAIGN, checksums=False).rig
    t = np.arange(400) / 20.0
    wrench = np.outer(np.sin(t), np.arange(1.0, 7.0))
    read = readings([gain("Ty", 0.02)], "wrench", WRENCH_CHANNELS, t, wrench, rig, None)
    expected = wrench.copy()
    expected[:, 4] *= 1.02
    np.testing.assert_allclose(read, expected)
    angle = wrench[:, :2]
    np.testing.assert_array_equal(readings([gain("Ty", 0.02)], "angle", rig.joint_names, t, angle, rig, None), angle)


def test_a_diagnosis_that_went_round_a_phase_and_found_a_gain_leaves_a_model_that_loads(tmp_path: Path) -> None:
    campaign = load_campaign(CAMPAIGN, checksums=False)
    phase, name = "joint.el.drive.phi_stat", "law.channel_gain.Ty.gain"
    rig = substitute(campaign.rig, {phase: 7.0})
    known = SimpleNamespace(
        experiment=SimpleNamespace(trials=(SimpleNamespace(name="a"),), fit=(0,)),
        hypothesis=Hypothesis(rig, campaign.effects),
        free=(Scalar(phase), Scalar(name)),
        value=np.array([7.0, 0.03]),
        sigma=np.array([0.1, 0.002]),
    )
    standing = SimpleNamespace(known=known, hypothesis=known.hypothesis, laws={name: {}})
    found = SimpleNamespace(
        identity=Identity(Place("transducer", "", ("Ty",)), "gain", "channel_gain"),
        actions=((Estimate("gain", "1", 0.03, 0.002),),),
    )
    outcome = SimpleNamespace(standing=standing, finds=(found,))
    write_corrected(campaign, outcome, tmp_path / "corrected")  # type: ignore[arg-type]
    corrected = load_campaign(tmp_path / "corrected", checksums=False)
    quantity = corrected.rig.quantities()[phase]
    assert float(quantity) == pytest.approx(7.0 - 2.0 * np.pi)
    assert float(quantity.sigma) == 0.1
    (law,) = corrected.sensing
    assert float(law.parameters["gain"]) == 0.03
    assert float(law.parameters["gain"].sigma) == 0.002


def test_it_is_whole_wherever_it_is_taken(tmp_path: Path) -> None:
    """Matrices in CSV files, the flight model's files and a mission come with it; the campaign may be gone."""
    folder = make_folder(tmp_path / "campaigns" / "EL089")
    (folder.path / "tilt.csv").write_text("0.5, -0.25\n")
    folder.replace("parameters/rig.toml", "tilt = { value = [0.0, 0.0]", 'tilt = { value = "tilt.csv"')
    (folder.path / "parameters" / "orbit").mkdir()
    shutil.copy(folder.path / "parameters" / "flight.toml", folder.path / "parameters" / "orbit")
    (folder.path / "orbit.csv").write_text("0.125, -0.375\n")
    folder.append(
        "parameters/orbit/flight.toml",
        '[transducer]\ntilt = { value = "orbit.csv", unit = "mrad", sigma = 1.0, source = "a test" }\n',
    )
    both = 'substitute = ["parameters/flight.toml", "parameters/orbit/flight.toml"]'
    folder.replace("campaign.toml", 'substitute = ["parameters/flight.toml"]', both)
    shutil.copy(CAMPAIGN.parent / "REFDAY" / "mission.toml", folder.path / "day.toml")
    folder.append("campaign.toml", '\n[mission]\nfile = "day.toml"\n')

    campaign = load_campaign(folder.path)
    files = write_model(campaign, campaign.rig, campaign.effects, {}, tmp_path / "made", "by a test")
    assert all(path.is_file() and path.is_relative_to(tmp_path / "made") for path in files)
    shutil.move(tmp_path / "made", tmp_path / "far" / "away" / "corrected")
    shutil.rmtree(folder.path)

    moved = load_campaign(tmp_path / "far" / "away" / "corrected", recordings=False)
    assert moved.rig.transducer.tilt.value.tolist() == [5e-4, -2.5e-4]
    flown = load_campaign(tmp_path / "far" / "away" / "corrected", flight=True, recordings=False)
    assert flown.rig.transducer.tilt.value.tolist() == [1.25e-4, -3.75e-4]
    assert load_day(moved).mission.duration > 0.0
    with pytest.raises(ConfigError, match=r"AZPS_ATA\.mcap"):
        load_campaign(tmp_path / "far" / "away" / "corrected")


def test_modes_of_the_nominal_model_are_no_parameter_file_of_the_corrected_one(tmp_path: Path) -> None:
    campaign, modes = load_campaign(CAMPAIGN, checksums=False), tmp_path / "modes.toml"
    modes.write_text('joint = "el"\n')
    with_modes = replace(campaign, modal=modes, inputs=(*campaign.inputs, modes))
    write_model(with_modes, campaign.rig, campaign.effects, {}, tmp_path / "made", "by a test")
    assert load_campaign(tmp_path / "made", checksums=False).modal is None
    assert not (tmp_path / "made" / "parameters" / "modes.toml").exists()
