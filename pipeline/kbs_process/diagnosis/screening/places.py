"""Where on a link a force of the laboratory acts, as long as nobody says so."""

from __future__ import annotations

import numpy as np

from kbs_process.plant.effect import Effect
from kbs_process.plant.rigid import inertia_matrix
from kbs_process.rig.model import Rig
from kbs_process.signals.records import Array

Place = tuple[float, float, float]  # m, in the link's axes
POINT = ("point_x", "point_y", "point_z")  # how a find's estimates name what was fitted of it


def points_of(effect: Effect, rig: Rig, link: str) -> tuple[Place | None, ...]:
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
