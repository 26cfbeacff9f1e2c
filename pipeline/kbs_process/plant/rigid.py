"""Inverse dynamics of the rig's rigid bodies: from measured motion to the wrench on the transducer and the efforts.

Vectorised over time. Everything is first expressed in the laboratory's axes and then turned into T's. An
acceleration here has gravity taken off (what an accelerometer would read), so weight and inertia are one.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from kbs_process.rig.model import LAB, TRANSDUCER, Rig
from kbs_process.signals.frames import about_axis, chain, cross, from_rotation_vector, from_tilt, into_xyz, rotate, skew
from kbs_process.signals.records import Array

INERTIAL = ("m", "mcx", "mcy", "mcz", "Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz")
_SAG_ROUNDS = 3  # each round takes the error down by weight * height / stiffness, 1 % on the paper's rig


@dataclass(frozen=True, slots=True, eq=False)
class Pose:
    """Where a link is, in the laboratory's axes, (n, ...)."""

    R: Array  # (n, 3, 3) R_L,link
    r: Array  # (n, 3) origin, m
    arm: Array  # (n, 3) from its parent's origin, m
    axis: Array  # (n, 3) of its joint; zero without one


@dataclass(frozen=True, slots=True, eq=False)
class LinkMotion(Pose):
    """The same with its motion."""

    v: Array  # (n, 3) of the origin, m/s
    omega: Array  # (n, 3) rad/s
    alpha: Array  # (n, 3) rad/s^2
    accel: Array  # (n, 3) of the origin, gravity taken off, m/s^2

    @property
    def turns(self) -> bool:
        """At any time."""
        return bool(self.omega.any() or self.alpha.any())


Links = dict[str, LinkMotion]


def inverse_dynamics(
    rig: Rig, q: Array, qd: Array, qdd: Array, *, sag: bool = True, links: Links | None = None
) -> Array:
    """Wrench [F, M] (n, 6), N and N m, that all beyond T exerts on the transducer, about T's origin, in T.

    `q`, `qd`, `qdd` (n, joints) are the joints' true angles and their rates, in the order of `rig.joints`. At rest
    and level F = (0, 0, -weight). With `sag` an elastic transducer deflects quasi-statically, its angles
    being K^-1 times the torque, about x, then y, then z, and gravity turns in it; the deflection's own rates are
    left out (valid well below its resonance). Rotors turn with `ratio` times their joint's rate, on top of
    their carrier's rotation. `links` is their `kinematics`, where known.
    """
    links = links or kinematics(rig, q, qd, qdd)
    wrench = _wrench(rig, links)
    if not sag or rig.transducer.stiffness is None:
        return wrench
    return _sagged(wrench, rig, links, rig.transducer.stiffness.value)


def loads(rig: Rig, q: Array, qd: Array, qdd: Array, *, sag: bool = True, links: Links | None = None) -> Array:
    """What the rig's instruments read (n, 6 + joints), in the order of `rig.loads`: wrench, then efforts.

    The effort of a joint that nobody measures is zero.
    """
    links = links or kinematics(rig, q, qd, qdd)
    measured = [index for index, joint in enumerate(rig.joints) if joint.effort is not None]
    readings = np.zeros((len(q), len(rig.joints)))
    if measured:
        efforts = joint_efforts(rig, q, qd, qdd, links)
        for index in measured:
            effort = rig.joints[index].effort
            assert effort is not None
            readings[:, index] = efforts[:, index] / float(effort.gain) + float(effort.bias)
    return np.concatenate([inverse_dynamics(rig, q, qd, qdd, sag=sag, links=links), readings], axis=1)


def joint_efforts(rig: Rig, q: Array, qd: Array, qdd: Array, links: Links | None = None) -> Array:
    r"""Efforts (n, joints), N m or N, that the drives put into the joints to make them move so.

    Equation: $\tau_j = s_j^T \sum_b w_b + b_j \dot q_j + R_j J_{r,j} (R_j \ddot q_j + e_j \cdot \alpha_c)$ with
    $s_j$ the joint's screw, $w_b$ the wrench that accelerates and carries each body beyond it (outer rotors' spin
    included), $b_j$ its viscous friction, and the last term its own rotor's on its carrier's rotation.
    Validity: rigid bodies on a rigid base. Source: Featherstone, Rigid Body Dynamics Algorithms (2008), 5.3.
    """
    links = links or kinematics(rig, q, qd, qdd)
    efforts = np.empty((len(q), len(rig.joints)))
    for index, joint in enumerate(rig.joints):
        link, carrier = links[joint.name], links[joint.parent]
        force, moment = _reaction(rig, links, links_beyond(rig, joint.name), link.r)
        e = link.axis
        turn, slide = joint.screw
        efforts[:, index] = -np.sum(e * (turn * moment + slide * force), axis=1)
        if joint.viscous is not None:
            efforts[:, index] += float(joint.viscous) * qd[:, index]
        if joint.drive is not None:
            ratio = float(joint.drive.ratio)
            spin_rate = ratio * qdd[:, index] + np.sum(e * carrier.alpha, axis=1)
            efforts[:, index] += ratio * float(joint.drive.rotor_inertia) * spin_rate
    return efforts


