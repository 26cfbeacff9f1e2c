"""Viscous friction of a joint that differs with the sense of rotation."""

from __future__ import annotations

from kbs_process.plant.effect import Effect, Normal, Parameter, Port


def torque(joint_rate: float, viscous_ahead: float, viscous_astern: float) -> float:
    r"""Torque on the output, reacted by the body that carries the motor.

    Equation: $T = -b_+ \max(\omega_l, 0) - b_- \min(\omega_l, 0)$.
    Units: rad/s, N m s/rad, N m s/rad -> N m.
    Validity: full lubrication, constant temperature; a recording that turns one way tells nothing of the other.
    Source: B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, A survey of models, analysis tools and compensation
        methods for the control of machines with friction, Automatica 30 (1994) 1083.
    """
    return -viscous_ahead * max(joint_rate, 0.0) - viscous_astern * min(joint_rate, 0.0)


ASYMMETRIC_VISCOUS = Effect(
    name="asymmetric_viscous",
    order=240,
    port=Port.JOINT_TORQUE,
    equation=torque,
    parameters=(
        Parameter("viscous_ahead", "N m s/rad", Normal(0.0, 10.0), "of positive rates", (-1e4, 1e4), role="amplitude"),
        Parameter("viscous_astern", "N m s/rad", Normal(0.0, 10.0), "of negative rates", (-1e4, 1e4), role="amplitude"),
    ),
    reference="B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, A survey of models, analysis tools and "
    "compensation methods for the control of machines with friction, Automatica 30 (1994) 1083",
    passive=True,
)
