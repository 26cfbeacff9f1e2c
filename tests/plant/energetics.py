"""Kinematics, momentum and energy of a rig in the laboratory, by plain rotation matrices and differences.

Nothing here shares code or formulas with the plant: positions are written down link by link, and velocities
are their numerical derivatives along the coordinates.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from kbs_process.plant.compiled.simulation import Simulation
from kbs_process.rig.model import Rig
from kbs_process.signals.records import Array

H = 1e-6


def plate(alpha: Array) -> Array:
    """Orientation of the plate in undeflected T: turned about x, then y, then z."""
    turned: Array = Rotation.from_euler("XYZ", alpha).as_matrix()
    return turned


def links(rig: Rig, coordinates: Array) -> dict[str, tuple[Array, Array]]:
    """Orientation and origin of every link in undeflected T; coordinates are base angles, then joint angles."""
    placed = {"T": (plate(coordinates[:3]), np.zeros(3))}
    for joint, angle in zip(rig.joints, coordinates[3:], strict=True):
        R, o = placed[joint.parent]
        own = Rotation.from_rotvec(joint.misalignment.value) * Rotation.from_rotvec(angle * np.asarray(joint.axis))
        placed[joint.name] = (R @ own.as_matrix(), o + R @ joint.origin.value)
    return placed


def axes(rig: Rig, coordinates: Array) -> Array:
    """Axis of each joint in undeflected T, (joints, 3)."""
    placed = links(rig, coordinates)
    return np.array(
        [placed[j.parent][0] @ Rotation.from_rotvec(j.misalignment.value).apply(np.asarray(j.axis)) for j in rig.joints]
    )


@dataclass(frozen=True)
class Motion:
    """Coordinates of a simulation and their rates."""

    coordinates: Array
    rates: Array
    rotor_rates: Array  # relative to their carriers
    theta: Array
    spin: Array


def spin_of(R: Array, dR: Array) -> Array:
    """Angular velocity of an orientation with derivative dR."""
    W = dR @ R.T
    return np.array([W[2, 1] - W[1, 2], W[0, 2] - W[2, 0], W[1, 0] - W[0, 1]]) / 2.0


def angular(rig: Rig, link: str, coordinates: Array, rates: Array) -> Array:
    """Angular velocity of a link."""
    ahead, behind = (links(rig, coordinates + s * H * rates)[link][0] for s in (1, -1))
    return spin_of(links(rig, coordinates)[link][0], (ahead - behind) / (2 * H))


def motion(rig: Rig, simulation: Simulation) -> Motion:
    """Read a simulation's state; the base angles' rates are solved from the plate's angular velocity."""
    alpha = simulation.part("alpha").copy()
    R = plate(alpha)
    columns = [spin_of(R, (plate(alpha + H * e) - plate(alpha - H * e)) / (2 * H)) for e in np.eye(3)]
    alpha_rates = np.linalg.solve(np.array(columns).T, R @ simulation.part("omega"))
    coordinates = np.concatenate([alpha, simulation.part("q")])
    rates = np.concatenate([alpha_rates, simulation.part("qd")])
    carriers = np.array([angular(rig, joint.parent, coordinates, rates) for joint in rig.joints])
    spin = simulation.part("spin").copy()
    relative = spin - np.einsum("ij,ij->i", axes(rig, coordinates), carriers)
    return Motion(coordinates, rates, relative, simulation.part("theta").copy(), spin)


def gravity(rig: Rig) -> Array:
    """Gravity in undeflected T, which is turned in the laboratory by ty about y, then by tx about its own x."""
    tx, ty = rig.transducer.tilt.value
    g: Array = Rotation.from_euler("YX", [ty, tx]).inv().apply([0.0, 0.0, -float(rig.gravity)])
    return g


