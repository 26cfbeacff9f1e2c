"""Stability: known loops, exact discretisation, python-control against eigenvalues, and the onset by simulation."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from kbs_process.plant.attach import attach
from kbs_process.plant.effect import instance
from kbs_process.plant.laws import CATALOGUE, select
from kbs_process.plant.laws.position.measured_law import MEASURED
from kbs_process.plant.linear.linearise import Linear, linearise
from kbs_process.rig.model import Controller, Quantity
from kbs_process.studies.stability import loop as stability
from kbs_process.studies.stability import onset
from plant.plant_rigs import NOMINAL, two_axis

pytestmark = pytest.mark.slow

POSE = np.radians([0.0, 30.0])


def controller(Kp: float, Ki: float, latency: int, cycle: float = 0.1) -> Controller:
    def quantity(name: str, value: Any) -> Quantity:
        return Quantity(f"controller.{name}", np.asarray(value), "SI", np.zeros_like(np.asarray(value)), "test")

    return Controller(quantity("cycle", cycle), "closed", quantity("Kp", [Kp]), quantity("Ki", [Ki]), latency)


def stiff() -> Linear:
    """One joint that follows its field within a thousandth of a cycle."""
    k = 1e10
    eye = np.eye(1)
    return Linear(0, ("tip",), eye, 2e5 * eye, k * eye, k * eye, *[np.zeros((6, 1))] * 3)


def flexible() -> tuple[Linear, Controller]:
    """The paper's rig with its drives softened, so that the structure counts."""
    rig = onset.smooth_rig(two_axis(drive={"Ka": 800.0}, Kp=0.05, Ki=0.01))
    assert rig.controller is not None
    return linearise(rig, select(NOMINAL), POSE), rig.controller


def test_what_is_without_friction_has_none_of_any_law() -> None:
    laws = {"coulomb": {"coulomb": 0.5}, "joint_viscous": {"joint_viscous": 3.0}, "motor_order": {"order_sin": 0.01}}
    rig = two_axis()
    for name, values in laws.items():
        effect = next(one for one in CATALOGUE if one.name == name)
        shape = {entry.name: entry.prior.middle for entry in effect.parameters if entry.role == "shape"}
        zeros = {entry.name: 0.0 for entry in effect.parameters if entry.role == "amplitude"}
        rig = attach(rig, effect, shape | zeros | values, joints=["el"])
    law = next(one.effect for one in MEASURED if one.opposed)
    coefficients = [entry.name for entry in law.parameters if entry.role == "amplitude"]
    rig = attach(rig, law, dict.fromkeys(coefficients, 0.1), joints=["el"])
    again = instance(next(one for one in CATALOGUE if one.name == "coulomb"), 2)
    rig = attach(rig, again, {entry.name: 1e-3 for entry in again.parameters}, joints=["el"])
    joint = onset.smooth_rig(rig).joint("el")
    assert joint.drive is not None
    found = joint.drive.parameters
    gone = ("tcog", "d0", "Ts0", "coulomb", "coulomb_2", "order_sin", *coefficients)
    assert [float(found[name]) for name in gone] == [0.0] * len(gone)
    assert float(found["joint_viscous"]) == 3.0
    assert float(found["Ka"]) > 0.0


@pytest.mark.parametrize(("latency", "limit"), [(0, 2.0), (1, 1.0), (2, 2.0 * np.sin(np.pi / 10.0))])
def test_an_integrator_with_delay_has_its_textbook_limit(latency: int, limit: float) -> None:
    # z^(d+1) - z^d + Kp = 0 reaches the unit circle at Kp = 2 sin(pi / (2 (2 d + 1))).
    found = stability.critical(stiff(), controller(0.05, 0.0, latency))
    assert 0.05 * found.factor == pytest.approx(limit, rel=1e-3)
    assert found.frequency == pytest.approx(1.0 / (0.1 * 2.0 * (2 * latency + 1)), rel=1e-3)


