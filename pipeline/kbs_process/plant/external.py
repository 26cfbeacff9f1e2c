"""What the laboratory's forces do to the wrench of an article at rest: it is the rig's, not the article's."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kbs_process.plant.effect import POINT_SIGNALS, Effect, Port
from kbs_process.plant.rigid import LinkMotion, kinematics, links_beyond
from kbs_process.plant.structure import external_of
from kbs_process.rig.model import TRANSDUCER, Rig
from kbs_process.signals.frames import cross, from_xyz, rotate
from kbs_process.signals.records import Array

_SAG_ROUNDS = 4  # each takes the error down by weight * height / stiffness, 1 % on the paper's rig


def external_wrench(rig: Rig, effects: Sequence[Effect], q: Array) -> Array:
    r"""Change (n, 6) of the wrench on the transducer, about T's origin, in T, by the forces among `effects`.

    Equation: $W(f) - W(0)$ at joint angles q (n, joints), where T's plate gives way by $\alpha = K^{-1} M$, about x,
        then y, then z: $F = Q^T (m g + f(Q r))$, $M = h \times Q^T m g + r \times Q^T f(Q r)$, with r the
        force's point and h the first moment of mass over m, in the plate's axes that Q($\alpha$) turns.
    Units: rad -> N, N m.
    Validity: at rest and at time 0; gears do not yield. In motion, what is left out is the force's damping.
    """
    forces = [effect for effect in effects if effect.port is Port.EXTERNAL_FORCE]
    if not forces:
        return np.zeros((len(q), 6))
    links = kinematics(rig, q, np.zeros_like(q), np.zeros_like(q))
    loaded = _wrench(rig, links, forces)
    change: Array = loaded - _wrench(rig, links, ())
    return change


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
            f = rotate(
                Q_t, _force(effect, {n: float(v) for n, v in external.parameters.items()}, rotate(Q, r))
            )
            force, moment = force + f, moment + cross(r, f)
        wrench = np.concatenate([force, moment], axis=1)
    return wrench


def _point(links: dict[str, LinkMotion], on: str, place: Array) -> Array:
    """A link's point (n, 3) from T's origin, in the axes of T's plate."""
    T, link = links[TRANSDUCER], links[on]
    return rotate(np.swapaxes(T.R, 1, 2), link.r + rotate(link.R, place) - T.r)


def _force(effect: Effect, parameters: dict[str, float], r: Array) -> Array:
    """The force (n, 3) on a point at rest at r (n, 3)."""
    rest = dict.fromkeys(POINT_SIGNALS, 0.0) | parameters
    return np.array([effect.value(rest | {"x": x, "y": y, "z": z}) for x, y, z in r.tolist()])
