"""What the compiled plant depends on (links, effects, elasticity) and the numbers that fill it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from kbs_process.errors import ConfigError, did_you_mean
from kbs_process.plant.effect import Effect, Port
from kbs_process.rig.model import LAB, TRANSDUCER, Body, External, Joint, Rig
from kbs_process.signals.records import Array

GRAVITY, STIFFNESS, DAMPING, PLATE = 0, 3, 6, 9  # offsets in the parameter vector
JOINTS = 19  # offset of the first joint
AXIS, ORIGIN, TURN, LINK, RATIO, ROTOR, MICROSTEP, FIRST, DRIVE = (
    0, 3, 6, 33, 43, 44, 45, 46, 47
)  # within a joint  # fmt: skip


@dataclass(frozen=True, slots=True)
class Load:
    """An effect of the laboratory on the rig."""

    effect: Effect
    link: int  # joint whose link it acts on; -1 is the top plate, and what is beneath it


@dataclass(frozen=True, slots=True)
class Structure:
    """Shape of a plant: two rigs of equal structure share one compiled module."""

    parents: tuple[int, ...]  # joint whose link carries each joint; -1 is the top plate
    elastic: bool  # the base turns about three axes
    effects: tuple[Effect, ...]  # of every drive
    loads: tuple[Load, ...] = ()

    @property
    def joints(self) -> int:
        return len(self.parents)

    @property
    def stride(self) -> int:
        """Numbers that a joint has in the parameter vector."""
        return DRIVE + sum(len(effect.parameters) for effect in self.effects)

    @property
    def size(self) -> int:
        """Numbers in the parameter vector."""
        loads = sum(3 + len(load.effect.parameters) for load in self.loads)
        return JOINTS + self.joints * self.stride + loads

    @property
    def unknowns(self) -> int:
        """Accelerations that the mass matrix couples; rotors follow from their own torques."""
        return 3 * self.elastic + self.joints

    @property
    def grounded(self) -> bool:
        """Whether a torque on an output is reacted by the laboratory."""
        return any(effect.port is Port.GROUND_TORQUE for effect in self.effects)

    @property
    def crossed(self) -> bool:
        """Whether a drive depends on another joint's motion."""
        return any(effect.crossed for effect in self.effects)

    def other(self, joint: int) -> int:
        """Return the joint that is the other one for an effect of `joint`."""
        return (joint + 1) % self.joints

    @property
    def forces(self) -> tuple[Load, ...]:
        """Forces of the laboratory on points of the rig."""
        return tuple(load for load in self.loads if load.effect.port is Port.EXTERNAL_FORCE)

    @property
    def shakes(self) -> tuple[Load, ...]:
        """What moves the laboratory's floor."""
        return tuple(load for load in self.loads if load.effect.port is Port.BASE_ACCELERATION)

    @property
    def mounts(self) -> tuple[Load, ...]:
        """What the mounting does beyond the transducer's springs."""
        return tuple(load for load in self.loads if load.effect.port is Port.BASE_TORQUE)

    @property
    def mounted(self) -> tuple[float, ...]:
        """Initial values of the mounting's own states."""
        return tuple(state.initial for load in self.mounts for state in load.effect.states)

    def offset(self, load: Load) -> int:
        """Return where the numbers of a load begin in the parameter vector: its point, then its parameters."""
        before = self.loads[: self.loads.index(load)]
        start = JOINTS + self.joints * self.stride
        return start + sum(3 + len(other.effect.parameters) for other in before)

    @property
    def states(self) -> tuple[float, ...]:
        """Initial values of the effects' own states of one drive."""
        return tuple(state.initial for effect in self.effects for state in effect.states)


def other_joint(rig: Rig, joint: str) -> str:
    """Return the joint that is the other one for effects of `joint`: itself, where it is alone."""
    names = rig.joint_names
    return names[(names.index(joint) + 1) % len(names)]


def structure_of(rig: Rig, effects: Sequence[Effect]) -> Structure:
    """Return the structure of a rig whose transducer stands in the laboratory and whose joints are driven."""
    if rig.transducer.on != LAB:
        raise ConfigError(
            f"the transducer turns with '{rig.transducer.on}', and the command-driven plant needs it at rest",
            where="[transducer] on",
            remedy="set on = 'lab', or drive the campaign by its measured motion (drive = 'motion')",
        )
    links = {TRANSDUCER: -1}
    parents: list[int] = []
    for index, joint in enumerate(rig.joints):
        if joint.parent not in links:
            raise ConfigError(
                f"its parent '{joint.parent}' is neither the transducer nor a joint before it",
                where=f"[joint.{joint.name}] parent",
                remedy=did_you_mean(joint.parent, links),
            )
        parents.append(links[joint.parent])
        links[joint.name] = index
    if not any(effect.port is Port.TRANSMISSION for effect in effects):
        raise ConfigError("no effect connects motor and output", where="[model] effects", remedy="add 'flexspline'")
    if len(parents) < 2 and (crossed := next((effect.name for effect in effects if effect.crossed), None)):
        raise ConfigError(
            f"'{crossed}' depends on another joint, and there is one alone",
            where="[model] effects",
            remedy="leave it out",
        )
    elastic = rig.transducer.stiffness is not None
    mounted = next((effect.name for effect in effects if effect.port is Port.BASE_TORQUE), None)
    if mounted is not None and not elastic:
        raise ConfigError(
            f"'{mounted}' acts on the angles of the base, and the transducer is rigid",
            where="[transducer] stiffness",
            remedy="give the transducer's stiffness, or leave the effect out",
        )
    loads = tuple(
        Load(effect, links.get(external_of(rig, effect).on, -1)) for effect in effects if not effect.port.of_drive
    )
    of_drives = tuple(effect for effect in effects if effect.port.of_drive)
    return Structure(tuple(parents), elastic, of_drives, loads)


