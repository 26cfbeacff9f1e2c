"""Suspects of a rig: what its model leaves out, at every site and with every shape that a search tries."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from kbs_process.diagnosis.screening.inlets import plate_turns
from kbs_process.diagnosis.screening.ranges import Ranges
from kbs_process.plant.along import signals_of
from kbs_process.plant.compiled.taps import plate_column
from kbs_process.plant.effect import ACTIONS, VELOCITIES, Effect, Parameter, Port, instance
from kbs_process.plant.laws import CATALOGUE, SENSING
from kbs_process.plant.rigid import inertia_matrix, links_beyond, poses
from kbs_process.plant.sensing import Sensing, SensingPort
from kbs_process.rig.model import LAB, TRANSDUCER, Joint, Rig
from kbs_process.signals.records import WRENCH_CHANNELS, Array

FLOOR = "floor"
_ALONG_GRAVITY = 0.95  # cosine
Point = tuple[float, float, float]  # m, in the axes of a link
POINT = ("point_x", "point_y", "point_z")  # how a find's estimates name what was fitted of it


@dataclass(frozen=True, slots=True)
class Candidate:
    """One suspect at one site with one choice of its shape.

    `site` is a joint (drives, encoders), a link (forces of the laboratory), the floor, T (its mounting), a channel,
    "Tx", two or three of them ("Tx<-Fz", "Tx<-Fy<-Fz"), or a stream ("wrench", "encoder").
    """

    effect: Effect | Sensing
    site: str
    shape: tuple[tuple[str, float], ...]  # every parameter that is neither an amplitude nor shared
    point: Point | None = None  # of a force: where it acts on the link; None is the CoG
    again: tuple[Candidate, ...] = ()  # further actions of the same law there, as of other orders
    longest: float = np.inf  # s, of the recordings

    @property
    def name(self) -> str:
        """The law's, whichever of its actions this is."""
        return self.effect.name.removesuffix(self.effect.tag)

    @property
    def port(self) -> Port | SensingPort:
        return self.effect.port

    @property
    def amplitudes(self) -> tuple[Parameter, ...]:
        """Parameters that it is linear in, action by action."""
        return self.effect.amplitudes + tuple(entry for other in self.again for entry in other.amplitudes)

    @property
    def actions(self) -> tuple[Candidate, ...]:
        """Each of its actions alone."""
        return (replace(self, again=()), *self.again)


def candidates(
    rig: Rig,
    nominal: Sequence[str],
    ranges: Ranges,
    columns: Sequence[str],
    channels: Sequence[str],
    *,
    accepted: Sequence[str] = (),
    field_recorded: bool = True,
) -> tuple[Candidate, ...]:
    """Every suspect of a rig: what the nominal model leaves out of the plant, then what sensors may do.

    `columns` are those of the signals along which suspects are run, `channels` those of the prediction. An effect among
    the `accepted` that acts at a site already is a suspect there once more, as its next action.
    """
    left_out = [
        effect
        for effect in CATALOGUE
        if effect.name not in nominal and not (effect.recorded and (field_recorded or rig.controller is None))
    ]
    longest = ranges.longest
    plant = [
        Candidate(effect, site, shape, point, longest=longest)
        for law in left_out
        if law.suspected
        for site in _sites(law, rig, columns)
        for effect in [next_action(law, rig, site, accepted)]
        for point in points_of(effect, rig, site)
        for shape in _grid(effect, site, ranges, own_values(rig, site))
    ]
    sensing = [
        Candidate(law, site, shape, longest=longest)
        for law in SENSING
        for site in _sensed_sites(law, rig, channels, ranges)
        for shape in _grid(law, site, ranges, {})
    ]
    return (*plant, *sensing)


def _sites(effect: Effect, rig: Rig, columns: Sequence[str]) -> list[str]:
    if effect.port is Port.BASE_ACCELERATION:
        return [FLOOR] if rig.transducer.channels else []
    if effect.port is Port.BASE_TORQUE:
        return [TRANSDUCER] if plate_turns(rig) and plate_column("x") in columns else []
    if effect.port is Port.EXTERNAL_FORCE:
        # A screen has velocities as T sees them.
        blind = rig.transducer.on != LAB and bool(VELOCITIES & set(effect.arguments))
        return [] if blind else [name for name in rig.joint_names if name in links_beyond(rig)]
    shared = [entry.name for entry in effect.parameters if entry.role == "shared"]
    needed = [name for name in signals_of(effect) if name != "time"]

    reached = felt_from_the_ground(rig)

    def fits(joint: Joint) -> bool:
        if effect.port is Port.GROUND_TORQUE and joint.name not in reached:
            return False
        if effect.of_weight and not weighed(rig, joint):
            return False
        if effect.of_gear and _direct(joint):
            return False  # the motor's orders are the joint's
        own = {} if joint.drive is None else joint.drive.parameters
        turned = joint.drive is not None or "ratio" not in effect.arguments
        return (
            turned and all(name in own for name in shared) and all(f"{name}.{joint.name}" in columns for name in needed)
        )

    return [joint.name for joint in rig.joints if fits(joint)]


