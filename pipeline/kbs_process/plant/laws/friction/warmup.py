"""Friction that falls as the lubricant warms up."""

from __future__ import annotations

import math

from kbs_process.plant.effect import Effect, LogNormal, Normal, Parameter, Port, amplitude


def torque(
    rotor_rate: float, time: float, warmup: float, warmup_dry: float, warmup_time: float, warmup_rate: float
) -> float:
    r"""Torque on the rotor by the friction that is still there before the drive is warm.

    Equation: $T = -e^{-t/\tau} (b_w \omega_r + T_w \max(-1, \min(1, \omega_r / \omega_0)))$.
    Units: rad/s, s, N m s/rad, N m, s, rad/s -> N m.
    Validity: from a start at t = 0; what remains for long is the motor's own friction. Thick grease drags with the
        rate, seals and starved contacts hardly so.
    Source: A. C. Bittencourt, S. Gunnarsson, Static friction in a robot joint: modeling and identification of load and
        temperature effects, J. Dynamic Systems, Measurement, and Control 134 (2012) 051013.
    """
    resistance = warmup * rotor_rate + warmup_dry * max(-1.0, min(1.0, rotor_rate / warmup_rate))
    return -math.exp(-max(time, 0.0) / warmup_time) * resistance


FRICTION_WARMUP = Effect(
    "friction_warmup",
    Port.MOTOR_TORQUE,
    torque,
    (
        amplitude("warmup", "N m s/rad", Normal(0.0, 1e-3), "viscous friction lost", 0.1),
        amplitude("warmup_dry", "N m", Normal(0.0, 5e-3), "dry friction lost", 1.0, dry=True),
        Parameter(
            "warmup_time",
            "s",
            LogNormal(120.0, 1.0),
            "time constant of warming up",
            (1.0, 1e5),
            grid=(0.1, 0.3, 1.0),
            over="time.span",
        ),
        Parameter("warmup_rate", "rad/s", LogNormal(0.05, 0.2), "rate of full resistance", (1e-4, 10.0)),
    ),
    family="warm-up",
    order=140,
)
