"""Error of the microsteps: the field does not stand where the currents are meant to put it."""

from __future__ import annotations

import math

from kbs_process.plant.effect import Effect, Normal, Parameter, Port, shared, sine_and_cosine
from kbs_process.plant.laws.motor.synchronous_motor import SYNCHRONOUS_MOTOR


def torque(
    field: float,
    rotor_angle: float,
    microstep_sin: float,
    microstep_cos: float,
    microstep_order: float,
    Tmax: float,
    Kangle: float,
) -> float:
    r"""Change of the synchronous torque by a field that is wrong by a part of its electrical cycle.

    Equation: $T = T_{max} K_{angle} \cos(K_{angle} (\theta_f - \theta_r))
        (a \sin(m K_{angle} \theta_f) + b \cos(m K_{angle} \theta_f))$, of first order in the error.
    Units: rad, rad, rad, rad, 1, N m, 1 -> N m.
    Validity: error far below 1/Kangle. m = 1: offset of a phase's current, 2: unequal phases, 4: saturation or a
        current that is not a sine.
    Source: T. Kenjo, A. Sugawara, Stepping Motors and Their Microprocessor Controls (1994), chapter 5.
    """
    cycle = microstep_order * Kangle * field
    error = microstep_sin * math.sin(cycle) + microstep_cos * math.cos(cycle)
    return Tmax * Kangle * math.cos(Kangle * (field - rotor_angle)) * error


MICROSTEP_ERROR = Effect(
    "microstep_error",
    Port.MOTOR_TORQUE,
    torque,
    (
        *sine_and_cosine("microstep", "rad", Normal(0.0, 5e-4), "of the error", 0.01),
        Parameter(
            "microstep_order",
            "1",
            Normal(1.0, 2.0),
            "periods in an electrical cycle",
            (0.5, 64.0),
            grid=(1.0, 2.0, 4.0),
            proposed="cycle order",
            whole=True,
        ),
        shared(SYNCHRONOUS_MOTOR, "Tmax"),
        shared(SYNCHRONOUS_MOTOR, "Kangle"),
    ),
    family="microstep",
    order=120,
)
