"""Torque that is periodic in an angle: the rotor's, of any order, or a joint's own."""

from __future__ import annotations

import math

from kbs_process.plant.effect import Effect, Normal, Parameter, Port, sine_and_cosine


def of_rotor(rotor_angle: float, order_sin: float, order_cos: float, order: float) -> float:
    r"""Torque on the rotor of one order of its angle.

    Equation: $T = a \sin(k \theta_r) + b \cos(k \theta_r)$.
    Units: rad, N m, N m, 1 -> N m.
    Validity: does not depend on rate or current. Whole orders belong to the motor (1: eccentricity, 2: ellipse of the
        wave generator, 50: pole pairs, 200: full steps), others to wheels geared to it.
    Source: T. Kenjo, A. Sugawara, Stepping Motors and Their Microprocessor Controls (1994), chapter 4.
    """
    return order_sin * math.sin(order * rotor_angle) + order_cos * math.cos(order * rotor_angle)


def of_joint(joint_angle: float, joint_sin: float, joint_cos: float, joint_order: float) -> float:
    r"""Torque on the output, reacted by the body that carries the motor.

    Equation: $T = a \sin(k \theta_l) + b \cos(k \theta_l)$.
    Units: rad, N m, N m, 1 -> N m.
    Validity: does not depend on rate. 1, 2: seats of the bearings; 200: teeth of the flexspline, 202: of its ring. A
        part of a period is any curve, and is not looked for.
    Source: T. D. Tuttle, W. P. Seering, A nonlinear model of a harmonic drive gear transmission, IEEE Trans. Robotics
        and Automation 12 (1996) 368.
    """
    return of_rotor(joint_angle, joint_sin, joint_cos, joint_order)


MOTOR_ORDER = Effect(
    "motor_order",
    Port.MOTOR_TORQUE,
    of_rotor,
    (
        *sine_and_cosine("order", "N m", Normal(0.0, 5e-3), "of the order", 100.0, dry=True),
        Parameter(
            "order",
            "1",
            Normal(1.0, 100.0),
            "periods in a turn of the motor",
            (0.0, 1e4),
            grid=(1.0, 2.0, 3.0, 4.0, 6.0, 8.0, 25.0, 50.0, 100.0, 150.0, 200.0, 250.0, 300.0, 400.0, 600.0, 800.0),
            proposed="motor order",
            whole=True,
        ),
    ),
    of_cycles="cogging",
    family="motor order",
    order=110,
)
JOINT_ORDER = Effect(
    "joint_order",
    Port.JOINT_TORQUE,
    of_joint,
    (
        *sine_and_cosine("joint", "N m", Normal(0.0, 0.2), "of the order", 100.0, dry=True),
        Parameter(
            "joint_order",
            "1",
            Normal(1.0, 100.0),
            "periods in a turn of the joint",
            (0.0, 1e4),
            grid=(1.0, 2.0, 3.0, 4.0, 6.0, 200.0, 202.0),
            over="joint_angle.turns",
            proposed="joint order",
            whole=True,
        ),
    ),
    of_gear=True,
    family="local torque",
    order=330,
)