@pytest.mark.parametrize("arriving", [(), ((1.0, -0.03), (0.9, 0.0))])
def test_the_cycle_is_discretised_exactly(arriving: tuple[tuple[float, float], ...]) -> None:
    system = replace(flexible()[0], arriving=arriving)
    of_field, of_rate = np.array(arriving or [(1.0, 0.0)] * 2).T
    c, n = len(system.M), len(system.joints)
    Phi, G_u, G_v = stability.discretised(system, 0.1)
    start, u, v = np.linspace(-1e-3, 1e-3, 2 * c), np.array([1e-3, -2e-3]), np.array([5e-4, 1e-3])

    def rates(t: float, s: Any) -> Any:
        field = of_field * (u + v * t / 0.1) + of_rate * v / 0.1
        force = system.B @ field - system.K @ s[:c] - system.C @ s[c:]
        return np.concatenate([s[c:], np.linalg.solve(system.M, force)])

    end = solve_ivp(rates, (0.0, 0.1), start, method="Radau", rtol=1e-8, atol=1e-12).y[:, -1]
    exact = Phi @ start + G_u @ u + G_v @ v
    assert np.allclose(exact[:c], end[:c], atol=1e-6 * np.abs(end[:c]).max())
    assert n == 2


def test_margins_of_python_control_agree_with_the_eigenvalues() -> None:
    system, given = flexible()
    for joint in system.joints:
        found = stability.margins(stability.loop(system, given), joint, 0.0)
        alone = np.array([found.gain if name == joint else 1.0 for name in system.joints])
        scaled = replace(
            given,
            Kp=replace(given.Kp, value=alone * given.Kp.value),
            Ki=replace(given.Ki, value=alone * given.Ki.value),
        )
        assert stability.radius(stability.loop(system, scaled)) == pytest.approx(1.0, abs=2e-4)
        cut = stability.loop(system, given)
        f = np.geomspace(1e-3, 5.0, 4000)
        sensitivity = np.abs(1.0 / (1.0 + cut.response(joint, f))).max()
        assert found.sensitivity_peak == pytest.approx(sensitivity, rel=5e-3)


def test_a_delay_of_a_cycle_more_costs_margin_and_damping_of_the_base_matters_little() -> None:
    system, given = flexible()
    now = stability.critical(system, given).factor
    late = stability.critical(system, replace(given, latency=2)).factor
    assert late < 0.75 * now


def test_closed_loop_poles_are_those_of_the_loop_matrix() -> None:
    system, given = flexible()
    cut = stability.loop(system, given)
    slowest = stability.poles(cut).real.max()
    assert np.exp(slowest * cut.cycle) == pytest.approx(stability.radius(cut))
    assert slowest < 0.0


@pytest.mark.parametrize(("integral", "lag"), [(1.0, 0.0), (10.0, 0.0), (1.0, 0.02)])
def test_simulation_loses_stability_where_the_linear_loop_does(integral: float, lag: float) -> None:
    effects = [*NOMINAL, "controller_latency"]
    rig = onset.smooth_rig(two_axis(drive={"field_latency": lag}))
    assert rig.controller is not None
    system = linearise(rig, select(effects), POSE)
    assert system.arriving == ((1.0, pytest.approx(-lag)),) * 2
    predicted = stability.critical(system, rig.controller, integral=integral)
    found = onset.onset(rig, effects, POSE, predicted.factor, integral=integral, tolerance=5e-3)
    assert found is not None
    # The linear loop takes a latency to first order, by which it loses stability a little earlier.
    assert 0.99 < found.factor / predicted.factor < (1.01 if lag == 0.0 else 1.06)
    assert found.frequency == pytest.approx(predicted.frequency, abs=0.11)


def test_onset_is_found_from_a_wrong_guess_too() -> None:
    rig = onset.smooth_rig(two_axis())
    found = onset.onset(rig, NOMINAL, POSE, 12.0, tolerance=0.02)
    assert found is not None
    assert found.factor == pytest.approx(19.6, rel=0.03)


def test_friction_and_rounding_leave_a_limit_cycle_below_one_code_and_no_instability() -> None:
    rig = two_axis()
    found = onset.ring(rig, NOMINAL, POSE, proportional=10.0, integral=10.0)
    joint = rig.joint("el").encoder
    assert joint is not None
    assert not found.grows(found.kick)
    assert 1e-5 < found.late < float(joint.step)
    smooth = onset.ring(onset.smooth_rig(rig), NOMINAL, POSE, proportional=10.0, integral=10.0)
    assert smooth.late < 0.3 * found.late