def static_wrench(rig: Rig, q: Array, *, sag: bool = True) -> Array:
    """`inverse_dynamics` with all joints at rest."""
    rest = np.zeros_like(q)
    return inverse_dynamics(rig, q, rest, rest, sag=sag)


def regressor(rig: Rig, q: Array, qd: Array, qdd: Array) -> Array:
    """Y (n, 6, 10 bodies) with Y @ theta = wrench of the bodies on a rigid transducer, without the rotors.

    theta stacks (m, m c, I) of each body, `INERTIAL`: I about the link's origin, in the link's axes.
    """
    links = kinematics(rig, q, qd, qdd)
    beyond = links_beyond(rig)
    T = links[TRANSDUCER]
    Y = np.zeros((len(q), 6, 10 * len(rig.bodies)))
    for index, body in enumerate(rig.bodies):
        if body.on in beyond:
            force, moment = _link_regressor(links[body.on])
            moment = moment + skew(links[body.on].r - T.r) @ force
            columns = slice(10 * index, 10 * index + 10)
            Y[:, :3, columns] = np.swapaxes(T.R, 1, 2) @ force
            Y[:, 3:, columns] = np.swapaxes(T.R, 1, 2) @ moment
    return Y


def inertia_matrix(elements: Array) -> Array:
    """Symmetric tensor (3, 3) from its elements xx, yy, zz, xy, xz, yz."""
    xx, yy, zz, xy, xz, yz = elements
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def links_beyond(rig: Rig, link: str = TRANSDUCER) -> frozenset[str]:
    """A link and those that hang on it: what their bodies do is what the transducer, or the link's joint, feels."""
    parents = {TRANSDUCER: rig.transducer.on} | {joint.name: joint.parent for joint in rig.joints}
    beyond = {link}
    for _ in parents:  # as often as the longest chain has links
        beyond |= {name for name, parent in parents.items() if parent in beyond}
    return frozenset(beyond)


def poses(rig: Rig, q: Array) -> dict[str, Pose]:
    """Where every link is, the transducer not deflected."""
    n = len(q)
    still = np.zeros((n, 3))
    links = {LAB: Pose(np.broadcast_to(np.eye(3), (n, 3, 3)), still, still, still)}

    def place_transducer(carrier: str) -> None:
        R = chain(links[carrier].R, from_tilt(rig.transducer.tilt.value))
        links[TRANSDUCER] = Pose(R, links[carrier].r, still, still)

    if rig.transducer.on == LAB:
        place_transducer(LAB)
    for index, joint in enumerate(rig.joints):
        parent, (turn, slide) = links[joint.parent], joint.screw
        R_J = from_rotation_vector(joint.misalignment.value)
        axis = rotate(parent.R, R_J @ np.asarray(joint.axis))
        arm = rotate(parent.R, joint.origin.value) + slide * axis * q[:, index, None]
        links[joint.name] = Pose(
            R=chain(chain(parent.R, R_J), about_axis(np.asarray(joint.axis, dtype=float), turn * q[:, index])),
            r=parent.r + arm,
            arm=arm,
            axis=axis,
        )
        if rig.transducer.on == joint.name:
            place_transducer(joint.name)
    return links


def kinematics(rig: Rig, q: Array, qd: Array, qdd: Array) -> Links:
    """Motion of every link, the transducer not deflected."""
    n = len(q)
    upward = np.broadcast_to([0.0, 0.0, float(rig.gravity)], (n, 3))
    still = np.zeros((n, 3))
    placed = poses(rig, q)
    links = {LAB: LinkMotion(placed[LAB].R, still, still, still, still, still, still, upward)}

    def place_transducer(carrier: str) -> None:
        links[TRANSDUCER] = replace(links[carrier], R=placed[TRANSDUCER].R, arm=still, axis=still)

    if rig.transducer.on == LAB:
        place_transducer(LAB)
    for index, joint in enumerate(rig.joints):
        parent, pose, (turn, slide) = links[joint.parent], placed[joint.name], joint.screw
        rate, acceleration = pose.axis * qd[:, index, None], pose.axis * qdd[:, index, None]
        links[joint.name] = LinkMotion(
            R=pose.R,
            r=pose.r,
            arm=pose.arm,
            axis=pose.axis,
            v=parent.v + cross(parent.omega, pose.arm) + slide * rate,
            omega=parent.omega + turn * rate,
            alpha=parent.alpha + turn * (acceleration + cross(parent.omega, rate)),
            accel=accel_at(parent, pose.arm) + slide * (acceleration + 2.0 * cross(parent.omega, rate)),
        )
        if rig.transducer.on == joint.name:
            place_transducer(joint.name)
    return links


