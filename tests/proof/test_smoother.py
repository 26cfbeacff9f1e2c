"""The smoother's parts against closed forms, and a null that it fits from a cold start."""

from __future__ import annotations

import tarfile
from pathlib import Path

import numpy as np
import pytest

from kbs_process.campaign.load import load_campaign
from kbs_process.plant.rigid import static_wrench
from kbs_process.progress import SilentProgress
from kbs_process.studies.diagnose.reading import experiment_of
from proof.rivals.smoother.balance import FIRST_JOINT, FLOOR, PLATE, needed
from proof.rivals.smoother.fit import State, descend
from proof.rivals.smoother.problem import Problem
from proof.rivals.smoother.solve import LOOSE, _forces
from proof.rivals.smoother.splines import Splines

pytestmark = pytest.mark.slow

CAMPAIGN = Path(__file__).parents[2] / "campaigns" / "EL089"
NULL = Path(__file__).with_name("small") / "T00000000A1.tar"


def test_splines_give_values_rates_and_accelerations() -> None:
    dt, n = 0.05, 200
    t = dt * np.arange(n)
    splines = Splines(n, dt)
    values, rates, accelerations = splines.motion(splines.fitted(np.stack([np.sin(t), t**2], axis=1)))
    inside = slice(30, -30)
    for found, expected in (
        (values, [np.sin(t), t**2]),
        (rates, [np.cos(t), 2 * t]),
        (accelerations, [-np.sin(t), 2 + 0 * t]),
    ):
        assert found[inside] == pytest.approx(np.stack(expected, axis=1)[inside], abs=2e-4)


def test_what_a_motion_needs_is_the_sagged_weight_and_what_the_floor_adds() -> None:
    rig = load_campaign(CAMPAIGN, checksums=False).rig
    assert rig.transducer.stiffness is not None
    q = np.radians([[10.0, 75.0], [-30.0, 82.0]])
    still, x = np.zeros((2, FIRST_JOINT + 2)), np.zeros((2, FIRST_JOINT + 2))
    x[:, FIRST_JOINT:] = q
    for _ in range(4):
        wrench, efforts = needed(rig, (x, still, still))
        x[:, PLATE] = -efforts[:, :3] / rig.transducer.stiffness.value
    assert wrench == pytest.approx(static_wrench(rig, q), abs=1e-4)
    # The mounting carries what the transducer feels, about axes that the plate's small angles hardly turn.
    assert -efforts[:, :3] == pytest.approx(wrench[:, 3:], abs=0.05)
    raised = x.copy()
    raised[:, FLOOR] = [0.0, 0.0, 0.1]
    heavier, _ = needed(rig, (raised, still, still))
    assert heavier[:, 2] / wrench[:, 2] == pytest.approx(1 + 0.1 / float(rig.gravity), rel=1e-4)


def test_a_null_is_fitted_to_its_noise_from_a_cold_start(tmp_path: Path) -> None:
    with tarfile.open(NULL) as archive:
        archive.extractall(tmp_path / "T", filter="data")
    experiment = experiment_of(load_campaign(tmp_path / "T", checksums=False), SilentProgress())
    problem = Problem(experiment, [1])
    state = State.of(problem, _forces(problem, LOOSE))
    cold = state.cost(problem)
    descend(problem, state, 2, ~problem.scaling)
    numbers = problem.recordings[0].weight.sum() * problem.independent * problem.rows
    assert cold > 1e3 * numbers
    assert state.cost(problem) < 0.5 * numbers  # forces this loose follow some of the noise
    assert np.abs(state.x - problem.prior)[problem.of_rig].max() < 10.0
