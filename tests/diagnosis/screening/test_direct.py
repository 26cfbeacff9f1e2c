"""Forces of the laboratory on a rig that its measured motion drives: signatures are what its prediction changes by."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis import bench
from kbs_process.diagnosis.experiments.hypothesis import Hypothesis, Tapped
from kbs_process.diagnosis.nominal.parameters import known_parameters
from kbs_process.diagnosis.proposing.curves import CurveSuspect, curves, series
from kbs_process.diagnosis.proposing.measured import inserted
from kbs_process.diagnosis.screening import direct
from kbs_process.diagnosis.screening.inlets import WRENCH_PORT, Inlet
from kbs_process.diagnosis.screening.scene import Scene
from kbs_process.diagnosis.screening.signature import inputs
from kbs_process.diagnosis.screening.suspects import Candidate, felt_from_the_ground
from kbs_process.plant.attach import attach
from kbs_process.plant.effect import Port
from kbs_process.plant.laws import CATALOGUE
from kbs_process.plant.laws.position.measured_law import MEASURED, Measured
from kbs_process.plant.moved import added_loads, grounded, pressed
from kbs_process.plant.rigid import kinematics, loads
from kbs_process.reduction.relief import without_forces
from kbs_process.rig.model import Effort, Rig
from kbs_process.signals.frames import rotate
from kbs_process.signals.records import Array, Signal
from plant.plant_rigs import body, joint, quantity
from plant.plant_rigs import rig as plain_rig

pytestmark = pytest.mark.slow

RATE = 100.0
_TAPPED = ("rotor_angle", "rotor_rate", "joint_angle", "joint_rate")
COEFFICIENTS = np.array([0.3, 0.5, -0.2, 0.1, 0.4, 0.2, -0.3, 0.1, 0.6, 0.2])
GAIN = 2.0


def rig(slides: bool = False) -> Rig:
    """EL089's on a plate that does not give way, with the efforts of both joints recorded."""
    plain = bench.rig()
    effort = Effort("N m", *(quantity("effort", value) for value in (GAIN, 0.0, 0.0, 0.0)))
    az, el = (replace(joint, effort=effort) for joint in plain.joints)
    az = replace(az, type="prismatic") if slides else az
    return replace(plain, joints=(az, el), transducer=replace(plain.transducer, stiffness=None))


def motion() -> tuple[Array, Array]:
    t = np.arange(0.0, 20.0, 1.0 / RATE)
    q = np.stack([0.3 * np.sin(0.4 * t), 1.2 + 0.25 * np.sin(0.7 * t + 1.0)], axis=1)
    return q, np.gradient(q, 1.0 / RATE, axis=0)


@pytest.mark.parametrize("slides", [False, True])
@pytest.mark.parametrize(
    ("name", "site", "point"),
    [
        ("tether", "el", (0.2, 0.1, -0.3)),
        ("tether", "az", (0.2, 0.1, -0.3)),
        ("air_drag", "el", (0.3, -0.1, 0.12)),
        ("ground_cable", "el", None),
        ("ground_cable", "az", None),
    ],
)
def test_a_force_s_signature_is_what_it_adds_to_the_loads(
    name: str, site: str, point: tuple[float, float, float] | None, slides: bool
) -> None:
    law = next(one for one in CATALOGUE if one.name == name)
    here = rig(slides)
    shape = {p.name: p.prior.middle for p in law.parameters if p.role == "shape"}
    candidate = Candidate(law, site, tuple(shape.items()), point)
    q, qd = motion()
    names = [f"{signal}.{joint}" for signal in ("joint_angle", "joint_rate") for joint in here.joint_names]
    columns = inputs(candidate, Tapped(RATE, tuple(names), np.hstack([q, qd])), here, ())
    found = direct.respond(here, columns, q)
    for k, amplitude in enumerate(candidate.amplitudes):
        values = shape | {amplitude.name: 1.0}
        if law.port is Port.EXTERNAL_FORCE:
            acting = attach(here, law, values, on=site, point=np.array(point))
        else:
            acting = attach(here, law, values, joints=[site])
        added = added_loads(acting, [law], q, qd, 1.0 / RATE)
        size = np.max(np.abs(added), axis=0)
        assert size[:6].any()
        # inputs are means from one sample to the next
        assert np.allclose(found[50:-50, :, k], added[50:-50], atol=2e-3 * size.max())


