"""A mass on two joints, driven by its motion: fitted numbers are as far off as they say, at any rate and speed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from kbs_process.rig.model import Rig
from kbs_process.signals.records import Array
from kbs_process.stages.gravity.model import GravityModel
from stages.gravity.synthetic import perturbed
from stages.gravity.turned_mass import DRAWN, described, fitted, recorded

UNCERTAIN = (*DRAWN, ".tilt", ".origin", ".misalignment")


def drawn(folder: Path, rate: float, seed: int, slow: float) -> tuple[Rig, GravityModel]:
    """The rig as it is, and what is found of it in a minute."""
    campaign, rng = described(folder / f"{rate:g} {slow:g} {seed}", rate), np.random.default_rng(seed)
    rig = perturbed(campaign.rig, rng, names=UNCERTAIN)
    return rig, fitted(campaign, [recorded(campaign, rig, rng, 60.0, slow=slow)])


def errors(rig: Rig, model: GravityModel) -> Array:
    """Mass, CoG and inertia over their sigma, (10,)."""
    truth = np.concatenate([np.ravel(rig.quantities()[name].value) for name in DRAWN])
    assert model.equation.names[:10] == tuple(model.equation.elements.names[:10])
    assert model.equation.names[0] == "body.mass.mass" and model.equation.names[9] == "body.mass.inertia[5]"
    return (model.fit.value[:10] - truth) / model.fit.sigma[:10]


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_what_is_found_is_as_far_off_as_it_says(tmp_path: Path, seed: int) -> None:
    """Below 0.83 Hz, beyond which lie products of the angles."""
    rig, model = drawn(tmp_path, 10.0, seed, 1.0)
    assert model.fit.checks[0].passed
    z = errors(rig, model)
    assert np.sqrt(np.mean(z**2)) < 1.4, z


@pytest.mark.validation
@pytest.mark.parametrize(("rate", "slow"), [(160.0, 1.0), (160.0, 8.0), (40.0, 1.0), (10.0, 1.0)])
def test_intervals_cover_and_are_narrow(tmp_path: Path, rate: float, slow: float) -> None:
    """1 % of the mass, 2 mm, 10 % of the inertia's moments."""
    found = [drawn(tmp_path, rate, seed, slow) for seed in range(20)]
    z = np.array([errors(rig, model) for rig, model in found])
    assert 0.90 <= np.mean(np.abs(z) < 1.96) <= 0.98
    sigma = np.array([model.fit.sigma[:7] / [model.fit.value[0], 1, 1, 1, *model.fit.value[4:7]] for _, model in found])
    assert np.all(np.median(sigma, axis=0) <= [0.01, 0.002, 0.002, 0.002, 0.1, 0.1, 0.1])