def accel_at(link: LinkMotion, d: Array) -> Array:
    """Acceleration of the link's point at `d` (n, 3) from its origin."""
    if not link.turns:
        return link.accel
    accel: Array = link.accel + cross(link.alpha, d) + cross(link.omega, cross(link.omega, d))
    return accel


def _wrench(rig: Rig, links: Links) -> Array:
    T = links[TRANSDUCER]
    force, moment = _reaction(rig, links, links_beyond(rig), T.r)
    R_TL = np.swapaxes(T.R, 1, 2)
    return np.concatenate([rotate(R_TL, force), rotate(R_TL, moment)], axis=1)


def _reaction(rig: Rig, links: Links, beyond: frozenset[str], about: Array) -> tuple[Array, Array]:
    """Force and moment (n, 3) that the bodies and rotors on the links `beyond` exert on what carries them.

    The moment is about points `about` (n, 3); all in the laboratory's axes.
    """
    force, moment = np.zeros_like(about), np.zeros_like(about)
    for body in rig.bodies:
        if body.on not in beyond:
            continue
        link = links[body.on]
        c = rotate(link.R, body.cog.value)
        F = -float(body.mass) * accel_at(link, c)
        force += F
        moment += cross(link.r + c - about, F)
        if link.turns:
            inertia, R_t = inertia_matrix(body.inertia.value), np.swapaxes(link.R, 1, 2)
            omega, alpha = rotate(R_t, link.omega), rotate(R_t, link.alpha)
            moment -= rotate(link.R, alpha @ inertia + cross(omega, omega @ inertia))
    return force, moment + _rotors(rig, links, beyond)


def _sagged(wrench: Array, rig: Rig, links: Links, stiffness: Array) -> Array:
    """The wrench once T has given way: in T's axes all is as before but the field of gravity, which turned.

    F changes by -m da and M by -(sum m c) x da, da the change of T's apparent acceleration. Exact for a transducer
    that stands in the laboratory; on a turning joint the carrier's rotation is taken in the old axes.
    """
    T, beyond = links[TRANSDUCER], links_beyond(rig)
    mass, first_moment = 0.0, np.zeros_like(T.r)
    for body in rig.bodies:
        if body.on in beyond:
            link = links[body.on]
            mass += float(body.mass)
            first_moment += float(body.mass) * (link.r + rotate(link.R, body.cog.value) - T.r)
    R_TL = np.swapaxes(T.R, 1, 2)
    first_moment, accel = rotate(R_TL, first_moment), rotate(R_TL, T.accel)
    sagged = wrench
    for _ in range(_SAG_ROUNDS):
        turned = into_xyz(sagged[:, 3:] / stiffness, accel) - accel
        sagged = wrench - np.concatenate([mass * turned, cross(first_moment, turned)], axis=1)
    return sagged


def _rotors(rig: Rig, links: Links, beyond: frozenset[str]) -> Array:
    """Moment (n, 3) of the rotors' spin, h = Jr (omega . e + R qd) e with e fixed in the carrier: -dh/dt."""
    moment = np.zeros_like(links[TRANSDUCER].r)
    for joint in rig.joints:
        if joint.drive is None or joint.parent not in beyond:
            continue
        carrier, link = links[joint.parent], links[joint.name]
        if not (carrier.turns or link.turns):
            continue
        Jr, ratio = float(joint.drive.rotor_inertia), float(joint.drive.ratio)
        e = link.axis
        rate = _along(link.omega - carrier.omega, e)
        acceleration = _along(link.alpha - carrier.alpha, e)
        spin = _along(carrier.omega, e) + ratio * rate
        spin_rate = _along(carrier.alpha, e) + ratio * acceleration
        moment -= Jr * (spin_rate * e + spin * cross(carrier.omega, e))
    return moment


def _along(a: Array, e: Array) -> Array:
    component: Array = np.einsum("ni,ni->n", a, e)[:, None]
    return component


def _link_regressor(link: LinkMotion) -> tuple[Array, Array]:
    """Force and moment about the link's origin, laboratory's axes, (n, 3, 10) each, linear in `INERTIAL`."""
    R_t = np.swapaxes(link.R, 1, 2)
    a, w, alpha = (rotate(R_t, x) for x in (link.accel, link.omega, link.alpha))
    n = len(a)
    force, moment = np.zeros((n, 3, 10)), np.zeros((n, 3, 10))
    for column, unit in enumerate(np.eye(3), start=1):
        force[:, :, column] = -(cross(alpha, unit) + cross(w, cross(w, unit)))
        moment[:, :, column] = -cross(unit, a)
    force[:, :, 0] = -a
    for column, unit in enumerate(np.eye(6), start=4):
        element = inertia_matrix(unit)
        moment[:, :, column] = -(alpha @ element + cross(w, w @ element))
    return link.R @ force, link.R @ moment
