"""Sines and cosines of a fit are the plant's amplitudes, phases and edges."""

from __future__ import annotations

import numpy as np
import pytest

from kbs_process.diagnosis.smoothing.as_plant import of_drive
from kbs_process.diagnosis.smoothing.drive import NUMBERS
from kbs_process.plant.laws.friction import bearing, stiction
from kbs_process.plant.laws.motor import cogging
from kbs_process.signals.records import Array


def _fitted(values: Array, columns: list[Array]) -> Array:
    return np.linalg.lstsq(np.stack(columns, axis=1), values, rcond=None)[0]


@pytest.mark.parametrize("delta", [0.2, 0.5, 1.3, 2.5])
def test_a_drive_that_is_fitted_in_sines_has_the_plant_s_numbers(delta: float) -> None:
    given = {
        "b_m": 1e-3, "d0": 0.012, "d1": 0.004, "phi_dyn": 2.2, "tcog": 0.005, "phi_cog": -0.8,
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
    found = of_drive(numbers)
    assert found == pytest.approx(given, rel=0.02)
