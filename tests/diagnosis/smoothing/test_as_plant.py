"""Sines and cosines of a fit are the plant's amplitudes, phases and edges."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from kbs_process.diagnosis.smoothing.as_plant import numbers_of, parameters_of
from kbs_process.diagnosis.smoothing.drive import NUMBERS, priors
from kbs_process.plant.laws.friction import bearing, stiction
from kbs_process.plant.laws.motor import cogging
from kbs_process.rig.model import Drive, Quantity
from kbs_process.signals.records import Array


def _fitted(values: Array, columns: list[Array]) -> Array:
    return np.linalg.lstsq(np.stack(columns, axis=1), values, rcond=None)[0]


@pytest.mark.parametrize("delta", [0.2, 0.5, 1.3, 2.5])
def test_a_drive_that_is_fitted_in_sines_has_the_plant_s_numbers(delta: float) -> None:
    given = {
        "b_m": 1e-3, "d0": 0.012, "tcog": 0.005, "phi_cog": -0.8, "d1": 0.004, "phi_dyn": 2.2,
        "Ts0": 0.007, "delta": delta, "phi_stat": 1.1,
    }  # fmt: skip
    angle = 2.0 * np.pi * np.arange(20011) / 20011  # its phases within a cycle are as many
    s, c = np.sin(200 * angle), np.cos(200 * angle)
    cogged = np.array([cogging.torque(a, given["tcog"], given["phi_cog"]) for a in angle])
    stuck = np.array([stiction.limit(a, 0.0, given["Ts0"], delta, given["phi_stat"]) for a in angle])
    rubbed = np.array([bearing.torque(a, 1.0, given["d0"], given["d1"], given["phi_dyn"], 0.05) for a in angle])
    dyn = _fitted(-rubbed, [np.ones_like(angle), np.sin(2 * angle), np.cos(2 * angle)])
    stat = _fitted(stuck, [s, c, np.sin(400 * angle), np.cos(400 * angle), np.ones_like(angle)])
    numbers = np.array([given["b_m"], dyn[0], *_fitted(cogged, [s, c]), *dyn[1:], *stat])
    assert len(numbers) == len(NUMBERS)
    expected = numbers_of(np.array(list(given.values())))
    assert numbers == pytest.approx(expected, rel=0.02, abs=1e-5)
    # Numbers that are known well give the parameters that they were made with, wherever files have these.
    found = parameters_of(_drive(), expected, np.diag(np.full(len(NUMBERS), 1e-12)))
    assert dict(zip(given, found, strict=True)) == pytest.approx(given, rel=0.01)


def test_waves_beyond_what_a_contact_has_are_no_reason_for_one_without_width() -> None:
    drive = _drive()
    mean, spread = priors(drive)
    numbers = mean.copy()
    numbers[NUMBERS.index("stat c")] = 2.2 * numbers[NUMBERS.index("stat")]  # of no width it is twice the mean
    found = dict(zip(_PARAMETERS, parameters_of(drive, numbers, np.diag(0.5 * spread**2)), strict=True))
    for name in ("b_m", "d0", "Ts0", "delta"):
        given = drive.parameters[name]
        assert found[name] == pytest.approx(float(given), abs=float(given.sigma)), name


@pytest.mark.parametrize("absent", [("tcog",), ("d1",), ("Ts0",), ("tcog", "d1", "Ts0", "d0")])
def test_what_a_drive_is_known_not_to_have_it_has_not(absent: tuple[str, ...]) -> None:
    drive = _drive()
    nothing = {name: Quantity(name, np.array(0.0), "", np.array(0.0), "") for name in absent}
    drive = replace(drive, parameters=drive.parameters | nothing)
    mean, spread = priors(drive)
    known = np.diag(np.where(spread > 0.0, 0.5 * spread**2, 1e-24))
    found = dict(zip(_PARAMETERS, parameters_of(drive, mean, known), strict=True))
    assert all(np.isfinite(value) for value in found.values())
    for name in absent:
        assert found[name] == pytest.approx(0.0, abs=1e-9)


_PARAMETERS = ("b_m", "d0", "tcog", "phi_cog", "d1", "phi_dyn", "Ts0", "delta", "phi_stat")


def _drive() -> Drive:
    given = {"b_m": 1.2e-3, "d0": 0.01, "d1": 0.005, "tcog": 0.006, "Ts0": 0.006, "delta": 0.6}
    known = {name: Quantity(name, np.array(value), "", np.array(0.3 * value), "") for name, value in given.items()}
    number = Quantity("", np.array(100.0), "", np.array(0.0), "")
    return Drive(number, number, number, known)
