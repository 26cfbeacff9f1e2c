"""Friction of the motor that grows otherwise than in proportion to its rate: churning, or a lubricant that thins."""

from __future__ import annotations

import math

from kbs_process.plant.effect import Effect, LogNormal, Normal, Parameter, Port, amplitude


def torque(rotor_rate: float, churning: float, churning_power: float, churning_rate: float) -> float:
    r"""Torque on the rotor by a power of its rate.

    Equation: $T = -T_n |\omega_r / \omega_0|^{n-1} \omega_r / \omega_0$.
    Units: rad/s, N m, 1, rad/s -> N m.
    Validity: n >= 1 without a jump at rest; n < 1 for shear thinning, above rest. n = 1 is `motor_viscous`.
    Source: A. C. Bittencourt, S. Gunnarsson, Static friction in a robot joint: modeling and identification of load and
        temperature effects, J. Dynamic Systems, Measurement, and Control 134 (2012) 051013.
    """
    share = rotor_rate / churning_rate
    return -churning * math.exp((churning_power - 1.0) * math.log(max(abs(share), 1e-6))) * share


MOTOR_DRAG = Effect(
    "motor_drag",
    Port.MOTOR_TORQUE,
    torque,
    (
        amplitude("churning", "N m", Normal(0.0, 5e-3), "at the rate of reference", 1.0),
        Parameter("churning_power", "1", Normal(2.0, 0.5), "its power", (0.2, 5.0), grid=(0.5, 2.0, 3.0)),
        Parameter("churning_rate", "rad/s", LogNormal(1.0, 0.5), "rate of reference", (1e-3, 1e3)),
    ),
    passive=True,
    family="viscous",
    order=170,
)
