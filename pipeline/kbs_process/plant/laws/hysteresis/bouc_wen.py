"""Bouc and Wen's law: what is elastic after a reversal and yields; across a joint, under the plate."""

from __future__ import annotations

import math

from kbs_process.plant.effect import Effect, LogNormal, Normal, Parameter, Port, State, amplitude


def slipping(rate: float, slip: float, power: float) -> float:
    """Rate of a slip, a share of its greatest, times the angle over which it would be reached."""
    deflection = abs(slip)
    yielded = 0.5 * math.exp((power - 1.0) * math.log(max(deflection, 1e-9)))
    return rate - yielded * (abs(rate) * slip + rate * deflection)


def of_joint(
    joint_rate: float, slip: float, slip_torque: float, slip_angle: float, slip_power: float
) -> tuple[float, float]:
    r"""Torque on the output, reacted by the body that carries the motor: wires that slide, a seal, a cable drum.

    Equation: $T = -T_s z$, $\dot z = (\omega_l - \frac{1}{2} |z|^{n-1} (|\omega_l| z + \omega_l |z|)) / x_0$.
    Units: rad/s, 1, N m, rad, 1 -> N m, 1/s.
    Validity: does not depend on rate; |z| <= 1; n >= 1, from strands that yield one after the other to a single stop.
        Elastic after each reversal until z = 0. Over angles that bearings roll through: within these it is `dahl`. The
        greatest rate in a step has to stay below x0.
    Source: Y. K. Wen, Method for random vibration of hysteretic systems, J. Engineering Mechanics Division ASCE 102
        (1976) 249, with equal shape factors.
    """
    return -slip_torque * slip, slipping(joint_rate, slip, slip_power) / slip_angle


def of_mounting(
    base_rate_x: float,
    base_rate_y: float,
    base_rate_z: float,
    base_slip_x: float,
    base_slip_y: float,
    base_slip_z: float,
    base_loop_x: float,
    base_loop_y: float,
    base_loop_z: float,
    base_slip_angle: float,
    base_slip_power: float,
) -> tuple[float, float, float, float, float, float]:
    r"""Moment of the mounting on the plate, about each axis by what the plate has turned about it.

    Bolted joints slip by microns, plates rub, before they hold again.

    Equation: $M_i = -M_{s,i} z_i$,
        $\dot z_i = (\dot\alpha_i - \frac{1}{2} |z_i|^{n-1} (|\dot\alpha_i| z_i + \dot\alpha_i |z_i|)) / \alpha_s$
        for i = x, y, z.
    Units: rad/s, 1, N m, rad, 1 -> N m, 1/s.
    Validity: does not depend on rate; |z| <= 1; n >= 1, from asperities that yield one after the other to a single
        stop; no axis acts on another. Elastic after each reversal until z = 0. The greatest rate in a step has to stay
        below the angle of slip, and the stiffness before it, $M_{s,i} / \alpha_s$, within what the step resolves.
    Source: Y. K. Wen, Method for random vibration of hysteretic systems, J. Engineering Mechanics Division ASCE 102
        (1976) 249, with equal shape factors; L. Gaul, R. Nitsche, The role of friction in mechanical joints, Applied
        Mechanics Reviews 54 (2001) 93.
    """
    return (
        -base_loop_x * base_slip_x,
        -base_loop_y * base_slip_y,
        -base_loop_z * base_slip_z,
        slipping(base_rate_x, base_slip_x, base_slip_power) / base_slip_angle,
        slipping(base_rate_y, base_slip_y, base_slip_power) / base_slip_angle,
        slipping(base_rate_z, base_slip_z, base_slip_power) / base_slip_angle,
    )


_YIELDS, _SHARPNESS = "angle over which it yields, had it stayed elastic", "sharpness of yielding"

JOINT_HYSTERESIS = Effect(
    "joint_hysteresis",
    Port.JOINT_TORQUE,
    of_joint,
    (
        amplitude("slip_torque", "N m", Normal(0.0, 0.5), "half height of the loop", 100.0, dry=True),
        Parameter("slip_angle", "rad", LogNormal(0.03, 1.0), _YIELDS, (5e-3, 3.0), grid=(0.01, 0.03, 0.1)),
        Parameter("slip_power", "1", LogNormal(1.5, 0.3), _SHARPNESS, (1.0, 5.0), grid=(1.5,)),
    ),
    states=(State("slip", "1", 0.0, "share of the loop's half height"),),
    family="hysteresis",
    order=320,
)
BASE_HYSTERESIS = Effect(
    "base_hysteresis",
    Port.BASE_TORQUE,
    of_mounting,
    (
        amplitude("base_loop_x", "N m", Normal(0.0, 0.2), "half height of the loop about x", 100.0, dry=True),
        amplitude("base_loop_y", "N m", Normal(0.0, 0.2), "about y", 100.0, dry=True),
        amplitude("base_loop_z", "N m", Normal(0.0, 0.2), "about z", 100.0, dry=True),
        Parameter(
            "base_slip_angle",
            "rad",
            LogNormal(2e-5, 1.0),
            _YIELDS,
            (1e-6, 1e-3),
            grid=tuple(3e-6 * 2.4**i for i in range(5)),
        ),
        Parameter("base_slip_power", "1", LogNormal(1.5, 0.3), _SHARPNESS, (1.0, 5.0), grid=(1.5, 3.0)),
    ),
    states=(
        State("base_slip_x", "1", 0.0, "share of the loop's half height about x"),
        State("base_slip_y", "1", 0.0, "about y"),
        State("base_slip_z", "1", 0.0, "about z"),
    ),
    family="hysteresis",
    order=460,
)
