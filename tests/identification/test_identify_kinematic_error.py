"""The gear's error of twice a motor turn is found beside the paper's five, and its rivals explain less."""

from __future__ import annotations

import numpy as np
import pytest

from engine.sensors import Recording
from identification.kinematic import ERROR, FIVE, drawn, explained, polar, rivals, setting, slopes
from kbs_process.identification.output_error import Experiment, residual, sensor_spectra
from kbs_process.identification.unknowns import prior
from kbs_process.signals.records import Array

pytestmark = pytest.mark.slow

# N m, rad, N m s/rad and N m/rad: some sigmas of an estimate, within which the plant is linear.
STEPS = np.array([1e-4, 0.01, 5e-4, 0.1, 1e-4, 0.01, 0.01, 0.2, 20.0])


@pytest.fixture(scope="module")
def recording() -> Recording:
    return drawn(3)


def at_truth(recording: Recording, names: tuple[str, ...]) -> tuple[Experiment, Array]:
    """The experiment, and the paper's five as they are with no error."""
    made = setting(recording, names)
    true = [float(recording.hardware[f"joint.az.drive.{name}"]) for name in FIVE]
    return made, np.array([*true, *np.zeros(len(names))])


def test_amplitude_and_phase_are_found_within_their_intervals(recording: Recording) -> None:
    made, start = at_truth(recording, ERROR)
    spectra = sensor_spectra(made, made.recordings[0])
    J = slopes(made, start, np.array([*STEPS, 2e-5, 2e-5]), spectra)
    r = residual(made, made.recordings[0], start, spectra)
    covariance = np.linalg.inv(J.T @ J + np.diag(prior(made).sigma ** -2.0))
    step = -covariance @ J.T @ r
    true = [float(recording.hardware[f"joint.az.drive.{name}"]) for name in ERROR]
    for (size, sigma), (found, spread) in zip(
        polar(true[0], true[1], covariance[-2:, -2:]), polar(step[-2], step[-1], covariance[-2:, -2:]), strict=True
    ):
        print(f"true {size:.4g} +- {sigma:.2g}, found {found:.4g} +- {spread:.2g}")
        assert abs(found - size) < 3.0 * spread
    assert np.sqrt(np.diag(covariance)[-2:]).max() < 1e-5  # a fifteenth of what the prior knows
    assert np.all(np.abs(step) < 4.0 * np.sqrt(np.diag(covariance)) + np.array([*np.zeros(len(FIVE)), 1.0, 1.0]))


def test_no_rival_explains_as_much(recording: Recording) -> None:
    made, values = at_truth(recording, ())
    spectra = sensor_spectra(made, made.recordings[0])
    J = slopes(made, values, STEPS, spectra)
    r = residual(made, made.recordings[0], values, spectra)
    gains = {name: explained(r, J, prior(made).sigma, more) for name, more in rivals(made, values, spectra).items()}
    print(gains)
    most = gains.pop("kinematic_error")
    assert most > 500.0
    assert gains.pop("encoder, 200 a turn") < 0.75 * most  # the torques tell it from an error of the disc
    assert max(gains.values()) < 0.1 * most
