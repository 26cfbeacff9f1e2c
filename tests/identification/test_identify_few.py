"""Drawn hardware, one short sweep by the engine: the azimuth gear's critical numbers are found within their sigmas."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from engine.hardware import Hardware
from engine.sensors import Recording
from engine.trajectories import Axis, commands
from identification.coverage import RUN_TO_RUN, errors, experiment, make, serial, silent, true_values
from kbs_process.identification.contact import left_to_contact
from kbs_process.identification.estimate import Identification, Settings, identify
from kbs_process.identification.output_error import Scalar
from kbs_process.identification.screening import contacts
from kbs_process.rig.model import substitute
from kbs_process.signals.records import Array

pytestmark = pytest.mark.slow

FREE = ("tcog", "phi_cog", "d1", "phi_dyn", "Ts0", "delta", "phi_stat", "Ka")
SEED = 1  # its contact has a minimum elsewhere that costs 120 more


@pytest.fixture(scope="module")
def drawn() -> tuple[Hardware, Recording]:
    """Azimuth from 0 to 1.2 deg/s, to -1.2, to 0 in 24 s; elevation at rest."""
    path = Axis(-5.0).rest(1.0).accelerate(1.2, 0.2).accelerate(-1.2, 0.2).accelerate(0.0, 0.2)
    return make(SEED, commands(path, Axis(55.0), 26.0))


@pytest.fixture(scope="module")
def found(drawn: tuple[Hardware, Recording]) -> Identification:
    """All other numbers are given as they are in this run, so that what is found is up to the method alone."""
    recording = drawn[1]
    hardware = recording.hardware
    base = experiment(recording)
    free = tuple(Scalar(f"joint.az.drive.{name}") for name in FREE)
    kept = {scalar.quantity for scalar in free}
    given: dict[str, Array | float] = {}
    exact: dict[str, Array | float] = {}
    for name, quantity in base.rig.quantities().items():
        if name not in kept and np.any(quantity.sigma > 0.0) and name in hardware.values:
            given[name], exact[name] = np.asarray(hardware[name]), np.zeros(quantity.shape)
    known = replace(base, rig=substitute(base.rig, given, exact), free=free)
    return identify(known, serial, Settings(run_to_run=RUN_TO_RUN, starts=1), silent)


def test_search_converges_to_noise(found: Identification) -> None:
    assert found.fit.checks[0].passed
    assert found.fit.checks[-1].passed  # tooth contact
    assert found.fit.residual_rms == pytest.approx(1.0, abs=0.03)


def test_errors_are_of_the_size_of_their_sigmas(drawn: tuple[Hardware, Recording], found: Identification) -> None:
    wrong = errors(found, true_values(drawn[0], found))
    sigma = found.fit.sigma[: len(FREE)]
    assert np.max(np.abs(wrong) / sigma) < 4.0
    assert np.sqrt(np.mean((wrong / sigma) ** 2)) < 2.0


def test_recording_tells_more_than_the_parameter_files(found: Identification) -> None:
    prior = found.fit.prior_sigma[: len(FREE)]
    sigma = found.fit.sigma[: len(FREE)]
    assert np.all(sigma < np.where(np.isfinite(prior), 0.5 * prior, 0.5))


def test_contact_in_a_wrong_place_is_noticed(found: Identification) -> None:
    setting, parameters = found.experiment, found.parameters
    (contact,) = contacts(setting.rig, setting.effects, setting.free)
    off = found.fit.value.copy()
    off[[contact.width, contact.phase]] += 0.1, -0.2  # farther than slopes follow
    residuals = found.objective(serial).residuals
    gained, count = left_to_contact(residuals, off, found.jacobian, parameters, contact)
    assert gained > count + 8.0 * np.sqrt(2.0 * count)
