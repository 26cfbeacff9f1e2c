"""Friction of the motor that differs with the sense of rotation."""

from __future__ import annotations

from kbs_process.plant.effect import Effect, LogNormal, Normal, Parameter, Port, amplitude


def torque(rotor_rate: float, sense_level: float, sense_slope: float, sense_start: float) -> float:
    r"""Torque on the rotor by half the difference of its friction ahead and astern.

    Equation: $T = -T_a \min(|\omega_r| / \omega_0, 1) - b_a |\omega_r|$.
    Units: rad/s, N m, N m s/rad, rad/s -> N m.
    Validity: a difference alone is not passive; with a mean friction above it the sum is. A recording that turns
        one way shows the sum alone.
    Source: B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, A survey of models, analysis tools and compensation
        methods for the control of machines with friction, Automatica 30 (1994) 1083.
    """
    speed = abs(rotor_rate)
    return -sense_level * min(speed / sense_start, 1.0) - sense_slope * speed


MOTOR_ASYMMETRY = Effect(
    "motor_asymmetry",
    Port.MOTOR_TORQUE,
    torque,
    (
        amplitude("sense_level", "N m", Normal(0.0, 5e-3), "of Coulomb friction", 1.0, dry=True),
        amplitude("sense_slope", "N m s/rad", Normal(0.0, 1e-3), "of viscous friction", 0.1),
        Parameter("sense_start", "rad/s", LogNormal(0.05, 0.5), "rate of full friction", (1e-4, 10.0)),
    ),
    either_sign=True,
    family="friction",
    order=160,
)
