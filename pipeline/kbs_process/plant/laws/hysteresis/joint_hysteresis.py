"""Hysteresis of what is bent across a joint: the wires of a harness that slide on each other, a seal, a cable drum."""

from __future__ import annotations

import math

from kbs_process.plant.effect import Effect, LogNormal, Normal, Parameter, Port, State


def torque(
    joint_rate: float, slip: float, slip_torque: float, slip_angle: float, slip_power: float
) -> tuple[float, float]:
    r"""Torque on the output, reacted by the body that carries the motor.

    Equation: $T = -T_s z$, $\dot z = (\omega_l - \frac{1}{2} |z|^{n-1} (|\omega_l| z + \omega_l |z|)) / x_0$.
    Units: rad/s, 1, N m, rad, 1 -> N m, 1/s.
    Validity: does not depend on rate; |z| <= 1; n >= 1, from strands that yield one after the other to a single stop.
        Elastic after each reversal until z = 0. Over angles that bearings roll through: within these it is `dahl`. The
        greatest rate in a step has to stay below x0.
    Source: Y. K. Wen, Method for random vibration of hysteretic systems, J. Engineering Mechanics Division ASCE 102
        (1976) 249, with equal shape factors.
    """
    deflection = abs(slip)
    yielded = 0.5 * math.exp((slip_power - 1.0) * math.log(max(deflection, 1e-9)))
    rate = joint_rate - yielded * (abs(joint_rate) * slip + joint_rate * deflection)
    return -slip_torque * slip, rate / slip_angle


JOINT_HYSTERESIS = Effect(
    name="joint_hysteresis",
    order=320,
    port=Port.JOINT_TORQUE,
    equation=torque,
    parameters=(
        Parameter(
            "slip_torque",
            "N m",
            Normal(0.0, 0.5),
            "half height of the loop",
            (-100.0, 100.0),
            role="amplitude",
            dry=True,
        ),
        Parameter(
            "slip_angle",
            "rad",
            LogNormal(0.03, 1.0),
            "angle over which it yields, had it stayed elastic",
            (5e-3, 3.0),
            grid=(0.01, 0.03, 0.1),
        ),
        Parameter("slip_power", "1", LogNormal(1.5, 0.3), "sharpness of yielding", (1.0, 5.0), grid=(1.5,)),
    ),
    reference="Y. K. Wen, Method for random vibration of hysteretic systems, J. Engineering Mechanics Division ASCE "
    "102 (1976) 249",
    states=(State("slip", "1", 0.0, "share of the loop's half height"),),
)