def test_a_torque_in_a_drive_shows_in_its_effort_alone() -> None:
    q, _ = motion()
    column = {Inlet("joint_torque", "el"): np.ones(len(q))}
    found = direct.respond(rig(), [column, {Inlet(WRENCH_PORT, "az", "Tz"): np.full(len(q), np.nan)}], q)
    assert np.allclose(found[50:-50, 7, 0], -1.0 / GAIN, rtol=2e-3)
    assert not np.delete(found[:, :, 0], 7, axis=1).any() and not found[:, :, 1].any()


def chain(carrier: str, slider: int) -> Rig:
    """Three skewed joints, their transducer in the laboratory or on one of them, one joint sliding."""
    rng = np.random.default_rng(len(carrier) + slider)
    parents = {"lab": ("T", "a", "b"), "a": ("lab", "T", "b"), "b": ("lab", "a", "T")}[carrier]
    joints = []
    for k, (name, parent) in enumerate(zip("abc", parents, strict=True)):
        axis = rng.standard_normal(3)
        one = joint(name, parent, tuple(axis / np.linalg.norm(axis)), 0.3 * rng.standard_normal(3))
        effort = Effort("V", *(quantity("effort", value) for value in (1.7 + k, 0.1, 0.0, 0.0)))
        joints.append(replace(one, type="prismatic" if k == slider else "revolute", effort=effort))
    bodies = tuple(body(f"of {name}", name, 2.0, 0.2 * rng.standard_normal(3), (0.1, 0.1, 0.1)) for name in "abc")
    whole = plain_rig(bodies, tuple(joints), tilt=(0.02, -0.03), stiffness=None)
    return replace(whole, transducer=replace(whole.transducer, on=carrier))


@pytest.mark.parametrize("carrier", ["lab", "a", "b"])
@pytest.mark.parametrize("slider", [-1, 0, 1, 2])
def test_the_loads_answer_to_a_weight_as_to_a_force_and_to_the_ground_by_its_power(carrier: str, slider: int) -> None:
    here = chain(carrier, slider)
    q = np.random.default_rng(5).standard_normal((7, 3))
    still = np.zeros_like(q)
    links = kinematics(here, q, still, still)
    R_TL = np.swapaxes(links["T"].R, 1, 2)
    answers, grounds = pressed(here, q), grounded(here, q)
    point, mass = np.array([0.2, -0.1, 0.3]), 3.0
    weight = np.tile([0.0, 0.0, -mass * float(here.gravity)], (len(q), 1))
    for number, link in enumerate(here.joints):
        heavier = replace(here, bodies=(*here.bodies, body("more", link.name, mass, point, (0.0, 0.0, 0.0))))
        added = loads(heavier, q, still, still) - loads(here, q, still, still)
        arm = rotate(R_TL, links[link.name].r + rotate(links[link.name].R, point) - links["T"].r)
        force = rotate(R_TL, weight)
        wrench = np.hstack([force, np.cross(arm, force)])
        assert np.allclose(rotate(answers[link.name], wrench), added, atol=1e-9)
        axis = links[link.name].axis
        for row, other in enumerate(here.joints):
            rate = still.copy()
            rate[:, row] = 1.0
            moved = kinematics(here, q, rate, still)[link.name]
            power = np.sum(axis * (moved.v if number == slider else moved.omega), axis=1)
            assert other.effort is not None
            assert np.allclose(grounds[link.name][:, 6 + row], -power / float(other.effort.gain), atol=1e-12)


