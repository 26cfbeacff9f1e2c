"""Inverse dynamics against statics by hand, its own regressor, momentum balances and MuJoCo."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from kbs_process.plant import rigid
from kbs_process.rig.model import TRANSDUCER, substitute
from kbs_process.signals.frames import from_rotation_vector, from_tilt, from_xyz, rotate
from plant.rigs import pointing_rig, smooth_motion, wheel_rig

pytestmark = pytest.mark.slow

G = 9.80665


def crooked_rig(**changes):
    rig = pointing_rig(**changes)
    return substitute(
        rig,
        {
            "transducer.tilt": np.array([0.01, -0.02]),
            "joint.az.misalignment": np.array([0.02, -0.01, 0.0]),
            "joint.el.misalignment": np.array([0.015, 0.0, -0.02]),
            "joint.el.origin": np.array([0.03, -0.02, 0.01]),
        },
    )


def test_at_rest_and_level_the_transducer_carries_the_weight():
    rig = pointing_rig(stiffness=None)
    wrench = rigid.static_wrench(rig, np.array([[0.0, 0.0], [0.0, np.pi / 2]]))
    np.testing.assert_allclose(wrench[:, :3], [[0, 0, -28 * G]] * 2, atol=1e-10)
    # Elevation 0: the antenna's CoG at (0.07, 0.06); 90 deg: x_E points up, z_E to -x_A.
    expected = [-G * (6 * -0.03 + 14 * 0.06), G * (6 * 0.01 + 14 * 0.07)]
    np.testing.assert_allclose(wrench[0, 3:5], expected, atol=1e-10)
    assert wrench[1, 4] == pytest.approx(G * (6 * 0.01 + 14 * 0.02))


def test_sag_tips_the_weight_and_balances_the_stiffness():
    rig = pointing_rig()
    q = np.array([[0.4, 1.3]])
    sagged, rigid_base = rigid.static_wrench(rig, q)[0], rigid.static_wrench(rig, q, sag=False)[0]
    sag = sagged[3:] / rig.transducer.stiffness.value
    np.testing.assert_allclose(sagged[:3], -28 * G * from_xyz(sag)[2], rtol=1e-5)
    assert 0.1 < np.linalg.norm(sagged[:2]) < 1.0
    assert np.linalg.norm(rigid_base[:2]) < 1e-12
    tilted = substitute(rig, {"transducer.tilt": sag[:2]})
    np.testing.assert_allclose(rigid.static_wrench(tilted, q, sag=False)[0], sagged, atol=1e-3)
    assert np.abs(rigid_base - sagged).max() > 0.1


def inertial_parameters(rig):
    """What `regressor` is multiplied by, (10 bodies,)."""
    theta = []
    for body in rig.bodies:
        m, c = float(body.mass), body.cog.value
        origin = rigid.inertia_matrix(body.inertia.value) + m * (c @ c * np.eye(3) - np.outer(c, c))
        theta += [m, *(m * c), *np.diag(origin), origin[0, 1], origin[0, 2], origin[1, 2]]
    return np.array(theta)


@pytest.mark.parametrize("make", [lambda: crooked_rig(rotor=None, stiffness=None), wheel_rig])
def test_regressor_times_parameters_is_inverse_dynamics(make):
    rig = make()
    _, q, qd, qdd = smooth_motion(len(rig.joints), seconds=2)
    wrench = rigid.inverse_dynamics(rig, q, qd, qdd, sag=False)
    Y = rigid.regressor(rig, q, qd, qdd)
    np.testing.assert_allclose(Y @ inertial_parameters(rig), wrench, atol=1e-10)
    assert np.linalg.matrix_rank(Y.reshape(-1, Y.shape[2])) < Y.shape[2]


@pytest.mark.parametrize("make", [lambda: crooked_rig(stiffness=None), wheel_rig])
def test_wrench_is_minus_the_rate_of_momentum_less_gravity(make):
    """Newton-Euler against central differences of linear and angular momentum taken about a fixed point."""
    rig = make()
    t, q, qd, qdd = smooth_motion(len(rig.joints), seconds=4, rate=1000.0)
    links = rigid.kinematics(rig, q, qd, qdd)
    dt, beyond = t[1] - t[0], rigid.links_beyond(rig)
    P, L = np.zeros((len(q), 3)), np.zeros((len(q), 3))
    gravity_force, gravity_moment = np.zeros(3), np.zeros((len(q), 3))
    for item in rig.bodies:
        if item.on not in beyond:
            continue
        link = links[item.on]
        c = link.r + rotate(link.R, item.cog.value)
        v = np.gradient(c, dt, axis=0, edge_order=2)
        R_t = np.swapaxes(link.R, 1, 2)
        h = rotate(link.R, rotate(R_t, link.omega) @ rigid.inertia_matrix(item.inertia.value))
        P += float(item.mass) * v
        L += float(item.mass) * np.cross(c, v) + h
        weight = np.array([0, 0, -float(item.mass) * G])
        gravity_force = gravity_force + weight
        gravity_moment += np.cross(c, weight)
    for index, item in enumerate(rig.joints):
        if item.drive is not None:
            carrier = links[item.parent]
            e = (links[item.name].omega - carrier.omega) / qd[:, index, None]
            spin = np.sum(carrier.omega * e, axis=1) + 100.0 * qd[:, index]
            L += float(item.drive.rotor_inertia) * spin[:, None] * e
    force = gravity_force - np.gradient(P, dt, axis=0, edge_order=2)
    moment = gravity_moment - np.gradient(L, dt, axis=0, edge_order=2)
    T = links[TRANSDUCER]
    R_t = np.swapaxes(T.R, 1, 2)
    expected = np.concatenate([rotate(R_t, force), rotate(R_t, moment - np.cross(T.r, force))], axis=1)
    wrench = rigid.inverse_dynamics(rig, q, qd, qdd, sag=False)
    np.testing.assert_allclose(wrench[5:-5], expected[5:-5], atol=2e-3)
    assert np.ptp(wrench, axis=0).max() > 1.0


def _mujoco_model(rig):
    """The same rig in MuJoCo, held by six joints whose inverse forces are the wrench it asks of the ground."""
    gravity = from_tilt(rig.transducer.tilt.value).T @ [0, 0, -G]

    def inertial(item):
        cog, tensor = (" ".join(map(str, x.value)) for x in (item.cog, item.inertia))
        return f'<inertial pos="{cog}" mass="{float(item.mass)}" fullinertia="{tensor}"/>'

    def quat(phi):
        q = np.zeros(4)
        mujoco.mju_mat2Quat(q, from_rotation_vector(phi).ravel())
        return " ".join(map(str, q))

    base, az, el = rig.bodies
    j_az, j_el = rig.joints
    Jr = 2e-5
    # The rotor's transverse inertia and mass are counted in its carrier; MuJoCo wants some: far below tolerance.
    rotor = (
        '<body quat="{quat}"><inertial pos="0 0 0" mass="1e-9" diaginertia="{inertia}"/>'
        '<joint name="{name}" axis="{axis}"/></body>'
    )
    r_az = rotor.format(quat=quat(j_az.misalignment.value), inertia=f"1e-5 1e-5 {Jr}", name="r_az", axis="0 0 1")
    r_el = rotor.format(quat=quat(j_el.misalignment.value), inertia=f"1e-5 {Jr} 1e-5", name="r_el", axis="0 -1 0")
    hold = "".join(f'<joint type="slide" axis="{a}"/>' for a in ("1 0 0", "0 1 0", "0 0 1"))
    hold += "".join(f'<joint type="hinge" axis="{a}"/>' for a in ("1 0 0", "0 1 0", "0 0 1"))
    pos_az, pos_el = (" ".join(map(str, j.origin.value)) for j in rig.joints)
    xml = f"""<mujoco><compiler angle="radian" balanceinertia="false" boundmass="0" boundinertia="0"/>
    <option gravity="{gravity[0]} {gravity[1]} {gravity[2]}"/><worldbody>
    <body>{hold}{inertial(base)}{r_az}
      <body pos="{pos_az}" quat="{quat(j_az.misalignment.value)}"><joint name="az" axis="0 0 1"/>{inertial(az)}{r_el}
        <body pos="{pos_el}" quat="{quat(j_el.misalignment.value)}"><joint name="el" axis="0 -1 0"/>{inertial(el)}
    </body></body></body></worldbody></mujoco>"""
    return mujoco.MjModel.from_xml_string(xml)


def test_wrench_agrees_with_mujoco():
    rig = crooked_rig(stiffness=None)
    model = _mujoco_model(rig)
    data = mujoco.MjData(model)
    address = {name: model.joint(name).dofadr[0] for name in ("az", "el", "r_az", "r_el")}
    _, q, qd, qdd = smooth_motion(2, seconds=20, rate=5)
    wrench = rigid.inverse_dynamics(rig, q, qd, qdd, sag=False)
    reference = np.zeros_like(wrench)
    for k in range(len(q)):
        for index, name in enumerate(("az", "el")):
            for target, source in ((data.qpos, q), (data.qvel, qd), (data.qacc, qdd)):
                target[address[name]] = source[k, index]
                target[address[f"r_{name}"]] = 100.0 * source[k, index]
        mujoco.mj_inverse(model, data)
        reference[k] = -data.qfrc_inverse[:6]
    # MuJoCo's rotors carry a transverse inertia of 1e-5 kg m^2, the only difference between the two.
    np.testing.assert_allclose(wrench, reference, atol=5e-5)
    spinless = rigid.inverse_dynamics(crooked_rig(rotor=None, stiffness=None), q, qd, qdd, sag=False)
    assert np.abs(spinless - reference).max() > 1e-3
