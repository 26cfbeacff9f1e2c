"""Backlash of the gear, or a soft zone in place of one."""

from __future__ import annotations

from kbs_process.plant.effect import Effect, LogNormal, Normal, Parameter, Port, amplitude, shared
from kbs_process.plant.laws.gear.flexspline import FLEXSPLINE


def torque(
    rotor_angle: float, joint_angle: float, ratio: float, lost_motion: float, soft_zone: float, Ka: float
) -> float:
    r"""Torque of the gear on the output that is missing because its windup is partly play.

    Equation: $T = -K_a b \max(-1, \min(1, x / x_0))$ with the windup $x = \theta_r/R - \theta_l$. With
        $b = x_0$ it is a dead zone of half width $x_0$; with $b < x_0$ a softer gear about zero torque.
    Units: rad, rad, 1, rad, rad, N m/rad -> N m.
    Validity: $b \le x_0$, else the stiffness about zero is negative. No impacts: the damping acts across the play.
    Source: M. Nordin, P.-O. Gutman, Controlling mechanical systems with backlash, Automatica 38 (2002) 1633.
    """
    windup = rotor_angle / ratio - joint_angle
    return -Ka * lost_motion * max(-1.0, min(1.0, windup / soft_zone))


BACKLASH = Effect(
    "backlash",
    Port.TRANSMISSION,
    torque,
    (
        amplitude("lost_motion", "rad", Normal(0.0, 1e-4), "half the play", (0.0, 0.01)),
        Parameter(
            "soft_zone",
            "rad",
            LogNormal(1e-4, 1.0),
            "windup at which the play is taken up",
            (1e-7, 0.1),
            grid=(1e-5, 5e-5, 2e-4, 8e-4),
        ),
        shared(FLEXSPLINE, "Ka"),
    ),
    family="backlash",
    order=200,
)
