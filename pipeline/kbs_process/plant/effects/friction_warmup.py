"""Viscous friction that falls as the lubricant warms up."""

from __future__ import annotations

import math

from kbs_process.plant.effect import Effect, LogNormal, Normal, Parameter, Port


def torque(rotor_rate: float, time: float, warmup: float, warmup_time: float) -> float:
    r"""Torque on the rotor by the viscous friction that is still there before the drive is warm.

    Equation: $T = -b_w e^{-t/\tau} \omega_r$.
    Units: rad/s, s, N m s/rad, s -> N m.
    Validity: from a start at t = 0; what remains for long is the motor's own viscous friction.
    Source: A. C. Bittencourt, S. Gunnarsson, Static friction in a robot joint: modeling and identification of load and
        temperature effects, J. Dynamic Systems, Measurement, and Control 134 (2012) 051013.
    """
    return -warmup * math.exp(-max(time, 0.0) / warmup_time) * rotor_rate


FRICTION_WARMUP = Effect(
    name="friction_warmup",
    port=Port.MOTOR_TORQUE,
    equation=torque,
    parameters=(
        Parameter(
            "warmup", "N m s/rad", Normal(0.0, 1e-3), "viscous friction lost", (-0.1, 0.1), role="amplitude"
        ),
        Parameter(
            "warmup_time",
            "s",
            LogNormal(120.0, 1.0),
            "time constant of warming up",
            (1.0, 1e5),
            grid=(20.0, 60.0, 180.0, 600.0),
        ),
    ),
    reference="A. C. Bittencourt, S. Gunnarsson, Static friction in a robot joint, J. Dynamic Systems, Measurement, "
    "and Control 134 (2012) 051013",
)