def _direct(joint: Joint) -> bool:
    """Whether a motor turns with its joint."""
    return joint.effort is not None if joint.drive is None else float(joint.drive.ratio) == 1.0


def weighed(rig: Rig, joint: Joint) -> bool:
    """Whether weight has a moment about a joint's axis: one that turns and is not along gravity."""
    axis = poses(rig, np.zeros((1, len(rig.joints))))[joint.name].axis
    return joint.type == "revolute" and bool(abs(axis[0, 2]) < _ALONG_GRAVITY)


def felt_from_the_ground(rig: Rig) -> frozenset[str]:
    """Joints of which a torque against the ground shows otherwise than one between their links: in a transducer."""
    return links_beyond(rig) if rig.transducer.channels else frozenset()


def next_action(effect: Effect, rig: Rig, site: str, accepted: Sequence[str]) -> Effect:
    """The effect itself, or its first instance that does not act at the site; the last, where all do."""
    return next(free_actions(effect, rig, site, accepted), instance(effect, ACTIONS))


def free_actions(effect: Effect, rig: Rig, site: str, accepted: Sequence[str]) -> Iterator[Effect]:
    """Of the effect itself and its instances those that do not act at the site."""
    own = own_values(rig, site)
    for number in range(1, ACTIONS + 1):
        action = effect if number == 1 else instance(effect, number)
        amplitudes = [entry.name for entry in action.amplitudes]
        # A drive's effect has numbers at every joint; one of the laboratory acts at a single place.
        here = not action.port.of_drive or any(own.get(name, 0.0) for name in amplitudes)
        if action.name not in accepted or not here:
            yield action


def own_values(rig: Rig, site: str) -> dict[str, float]:
    """Numbers that the rig has for the effects at a site."""
    values: dict[str, float] = {}
    for load in rig.external:
        if load.on == site:
            values |= {name: float(quantity) for name, quantity in load.parameters.items()}
    for joint in rig.joints:
        if joint.name == site and joint.drive is not None:
            values |= {name: float(quantity) for name, quantity in joint.drive.parameters.items()}
    return values


def _grid(
    effect: Effect | Sensing, site: str, ranges: Ranges, own: Mapping[str, float]
) -> Iterator[tuple[tuple[str, float], ...]]:
    """Every choice of an effect's shape; a parameter without a grid is what the rig has, or its prior's middle."""
    shapes = [entry for entry in effect.parameters if entry.role == "shape"]
    # Whichever action of a law it is, its shape's grid has one name.
    grids = [replace(entry, name=entry.name.removesuffix(effect.tag)) for entry in shapes]
    choices = [ranges.choices(grid, site, own.get(entry.name)) for entry, grid in zip(shapes, grids, strict=True)]
    for point in product(*choices):
        yield tuple((entry.name, value) for entry, value in zip(shapes, point, strict=True))


def _sensed_sites(law: Sensing, rig: Rig, channels: Sequence[str], ranges: Ranges) -> list[str]:
    encoders = [name for name in rig.joint_names if name in channels]
    loads = [name for name in channels if name not in encoders]
    if "temperature" in law.arguments and not ranges.temperature:
        return []
    return law.port.sites(loads, [name for name in loads if name in WRENCH_CHANNELS], encoders)


def points_of(effect: Effect, rig: Rig, link: str) -> tuple[Point | None, ...]:
    """Points that a search tries: the CoG, and for a force `anywhere` the faces of the box that is as the link is.

    None, of an effect that acts at no point.
    """
    if effect.port.site != "link":
        return (None,)
    centre = point_of(rig, link)
    points = [centre]
    if effect.anywhere:
        reach = np.diag(half_lengths(rig, link))
        points += [centre + sign * along for along in reach if along.any() for sign in (-1.0, 1.0)]
    return tuple((float(x), float(y), float(z)) for x, y, z in points)


def point_of(rig: Rig, link: str) -> Array:
    """Where a force of the laboratory is taken to act on a link: at the CoG of its bodies, (3,) m in its axes."""
    bodies = [body for body in rig.bodies if body.on == link]
    mass = sum(float(body.mass) for body in bodies)
    if mass == 0.0:
        return np.zeros(3)
    moment = np.sum([float(body.mass) * body.cog.value for body in bodies], axis=0)
    return np.asarray(moment / mass, dtype=np.float64)


def half_lengths(rig: Rig, link: str) -> Array:
    r"""Half the sides (3,) m of the homogeneous box that has a link's mass and its moments of inertia about the CoG.

    Equation: $a_k^2 = 3 P_k / m$, with $P = \tfrac{1}{2} \operatorname{tr}(I)\,1 - I$ the second moments of mass.
    """
    bodies = [body for body in rig.bodies if body.on == link]
    mass = sum(float(body.mass) for body in bodies)
    if mass == 0.0:
        return np.zeros(3)
    second = np.zeros(3)
    for body in bodies:
        inertia = np.diag(inertia_matrix(body.inertia.value))
        second += 0.5 * inertia.sum() - inertia
        second += float(body.mass) * (body.cog.value - point_of(rig, link)) ** 2
    return np.asarray(np.sqrt(np.maximum(3.0 * second / mass, 0.0)), dtype=np.float64)