def external_of(rig: Rig, effect: Effect) -> External:
    """Return what the rig says of an effect of the laboratory; its numbers are complete."""
    where = f"[external.{effect.name}]"
    given = next((entry for entry in rig.external if entry.name == effect.name), None)
    if given is None:
        names = ", ".join(parameter.name for parameter in effect.parameters)
        raise ConfigError(
            f"the model has the effect '{effect.name}', and nothing says where it acts and how large it is",
            where=where,
            remedy=f"add the section to a parameter file, with its parameters {names}, or leave the effect out",
        )
    if effect.port is Port.EXTERNAL_FORCE:
        links = {TRANSDUCER, *rig.joint_names}
        if given.on not in links:
            raise ConfigError(
                f"'{given.on}' is no link that hangs on the transducer",
                where=f"{where} on",
                remedy=did_you_mean(given.on, links),
            )
        if given.point is None:
            raise ConfigError(
                "the force needs a point to act at", where=where, remedy="add point, (x, y, z) in the link's axes"
            )
    for parameter in effect.parameters:
        if parameter.name not in given.parameters:
            raise ConfigError(
                f"'{effect.name}' needs '{parameter.name}' ({parameter.description}, {parameter.unit})",
                where=where,
                remedy=did_you_mean(parameter.name, given.parameters),
            )
    return given


def turn(joint: Joint) -> tuple[Array, Array]:
    """Return the axis in the parent's axes (3,) and P (3, 3, 3) of R(q) = P0 + P1 cos(q) + P2 sin(q).

    Rodrigues' formula behind the misalignment: R(q) = exp(mis) (a a^T + (1 - a a^T) cos q + [a]x sin q).
    """
    a = np.asarray(joint.axis, dtype=float)
    R = Rotation.from_rotvec(joint.misalignment.value.copy()).as_matrix()  # scipy refuses read-only arrays
    along = np.outer(a, a)
    skew = np.cross(np.eye(3), a)
    return R @ a, np.stack([R @ along, R @ (np.eye(3) - along), R @ skew])


def link_inertia(bodies: Sequence[Body]) -> Array:
    """Return (m, h, I) of the bodies of one link about its origin, shape (10,): see `kernels`."""
    total = np.zeros(10)
    for body in bodies:
        m, r = float(body.mass), body.cog.value
        xx, yy, zz, xy, xz, yz = body.inertia.value
        about = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) + m * (r @ r * np.eye(3) - np.outer(r, r))
        total += [m, *(m * r), *np.diag(about), about[0, 1], about[0, 2], about[1, 2]]
    return total


def parameters(rig: Rig, structure: Structure) -> Array:
    """Return every number of the plant as one vector, at the offsets named above."""
    tx, ty = rig.transducer.tilt.value
    p = np.zeros(JOINTS + structure.joints * structure.stride)
    p[GRAVITY : GRAVITY + 3] = float(rig.gravity) * np.array(
        [np.sin(ty), -np.sin(tx) * np.cos(ty), -np.cos(tx) * np.cos(ty)]
    )
    if rig.transducer.stiffness is not None:
        p[STIFFNESS : STIFFNESS + 3] = rig.transducer.stiffness.value
    if rig.transducer.damping is not None:
        p[DAMPING : DAMPING + 3] = rig.transducer.damping.value
    p[PLATE : PLATE + 10] = link_inertia([body for body in rig.bodies if body.on == TRANSDUCER])
    for index, joint in enumerate(rig.joints):
        start = JOINTS + index * structure.stride
        p[start : start + structure.stride] = _joint(rig, joint, structure)
    return np.concatenate([p, *[_external(rig, load) for load in structure.loads]])


def _external(rig: Rig, load: Load) -> Array:
    """Return the numbers of a load: its point, then its parameters in order."""
    given = external_of(rig, load.effect)
    point = np.zeros(3) if given.point is None else given.point.value
    return np.array([*point, *(float(given.parameters[entry.name]) for entry in load.effect.parameters)])


def _joint(rig: Rig, joint: Joint, structure: Structure) -> Array:
    """Return the numbers of one joint: geometry, link, motor, then the effects' parameters in order.

    The field's first position, in microsteps, is that of a schedule.
    """
    drive = joint.drive
    if drive is None:
        raise ConfigError(
            "the command-driven plant needs its drive", where=f"[joint.{joint.name}.drive]", remedy="describe it"
        )
    axis, rotation = turn(joint)
    body = link_inertia([body for body in rig.bodies if body.on == joint.name])
    motor = [float(drive.ratio), float(drive.rotor_inertia), float(drive.steps_per_turn) / (2.0 * np.pi)]
    if not min(motor) > 0.0:
        raise ConfigError(
            "ratio, rotor_inertia and steps_per_turn have to be positive", where=f"[joint.{joint.name}.drive]"
        )
    values = []
    for effect in structure.effects:
        for parameter in effect.parameters:
            if parameter.name not in drive.parameters:
                raise ConfigError(
                    f"'{effect.name}' needs '{parameter.name}' ({parameter.description}, {parameter.unit})",
                    where=f"[joint.{joint.name}.drive.parameters]",
                    remedy=did_you_mean(parameter.name, drive.parameters),
                )
            values.append(float(drive.parameters[parameter.name]))
    return np.concatenate([axis, joint.origin.value, rotation.ravel(), body, motor, [0.0], values])
