"""Viscous friction: of the motor with its eddy currents, of a joint's bearings, of one that differs with the sense."""

from __future__ import annotations

from kbs_process.plant.effect import Effect, LogNormal, Normal, Port, amplitude, wired


def friction(rate: float, damping: float) -> float:
    r"""Torque on the rotor, or on the output, reacted by the body that carries the motor.

    Equation: $T = -b \omega$.
    Units: rad/s, N m s/rad -> N m.
    Validity: full lubrication, constant temperature of the lubricant.
    Source: B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, A survey of models, analysis tools and compensation
        methods for the control of machines with friction, Automatica 30 (1994) 1083; of the motor ENVISAT Ka-band
        subsystem: Measurement and prediction of the performance of a satellite based antenna pointing mechanism and
        controller, Trans. Built Environment 19 (1996), section 5, motor friction.
    """
    return -damping * rate


def asymmetric(joint_rate: float, viscous_ahead: float, viscous_astern: float) -> float:
    r"""Torque on the output, reacted by the body that carries the motor.

    Equation: $T = -b_+ \max(\omega_l, 0) - b_- \min(\omega_l, 0)$.
    Units: rad/s, N m s/rad, N m s/rad -> N m.
    Validity: full lubrication, constant temperature; a recording that turns one way tells nothing of the other.
    Source: B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, A survey of models, analysis tools and compensation
        methods for the control of machines with friction, Automatica 30 (1994) 1083.
    """
    return -viscous_ahead * max(joint_rate, 0.0) - viscous_astern * min(joint_rate, 0.0)


MOTOR_VISCOUS = Effect(
    "motor_viscous",
    Port.MOTOR_TORQUE,
    friction,
    (amplitude("b_m", "N m s/rad", LogNormal(2e-3, 0.2), "viscous friction of the motor", (0.0, 1.0)),),
    wires=wired(rate="rotor_rate", damping="b_m"),
    passive=True,
    family="viscous",
    order=30,
)
JOINT_VISCOUS = Effect(
    "joint_viscous",
    Port.JOINT_TORQUE,
    friction,
    (amplitude("joint_viscous", "N m s/rad", Normal(0.0, 10.0), "viscous friction", 1e4),),
    wires=wired(rate="joint_rate", damping="joint_viscous"),
    passive=True,
    family="viscous",
    order=230,
)
ASYMMETRIC_VISCOUS = Effect(
    "asymmetric_viscous",
    Port.JOINT_TORQUE,
    asymmetric,
    (
        amplitude("viscous_ahead", "N m s/rad", Normal(0.0, 10.0), "of positive rates", 1e4),
        amplitude("viscous_astern", "N m s/rad", Normal(0.0, 10.0), "of negative rates", 1e4),
    ),
    passive=True,
    family="viscous",
    order=240,
)