def test_what_the_laboratory_exerts_is_taken_from_efforts_too() -> None:
    law = next(one for one in CATALOGUE if one.name == "tether")
    values = {"tether_x": 3.0, "tether_z": -5.0, "tether_ky": 40.0}
    here = attach(rig(), law, values, on="el", point=np.array([0.2, 0.1, -0.3]))
    q, _ = motion()
    whole = Signal(
        0.0, 1.0 / RATE, np.zeros((len(q), 8)), here.channels, ("",) * 8, "T", np.ones(len(q), dtype=np.bool_)
    )
    still = np.zeros_like(q)
    expected = added_loads(here, [law], q, still, 1.0 / RATE)
    left = without_forces(whole, here, (law,), q)
    assert np.max(np.abs(expected[:, 6:])) > 0.1
    np.testing.assert_allclose(left.values, -expected, atol=1e-9)


def test_drives_without_an_effect_s_numbers_have_none_that_are_known() -> None:
    """Such effects add nothing along a measured motion."""
    here = rig()
    az, el = here.joints
    assert el.drive is not None
    fewer = replace(el, drive=replace(el.drive, parameters={}))
    names = {one.name for one in known_parameters(replace(here, joints=(az, fewer)), ("kinematic_error",))}
    law = next(one for one in CATALOGUE if one.name == "kinematic_error")
    assert any(f"joint.az.drive.{entry.name}" in names for entry in law.parameters)
    assert not any(f"joint.el.drive.{entry.name}" in names for entry in law.parameters)


def test_what_no_transducer_reads_is_no_torque_of_the_ground() -> None:
    here = rig()
    assert felt_from_the_ground(here) >= {"az", "el"}
    assert not felt_from_the_ground(replace(here, transducer=replace(here.transducer, channels=())))
    assert felt_from_the_ground(chain("b", -1)) & {"a", "b", "c"} == {"c"}


@pytest.mark.parametrize(
    ("law", "geared"),
    [(law, geared) for law in MEASURED for geared in (True, False)],
    ids=lambda value: getattr(getattr(value, "effect", None), "name", str(value)),
)
def test_a_curve_s_signature_is_what_it_adds_to_the_loads(law: Measured, geared: bool) -> None:
    """Of each joint, over its own motion and the other one's; of joints of which no drive is described, too."""
    here, (q, qd) = rig(), motion()
    names = tuple(f"{of}.{joint}" for of in _TAPPED for joint in here.joint_names)
    ratio = float(here.joints[0].drive.ratio) if geared else 1.0  # type: ignore[union-attr]
    if not geared:
        here = replace(here, joints=tuple(replace(joint, drive=None) for joint in here.joints))
    tapped = Tapped(RATE, names, np.hstack([ratio * q, ratio * qd, q, qd]))
    hypothesis = Hypothesis(here, ())
    scene = object.__new__(Scene)
    experiment = replace(bench.experiment(bench.rig(), ("fit",), 1), rig=here)
    told = {"experiment": experiment, "hypothesis": hypothesis, "signals": {0: tapped}, "paths": {}}
    for name, value in told.items():
        object.__setattr__(scene, name, value)
    if geared and law.effect.port is not Port.MOTOR_TORQUE:
        assert {one.joint for one in curves(scene) if one.law is law} == set(here.joint_names)
    for site in here.joint_names:
        swept = series(scene, 0, site, law.regressor)
        curve = CurveSuspect(scene, law, site, (float(swept.min()), float(swept.max())))
        expected = direct.respond(here, curve.inputs(0), q) @ COEFFICIENTS
        acting, _ = inserted(hypothesis, law, site, curve.ends, COEFFICIENTS, 0.1 * COEFFICIENTS)
        added = added_loads(acting.rig, [law.effect], q, qd, 1.0 / RATE)
        size = np.max(np.abs(added))
        assert size > 0.01
        np.testing.assert_allclose(expected, added, atol=0.03 * size)
