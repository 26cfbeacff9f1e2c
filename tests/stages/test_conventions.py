"""The self-test of signs catches a reversed channel, swapped channels and a reversed encoder."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import archived
from kbs_process.plant.rigid import static_wrench
from kbs_process.signals.records import WRENCH_CHANNELS, Signal
from kbs_process.stages.conventions import check_encoder_sense, check_gravity_sign, check_response, check_weight

T = np.linspace(0.0, 1.0, 500)
Q = np.stack([np.radians(150 * np.sin(6 * T)), np.radians(70 + 17 * T)], axis=1)


def angles(values: np.ndarray) -> Signal:
    return Signal(0.0, 0.05, values, ("az", "el"), ("rad", "rad"), "joint", np.ones(len(values), dtype=bool))


@cache
def computed() -> np.ndarray:
    """Gravity's wrench on the swing."""
    return static_wrench(archived.rig(), Q)


def tared() -> np.ndarray:
    """The same as a transducer shows it that was tared at the start."""
    return computed() - computed()[0] + 0.01


def verdicts(measured: np.ndarray, errors: np.ndarray | None = None) -> dict[str, bool]:
    noise = archived.rig().transducer.noise.value
    checks = check_gravity_sign(WRENCH_CHANNELS, measured, computed(), noise, errors)
    return {check.check.split()[3]: check.ok for check in checks if check.testable}


def test_a_tared_transducer_passes_on_the_channels_that_gravity_moves():
    assert verdicts(tared()) == {"Fx": True, "Fy": True, "Tx": True, "Ty": True}


@pytest.mark.parametrize("channel", ["Tx", "Ty"])
def test_a_reversed_channel_is_caught(channel: str):
    values = tared()
    values[:, WRENCH_CHANNELS.index(channel)] *= -1.0
    assert verdicts(values)[channel] is False


def test_a_slope_is_judged_by_what_the_files_do_not_know():
    values = tared()
    values[:, 4] *= 1.05
    assert verdicts(values)["Ty"] is False
    errors = np.zeros((*values.shape, 1))
    errors[:, 4, 0] = 0.02 * computed()[:, 4]
    assert verdicts(values, errors)["Ty"] is True


def test_swapped_channels_are_caught():
    values = tared()
    values[:, [3, 4]] = values[:, [4, 3]]
    assert verdicts(values)["Tx"] is False


def test_an_encoder_that_counts_the_other_way_is_caught():
    found = check_encoder_sense(angles(Q * [1.0, -1.0]), angles(Q))
    assert [check.ok for check in found] == [True, False]


def test_weight_points_down_on_a_level_plate_and_is_not_asked_in_orbit():
    (check,) = check_weight(archived.rig())
    assert check.ok and "-274.58" in check.found
    weightless = replace(archived.rig(), gravity=replace(archived.rig().gravity, value=np.array(0.0)))
    assert check_weight(weightless) == ()


def test_a_slope_that_the_files_do_not_know_is_not_testable():
    values = tared()
    values[:, 4] *= 3.338
    errors = np.zeros((*values.shape, 1))
    errors[:, 4, 0] = 44.0 * computed()[:, 4]
    noise = archived.rig().transducer.noise.value
    (check,) = (
        one for one in check_gravity_sign(WRENCH_CHANNELS, values, computed(), noise, errors) if "Ty" in one.check
    )
    assert check.ok and not check.testable


def silent(read: np.ndarray, due: np.ndarray, *, alone: bool = False, error: float = 0.0) -> bool:
    """Whether one channel of a noise of 2 mN m is said not to respond."""
    found = check_response(["Tz"], read[:, None], due[:, None], np.array([error]), np.array([0.002]), [alone])
    return any("Tz does not respond" in one.found and not one.ok for one in found)


def test_a_channel_that_shows_only_noise_does_not_respond():
    noise = 0.0003 * np.random.default_rng(1).standard_normal(500)
    due = 0.004 * np.sin(6 * T)
    assert silent(noise, due)
    assert not silent(due + noise, due)
    assert not silent(noise, due, error=0.002)  # how far gravity moves it is not known
    assert not silent(noise + 0.0001 * due, 0.0001 * due)  # nothing moves it


def test_a_channel_that_alone_has_lost_its_zero_does_not_respond():
    noise = 0.0003 * np.random.default_rng(1).standard_normal(500)
    assert silent(noise, 0.0 * noise, alone=True)
    assert not silent(noise + 0.4, 0.0 * noise, alone=True)
    assert not silent(noise, 0.0 * noise)
