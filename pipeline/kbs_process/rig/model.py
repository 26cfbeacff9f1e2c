"""The rig: a serial chain of joints and bodies on (or under) a six-component transducer.

A rig is data. It names links: the laboratory `lab`, the transducer's top plate `T`, and one link a
joint, called like the joint. Each joint turns its link about `axis` with respect to its parent, or slides it
along; bodies are fixed to links. A pointing mechanism on a test bench is lab -> T -> az -> el; an instrumented
wheel, whose transducer turns with it, is lab -> wheel -> T; a linear axis without a transducer is lab -> axis.

Its loads are what it is measured by. The wrench is what everything beyond T (seen from the laboratory) exerts on the
transducer; the effort of a joint is what its drive puts into it.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, fields, is_dataclass, replace
from typing import Literal

import numpy as np

from kbs_process.signals.records import WRENCH_CHANNELS, WRENCH_UNITS, Array

LAB = "lab"
TRANSDUCER = "T"
JointType = Literal["revolute", "prismatic"]
COORDINATE: dict[JointType, str] = {"revolute": "rad", "prismatic": "m"}  # unit of a joint's coordinate


def unit_of(joint: JointType, turning: str) -> str:
    """Return what the unit `turning` of a joint that turns is for a joint: N s/m of one that slides, for N m s/rad."""
    return turning if joint == "revolute" else turning.replace("N m", "N").replace("rad", "m")


@dataclass(frozen=True, slots=True, eq=False)
class Quantity:
    """A physical number or array in SI units, with its standard uncertainty and where it comes from."""

    name: str  # dotted path in the parameter files: "joint.el.drive.Ka"
    value: Array  # shape () or (n,) or (n, m)
    unit: str  # SI
    sigma: Array  # same shape, one standard deviation; 0 is exact by definition
    source: str
    low: Array | float = -np.inf  # least that a fit may make of it, for all elements or each: a mass is never negative

    def __post_init__(self) -> None:
        # Arithmetic on an array without dimensions leaves a scalar, which cannot be indexed by a mask.
        object.__setattr__(self, "value", np.asarray(self.value, dtype=np.float64))
        object.__setattr__(self, "sigma", np.asarray(self.sigma, dtype=np.float64))
        object.__setattr__(self, "low", np.broadcast_to(np.asarray(self.low, dtype=np.float64), self.value.shape))

    def __float__(self) -> float:
        return float(self.value)

    @property
    def shape(self) -> tuple[int, ...]:
        return self.value.shape


@dataclass(frozen=True, slots=True, eq=False)
class Body:
    """A rigid body fixed to a link; its numbers are in that link's axes."""

    name: str
    on: str  # link
    mass: Quantity  # kg
    cog: Quantity  # (3,) m, from the link's origin
    inertia: Quantity  # (6,) kg m^2, tensor elements about its CoG: xx, yy, zz, xy, xz, yz


@dataclass(frozen=True, slots=True, eq=False)
class Encoder:
    """An absolute encoder on a joint: reading = round((angle + offset) / step) * step."""

    step: Quantity  # rad, one code; 0 is unquantised
    offset: Quantity  # rad


@dataclass(frozen=True, slots=True, eq=False)
class Drive:
    """Motor and gearbox of a joint; `parameters` are those that the effects of the plant ask for by name."""

    ratio: Quantity  # R
    rotor_inertia: Quantity  # kg m^2
    steps_per_turn: Quantity  # microsteps of the field in a motor turn
    parameters: dict[str, Quantity]


@dataclass(frozen=True, slots=True, eq=False)
class Effort:
    """What the drive puts into a joint, as it is recorded: reading = effort / gain + bias + noise.

    A current's gain is the torque constant, a voltage's that of the amplifier and motor together; a force or torque
    that is recorded as such has a gain of 1.
    """

    unit: str  # of the reading
    gain: Quantity  # N (N m where the joint turns) a unit of the reading
    bias: Quantity  # in the reading's unit, as the three below
    noise: Quantity  # rms a sample at the recorded rate
    resolution: Quantity


@dataclass(frozen=True, slots=True, eq=False)
class Joint:
    """A joint along or about `axis` (parent's axes): its link turns by the joint's angle, right-handed, or slides.

    What is an angle in rad of a revolute joint is a way in m of a prismatic one, and N m are N.
    """

    name: str
    parent: str  # "lab", "T" or another joint
    axis: tuple[float, float, float]  # unit vector
    origin: Quantity  # (3,) m, the link's origin in the parent's axes
    misalignment: Quantity  # (3,) rad, small rotation of the axis with respect to the parent
    encoder: Encoder | None
    drive: Drive | None
    type: JointType = "revolute"
    viscous: Quantity | None = None  # N m s/rad, viscous friction between parent and link
    effort: Effort | None = None  # None: nobody measures it

    @property
    def screw(self) -> tuple[float, float]:
        """Turn about the axis (rad) and slide along it (m) of a unit of the joint's coordinate."""
        return (1.0, 0.0) if self.type == "revolute" else (0.0, 1.0)

    @property
    def unit(self) -> str:
        """Unit of the joint's coordinate."""
        return COORDINATE[self.type]

    def unit_of(self, turning: str) -> str:
        """What is the unit `turning` of a joint that turns, for this one: see `unit_of`."""
        return unit_of(self.type, turning)


