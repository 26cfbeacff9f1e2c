"""Mass that lies elsewhere once the mechanism has turned past some angle: something loose, a fluid, a slack harness."""

from __future__ import annotations

import math

from kbs_process.plant.effect import Effect, Normal, Port, amplitude
from kbs_process.plant.laws.position.place import place, width


def torque(joint_angle: float, shift_sin: float, shift_cos: float, shift_angle: float, shift_width: float) -> float:
    r"""Moment of its weight about the joint's axis, on the output: the laboratory's gravity reacts it.

    Equation: $T = (a \sin\theta_l + b \cos\theta_l) (1 + \tanh((\theta_l - \theta_0) / w)) / 2$.
    Units: rad, N m, N m, rad, rad -> N m.
    Validity: a joint whose axis is not along gravity; the mass is small beside its link's and moves slowly, so that its
        inertia and what it does about other axes are left out. $a^2 + b^2 = (m g d)^2$, d being how far it moves.
    Source: H. Goldstein, Classical Mechanics (1980), section 1.2: moment of a weight.
    """
    moved = 0.5 * (1.0 + math.tanh((joint_angle - shift_angle) / shift_width))
    return (shift_sin * math.sin(joint_angle) + shift_cos * math.cos(joint_angle)) * moved


MASS_SHIFT = Effect(
    "mass_shift",
    Port.GROUND_TORQUE,
    torque,
    (
        amplitude("shift_sin", "N m", Normal(0.0, 0.5), "with its sine", 100.0),
        amplitude("shift_cos", "N m", Normal(0.0, 0.5), "with the angle's cosine", 100.0),
        place("shift_angle", "angle at which it moves", 10),
        width("shift_width", "over which it moves", 0.1, (0.05, 0.15)),
    ),
    of_weight=True,
    apart="mass properties",
    family="mass",
    order=380,
)
