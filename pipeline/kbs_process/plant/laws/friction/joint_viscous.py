"""Viscous friction of a joint's bearings."""

from __future__ import annotations

from kbs_process.plant.effect import Effect, Normal, Parameter, Port


def torque(joint_rate: float, joint_viscous: float) -> float:
    r"""Torque on the output, reacted by the body that carries the motor.

    Equation: $T = -b \omega_l$.
    Units: rad/s, N m s/rad -> N m.
    Validity: full lubrication, constant temperature.
    Source: B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, A survey of models, analysis tools and compensation
        methods for the control of machines with friction, Automatica 30 (1994) 1083.
    """
    return -joint_viscous * joint_rate


JOINT_VISCOUS = Effect(
    name="joint_viscous",
    order=230,
    port=Port.JOINT_TORQUE,
    equation=torque,
    parameters=(
        Parameter("joint_viscous", "N m s/rad", Normal(0.0, 10.0), "viscous friction", (-1e4, 1e4), role="amplitude"),
    ),
    reference="B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, A survey of models, analysis tools and "
    "compensation methods for the control of machines with friction, Automatica 30 (1994) 1083",
    passive=True,
)