@dataclass(frozen=True, slots=True, eq=False)
class Amplifier:
    """The transducer's anti-alias low-pass: Butterworth of `order` with its corner at `corner` Hz."""

    order: int
    corner: Quantity  # Hz

    @property
    def delay(self) -> float:
        """Group delay (s) well below the corner: 1 / (2 pi corner sin(pi / (2 order))); at a tenth of it, 1 % more."""
        return float(1.0 / (2.0 * np.pi * float(self.corner) * np.sin(np.pi / (2 * self.order))))


@dataclass(frozen=True, slots=True, eq=False)
class Transducer:
    """raw = (I + cross_coupling) wrench + bias + noise, quantised to `resolution`."""

    on: str  # "lab" or a joint
    channels: tuple[str, ...]  # those recorded, a subset of WRENCH_CHANNELS; none on a rig without a transducer
    tilt: Quantity  # (2,) rad, tx about x and ty about y
    stiffness: Quantity | None  # (3,) N m/rad about x, y, z; None: rigid
    damping: Quantity | None  # (3,) N m s/rad
    cross_coupling: Quantity  # (6, 6)
    bias: Quantity  # (6,)
    noise: Quantity  # (6,) rms a sample at the recorded rate
    resolution: Quantity  # (6,)
    amplifier: Amplifier | None


@dataclass(frozen=True, slots=True, eq=False)
class External:
    """What the laboratory does to the rig besides carrying it; `name` is that of the plant's effect."""

    name: str
    on: str  # link, or "lab" for what moves the floor
    point: Quantity | None  # (3,) m in the link's axes, from its origin: where a force acts
    parameters: dict[str, Quantity]  # those that the effect asks for by name


def no_transducer() -> Transducer:
    """Return what stands for the transducer of a rig that has none: a level plate in the laboratory, not recorded."""

    def zero(name: str, *shape: int) -> Quantity:
        return Quantity(f"transducer.{name}", np.zeros(shape), "", np.zeros(shape), "there is no transducer")

    return Transducer(
        on=LAB,
        channels=(),
        tilt=zero("tilt", 2),
        stiffness=None,
        damping=None,
        cross_coupling=zero("cross_coupling", 6, 6),
        bias=zero("bias", 6),
        noise=zero("noise", 6),
        resolution=zero("resolution", 6),
        amplifier=None,
    )


@dataclass(frozen=True, slots=True, eq=False)
class Controller:
    """The pointing controller; gains may differ from joint to joint."""

    cycle: Quantity  # s, real-time cycle
    loop: Literal["open", "closed"]
    Kp: Quantity  # (joints,)
    Ki: Quantity  # (joints,) 1/s
    latency: int  # cycles
    acceleration: Quantity | None = None  # (joints,) rad/s^2, greatest, with which it stops
    lowest: Quantity | None = None  # (joints,) rad, ends of the range within which it stops
    highest: Quantity | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Spacecraft:
    """Where the wrench is referred to: centre of mass and attitude with respect to T."""

    position: Quantity  # (3,) m, of the centre of mass from T's origin, in T
    attitude: Quantity  # (3,) rad, rotation vector that turns T's axes into S's


@dataclass(frozen=True, slots=True, eq=False)
class Inertial:
    """An accelerometer or a gyro: three axes on a link."""

    on: str  # link
    attitude: Quantity  # (3,) rad, rotation vector that turns the link's axes into its own
    noise: Quantity  # rms a sample
    position: Quantity | None = None  # (3,) m in the link's axes, from its origin; of no matter to a gyro


@dataclass(frozen=True, slots=True, eq=False)
class Loads:
    """All loads of a rig in one order: the six components of the wrench, then the effort of each joint, as read."""

    channels: tuple[str, ...]
    units: tuple[str, ...]  # "" of an effort that is not measured
    bias_sigma: Array  # (6 + joints,), prior of a recording's zero
    noise: Array  # (6 + joints,), rms a sample at the recorded rate

    def index(self, channels: Iterable[str]) -> list[int]:
        """Return where `channels` stand."""
        return [self.channels.index(channel) for channel in channels]


