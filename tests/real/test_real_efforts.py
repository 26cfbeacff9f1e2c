"""Rigs without a transducer, recorded by others: a linear axis with its force, a motor with its current.

Known figures are those of plain least-squares fits to the same recordings, trained and tested as here; the band
that they were scored in is not known, so the axis is scored in two, around it.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from real.campaigns import processed, sampling_error
from real.effort_screen import Screen, suspects
from stages.gravity.real_sets import DATA

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        not (DATA / "emps").is_dir() or not (DATA / "odrive_cogging").is_dir(),
        reason="real recordings (../shared/data) are not here",
    ),
]

EMPS_S, ODRIVE_S = 24.8, 9.5
EMPS = {0: 10.12, 1: 3.06, 2: 2.66, 3: 2.51}  # N: viscous, + Coulomb and offset, + asymmetric viscous, + Stribeck
ODRIVE = {0: 0.61, 1: 0.262, 4: 0.134, 12: 0.094}  # A, by the number of orders of the angle
FRICTION = ("asymmetric_coulomb", "asymmetric_viscous", "stribeck")


@pytest.fixture(scope="module")
def axis(tmp_path_factory):
    return processed("emps", DATA / "emps", tmp_path_factory.mktemp("emps"), page=True)


@pytest.fixture(scope="module")
def motor(tmp_path_factory):
    return processed("odrive", DATA / "odrive_cogging", tmp_path_factory.mktemp("odrive"))


def _held_out(done, band):
    return {m.recording: m for m in done.results.merit if (m.role, m.band) == ("held-out", band)}


def test_mass_and_viscous_friction_leave_of_the_axis_what_a_plain_fit_leaves(axis):
    left = [_held_out(axis, band)["sweeps_with_pulses_1"].residual_rms for band in ("lt20Hz", "lt50Hz")]
    print(
        f"\nEMPS, pulses from sweeps, mass and viscous friction: {left[0]:.2f} N below 20 Hz, {left[1]:.2f} below 50; "
        f"known {EMPS[0]}"
    )
    assert left[0] < EMPS[0] < left[1] < 1.02 * EMPS[0]
    fitted = {entry.name: entry for entry in axis.results.gravity.parameters}
    assert set(fitted) == {"body.car.mass", "joint.axis.viscous"}  # nothing else was free, no zero of the force either
    mass = fitted["body.car.mass"]
    assert abs(mass.value - 95.1089) < mass.sigma  # as published


def test_inertia_and_viscous_friction_leave_of_the_motor_what_a_plain_fit_leaves(motor):
    for band, edge in (("lt20Hz", 20.0), ("lt50Hz", 50.0)):
        merits = _held_out(motor, band)
        left = [merit.residual_rms for merit in merits.values()]
        print(f"\nODrive, inertia and viscous friction, {band}: {np.round(left, 3)} A; known {ODRIVE[0]}")
        assert {merit.unit for merit in merits.values()} == {"A"}
        assert len(left) == 2
        assert max(left) <= ODRIVE[0] * (1 + 0.5 * sampling_error(edge, ODRIVE_S))


def test_the_report_of_a_rig_without_a_transducer_is_silent_about_it(axis):
    page = (axis.target / "index.html").read_text(encoding="utf-8")
    for section in ("Cross-coupling", "Static wrench", "Transducer resonance", "Signs and frames", "Pointing"):
        assert f">{section}<" not in page
    assert "Fit of the rigid bodies" in page
    assert axis.results.cross_coupling is None
    assert {merit.frame for merit in axis.results.merit} == {"joint"}


def _grown(screen, laws, rounds):
    """The laws that a greedy search takes, and what is left of the held-out recordings after each."""
    taken, left = [], [screen.fit([])[1]["held-out"]]
    for _ in range(rounds):
        taken.append(screen.best(laws, taken))
        left.append(screen.fit(taken)[1]["held-out"])
    return taken, left


def test_the_catalogue_has_the_friction_of_the_axis(axis):
    known = [("body.car.mass", ()), ("joint.axis.viscous", ())]
    laws = suspects(joint_order=(1.0, 2.0))
    for band, edge in (("lt20Hz", 20.0), ("lt50Hz", 50.0)):
        taken, left = _grown(Screen(axis.campaign, band, known), laws, 3)
        names = ["viscous", *(law.effect.name for law in taken)]
        rows = [
            f"{name} {figures[0]:.2f} ({EMPS[k]})" for k, (name, figures) in enumerate(zip(names, left, strict=True))
        ]
        print(f"\nEMPS, pulses from sweeps, {band}, of {len(laws)} suspects, N (known): " + ", + ".join(rows))
        assert tuple(names[1:]) == FRICTION
        assert all(after < before for (before,), (after,) in pairwise(left))
        assert left[3][0] <= EMPS[3] * (1 + 0.5 * sampling_error(edge, EMPS_S))


def test_the_catalogue_has_the_cogging_of_the_motor(motor):
    known = [("body.rotor.inertia", 2), ("joint.motor.viscous", ())]
    laws = suspects(joint_order=tuple(map(float, range(1, 151))))
    taken, left = _grown(Screen(motor.campaign, "lt20Hz", known), laws, 12)
    orders = [dict(law.shape).get("joint_order", law.effect.name) for law in taken]
    print(f"\nODrive, runs 2 and 3 from run 1, of {len(laws)} suspects: {orders}")
    for count, figure in ODRIVE.items():
        print(f"  {count} laws: {np.round(left[count], 3)} A; known {figure}")
    assert orders[0] == 7.0  # pole pairs
    error = 0.5 * sampling_error(20.0, ODRIVE_S)
    assert max(left[4]) <= ODRIVE[4] * (1 + error)
    assert max(left[12]) <= ODRIVE[12] * (1 + error)
