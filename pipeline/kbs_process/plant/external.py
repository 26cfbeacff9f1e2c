"""What the laboratory's forces do to the wrench and to the drives' efforts: it is the rig's, not the article's."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kbs_process.plant.effect import POINT_SIGNALS, VELOCITIES, Effect, Port
from kbs_process.plant.rigid import LinkMotion, kinematics, links_beyond
from kbs_process.plant.structure import external_of
from kbs_process.rig.model import TRANSDUCER, Rig
from kbs_process.signals.frames import cross, from_xyz, rotate
from kbs_process.signals.records import Array

_MOTION = ("x", "y", "z", "vx", "vy", "vz")
_SAG_ROUNDS = 4  # each takes the error down by weight * height / stiffness, 1 % on the paper's rig


def external_wrench(rig: Rig, effects: Sequence[Effect], q: Array, rates: Array | None = None) -> Array:
    r"""Change (n, 6) of the wrench on the transducer, about T's origin, in T, by the forces among `effects`.

    Equation: $W(f) - W(0)$ at joint angles q and rates (n, joints; at rest without), where T's plate gives way by
        $\alpha = K^{-1} M$, about x, then y, then z: $F = Q^T (m g + f(Q r, v))$,
        $M = h \times Q^T m g + r \times Q^T f(Q r, v)$, with r the force's point, v its velocity, and h the first
        moment of mass over m, in the plate's axes that Q($\alpha$) turns.
    Units: rad, rad/s -> N, N m.
    Validity: at time 0; gears do not yield, and the plate's own rates add nothing to v. Without rates, what is left out
        in motion is the force's damping.
    """
    beyond = links_beyond(rig)
    forces = [effect for effect in _forces(effects) if external_of(rig, effect).on in beyond]
    if not forces:
        return np.zeros((len(q), 6))
    links = kinematics(rig, q, np.zeros_like(q) if rates is None else rates, np.zeros_like(q))
    loaded = _wrench(rig, links, forces)
    change: Array = loaded - _wrench(rig, links, ())
    return change


def pulls_at_rest(effect: Effect) -> bool:
    """Whether an effect is a force that may act on a point at rest: one that only brakes its motion is none there."""
    asked = POINT_SIGNALS.keys() & set(effect.arguments)
    brakes = effect.passive and asked <= VELOCITIES
    return effect.port is Port.EXTERNAL_FORCE and not brakes


def external_efforts(rig: Rig, effects: Sequence[Effect], q: Array, rates: Array) -> Array:
    r"""What the drives put in against the forces among `effects` to move as they do, (n, joints), N m or N.

    Equation: $\Delta \tau_j = -e_j \cdot (r - p_j) \times f$ of a joint that turns about $e_j$ through $p_j$,
        $-e_j \cdot f$ of one that slides, for each force on a link that the joint carries.
    Validity: as `external_wrench`, of a transducer that does not give way.
    """
    efforts = np.zeros(q.shape)
    links = kinematics(rig, q, rates, np.zeros_like(q))
    R_LT = links[TRANSDUCER].R
    for effect in _forces(effects):
        external = external_of(rig, effect)
        assert external.point is not None
        link = links[external.on]
        place = link.r + rotate(link.R, external.point.value)
        f = rotate(R_LT, _force(rig, effect, links, _point(links, external.on, external.point.value)))
        for index, joint in enumerate(rig.joints):
            if external.on in links_beyond(rig, joint.name):
                turn, slide = joint.screw
                along = turn * cross(place - links[joint.name].r, f) + slide * f
                efforts[:, index] -= np.sum(links[joint.name].axis * along, axis=1)
    return efforts


def _forces(effects: Sequence[Effect]) -> list[Effect]:
    return [effect for effect in effects if effect.port is Port.EXTERNAL_FORCE]


def _wrench(rig: Rig, links: dict[str, LinkMotion], forces: Sequence[Effect]) -> Array:
    """Static wrench of weight and forces in the axes of the plate that gives way to both."""
    T = links[TRANSDUCER]
    R_TL = np.swapaxes(T.R, 1, 2)
    mass, first_moment = 0.0, np.zeros_like(T.r)
    for body in rig.bodies:
        if body.on in links_beyond(rig):
            mass += float(body.mass)
            first_moment += float(body.mass) * _point(links, body.on, body.cog.value)
    gravity = -rotate(R_TL, T.accel)
    stiffness = rig.transducer.stiffness
    wrench = np.zeros((len(T.r), 6))
    for _ in range(1 if stiffness is None else _SAG_ROUNDS):
        sag = np.zeros_like(T.r) if stiffness is None else wrench[:, 3:] / stiffness.value
        Q = from_xyz(sag)
        Q_t = np.swapaxes(Q, 1, 2)
        falling = rotate(Q_t, gravity)
        force, moment = mass * falling, cross(first_moment, falling)
        for effect in forces:
            external = external_of(rig, effect)
            assert external.point is not None
            r = _point(links, external.on, external.point.value)
            f = rotate(Q_t, _force(rig, effect, links, rotate(Q, r)))
            force, moment = force + f, moment + cross(r, f)
        wrench = np.concatenate([force, moment], axis=1)
    return wrench


def _point(links: dict[str, LinkMotion], on: str, place: Array) -> Array:
    """A link's point (n, 3) from T's origin, in the axes of T's plate."""
    T, link = links[TRANSDUCER], links[on]
    return rotate(np.swapaxes(T.R, 1, 2), link.r + rotate(link.R, place) - T.r)


def _velocity(links: dict[str, LinkMotion], on: str, place: Array) -> Array:
    """Velocity (n, 3) of a link's point in the laboratory, along T's axes."""
    link = links[on]
    return rotate(np.swapaxes(links[TRANSDUCER].R, 1, 2), link.v + cross(link.omega, rotate(link.R, place)))


def _force(rig: Rig, effect: Effect, links: dict[str, LinkMotion], r: Array) -> Array:
    """The force (n, 3) at r (n, 3), its velocity that of its place on its link, along the undeflected T's axes."""
    external = external_of(rig, effect)
    assert external.point is not None
    known = dict.fromkeys(POINT_SIGNALS, 0.0)
    known |= {name: float(quantity) for name, quantity in external.parameters.items()}
    moved = np.hstack([r, _velocity(links, external.on, external.point.value)]).tolist()
    return np.array([effect.value(known | dict(zip(_MOTION, row, strict=True))) for row in moved])