def momentum(rig: Rig, m: Motion) -> tuple[Array, Array, Array]:
    """Linear momentum, angular momentum about T's origin and moment of weight, in undeflected T."""
    P, L, weight = np.zeros(3), np.zeros(3), np.zeros(3)
    here = links(rig, m.coordinates)
    ahead, behind = (links(rig, m.coordinates + s * H * m.rates) for s in (1, -1))
    for body in rig.bodies:
        r, r1, r0 = (p[body.on][1] + p[body.on][0] @ body.cog.value for p in (here, ahead, behind))
        v = (r1 - r0) / (2 * H)
        P += float(body.mass) * v
        w = angular(rig, body.on, m.coordinates, m.rates)
        L += float(body.mass) * np.cross(r, v) + inertia(body, here) @ w
        weight += np.cross(r, float(body.mass) * gravity(rig))
    for axis, joint, spin in zip(axes(rig, m.coordinates), rig.joints, m.spin, strict=True):
        L += float(joint.drive.rotor_inertia) * spin * axis
    return P, L, weight


def inertia(body: object, placed: dict[str, tuple[Array, Array]]) -> Array:
    """Inertia tensor about the CoG in undeflected T's axes."""
    xx, yy, zz, xy, xz, yz = body.inertia.value
    R = placed[body.on][0]
    return R @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ R.T


def energy(rig: Rig, m: Motion, field: Array) -> tuple[float, float]:
    """Kinetic and potential energy; the motor's field is at rest at `field`, motor rad."""
    kinetic = potential = 0.0
    here = links(rig, m.coordinates)
    ahead, behind = (links(rig, m.coordinates + s * H * m.rates) for s in (1, -1))
    for body in rig.bodies:
        r, r1, r0 = (p[body.on][1] + p[body.on][0] @ body.cog.value for p in (here, ahead, behind))
        v = (r1 - r0) / (2 * H)
        w = angular(rig, body.on, m.coordinates, m.rates)
        kinetic += 0.5 * float(body.mass) * v @ v + 0.5 * w @ inertia(body, here) @ w
        potential -= float(body.mass) * gravity(rig) @ r
    if rig.transducer.stiffness is not None:
        potential += 0.5 * rig.transducer.stiffness.value @ m.coordinates[:3] ** 2
    for i, joint in enumerate(rig.joints):
        drive = joint.drive
        value = {name: float(q) for name, q in drive.parameters.items()}
        R = float(drive.ratio)
        kinetic += 0.5 * float(drive.rotor_inertia) * m.spin[i] ** 2
        windup = m.theta[i] / R + gear_error(value, m.theta[i]) - m.coordinates[3 + i]
        lag = value["Kangle"] * (field[i] - m.theta[i])
        cogging = value["tcog"] / 200.0 * np.cos(200.0 * m.theta[i] + value["phi_cog"])
        potential += 0.5 * value["Ka"] * windup**2 - value["Tmax"] / value["Kangle"] * np.cos(lag) + cogging
    return kinetic, potential


def gear_error(value: dict[str, float], theta: float) -> float:
    """What a gear turns its output by beyond theta over its ratio."""
    if "kinematic_sin" not in value:
        return 0.0
    angle = value["kinematic_order"] * theta
    return value["kinematic_sin"] * np.sin(angle) + value["kinematic_cos"] * np.cos(angle)


def dissipation(rig: Rig, m: Motion) -> float:
    """Power lost in base, gears and motors, without dynamic friction and stiction."""
    power = 0.0
    if rig.transducer.damping is not None:
        power += rig.transducer.damping.value @ m.rates[:3] ** 2
    for i, joint in enumerate(rig.joints):
        value = {name: float(q) for name, q in joint.drive.parameters.items()}
        ahead, behind = (gear_error(value, m.theta[i] + s * H) for s in (1, -1))
        slip = m.rotor_rates[i] * (1.0 / float(joint.drive.ratio) + (ahead - behind) / (2 * H)) - m.rates[3 + i]
        power += value["fsv"] * slip**2 + value["b_m"] * m.rotor_rates[i] ** 2
    return float(power)