@dataclass(frozen=True, slots=True, eq=False)
class Rig:
    """Everything about the hardware that the pipeline knows."""

    gravity: Quantity  # m/s^2, magnitude; 0 in flight
    transducer: Transducer
    bodies: tuple[Body, ...]
    joints: tuple[Joint, ...]  # from the laboratory outwards
    controller: Controller | None
    spacecraft: Spacecraft | None
    external: tuple[External, ...] = ()
    instruments: dict[str, Inertial] = field(default_factory=dict)  # by the stream that they are recorded in

    @property
    def joint_names(self) -> tuple[str, ...]:
        return tuple(joint.name for joint in self.joints)

    def joint(self, name: str) -> Joint:
        """Return the joint of that name."""
        return next(joint for joint in self.joints if joint.name == name)

    @property
    def loads(self) -> Loads:
        """Return every load that the rig's inverse dynamics gives, measured or not."""
        efforts = [joint.effort for joint in self.joints]
        t = self.transducer

        def full(wrench: Array, of: Callable[[Effort], Array]) -> Array:
            return np.append(wrench, [0.0 if effort is None else float(of(effort)) for effort in efforts])

        return Loads(
            channels=(*WRENCH_CHANNELS, *(f"{joint.name}.effort" for joint in self.joints)),
            units=(*WRENCH_UNITS, *("" if effort is None else effort.unit for effort in efforts)),
            bias_sigma=full(t.bias.sigma, lambda effort: effort.bias.sigma),
            noise=full(t.noise.value, lambda effort: effort.noise.value),
        )

    @property
    def channels(self) -> tuple[str, ...]:
        """Return the loads that are recorded: the transducer's channels, then the joints' efforts."""
        measured = (f"{joint.name}.effort" for joint in self.joints if joint.effort is not None)
        return (*self.transducer.channels, *measured)

    @property
    def frame(self) -> str:
        """Return the frame of the recorded loads: the transducer's, or the joints' own where there is none."""
        return TRANSDUCER if self.transducer.channels else "joint"

    @property
    def inertias(self) -> dict[str, Array]:
        """Return every body's inertia tensor (6,) by its dotted name."""
        return {body.inertia.name: body.inertia.value for body in self.bodies}

    def quantities(self) -> dict[str, Quantity]:
        """Return every quantity of the article and what carries it by its dotted name, the instruments' not.

        A transducer that is not there has none.
        """
        absent = ("instruments", *(() if self.transducer.channels else ("transducer",)))
        parts = tuple(getattr(self, entry.name) for entry in fields(self) if entry.name not in absent)
        return {quantity.name: quantity for quantity in _walk(parts)}


def _walk(node: object) -> Iterator[Quantity]:
    if isinstance(node, Quantity):
        yield node
    elif isinstance(node, dict):
        for value in node.values():
            yield from _walk(value)
    elif isinstance(node, tuple):
        for value in node:
            yield from _walk(value)
    elif is_dataclass(node):
        for entry in fields(node):
            yield from _walk(getattr(node, entry.name))


def substitute(rig: Rig, values: dict[str, Array | float], sigmas: dict[str, Array | float] | None = None) -> Rig:
    """Return `rig` with new values (and sigmas, where given) for some quantities, named by dotted path.

    Raises KeyError for a name that the rig does not have and ValueError for a value of another shape.
    """
    met = set[str]()
    replaced = _substitute(rig, values, sigmas or {}, met)
    if met != values.keys():
        raise KeyError(f"the rig has no {sorted(values.keys() - met)}")
    assert isinstance(replaced, Rig)
    return replaced


def _substitute(
    node: object, values: dict[str, Array | float], sigmas: dict[str, Array | float], met: set[str]
) -> object:
    """Return the node itself where nothing of it changes; add the names that were `met`."""
    if isinstance(node, Quantity):
        if node.name not in values:
            return node
        met.add(node.name)
        value = np.asarray(values[node.name], dtype=float)
        sigma = np.asarray(sigmas.get(node.name, node.sigma), dtype=float)
        if value.shape != node.shape or sigma.shape != node.shape:
            raise ValueError(f"{node.name} has shape {node.shape}, not {value.shape}")
        return replace(node, value=value, sigma=sigma)
    if isinstance(node, dict):
        return {key: _substitute(value, values, sigmas, met) for key, value in node.items()}
    if isinstance(node, tuple):
        changed = tuple(_substitute(value, values, sigmas, met) for value in node)
        return node if all(map(operator.is_, changed, node)) else changed
    if is_dataclass(node) and not isinstance(node, type):
        old = {entry.name: getattr(node, entry.name) for entry in fields(node)}
        new = {name: _substitute(value, values, sigmas, met) for name, value in old.items()}
        return node if all(map(operator.is_, new.values(), old.values())) else type(node)(**new)
    return node
