"""P. R. Dahl's law: bristles that bend before they slide, in a joint, the motor, the gear, a channel, an encoder."""

from __future__ import annotations

from math import exp

import numpy as np

from kbs_process.plant.effect import Effect, LogNormal, Normal, Parameter, Port, State, amplitude, wired
from kbs_process.plant.sensing import Sensing, SensingPort, recursion
from kbs_process.signals.records import Array


def friction(rate: float, strain: float, level: float, displacement: float) -> tuple[float, float]:
    r"""Torque on the output, reacted by the body that carries the motor, or on the rotor.

    Equation: $T = -T_c z$, $\dot z = (\omega - |\omega| z) / x_0$.
    Units: rad/s, 1, N m, rad -> N m, 1/s.
    Validity: does not depend on rate; |z| <= 1. Bearings roll within 0.3 deg of a reversal; what slides later is
        `joint_hysteresis`. The greatest rate in a step has to stay below x0: what a joint, or the rotor, turns in one.
    Source: P. R. Dahl, A solid friction model, Aerospace Corp. TOR-0158(3107-18)-1 (1968).
    """
    return -level * strain, (rate - abs(rate) * strain) / displacement


def windup(
    rotor_rate: float, joint_rate: float, ratio: float, wound: float, windup_loss: float, windup_memory: float
) -> tuple[float, float]:
    r"""Torque of the gear on the output by friction between flexspline and teeth, which the windup has to overcome.

    Equation: $T = T_h z$, $\dot z = (v - |v| z) / x_0$ with the rate of windup $v = \omega_r/R - \omega_l$.
    Units: rad/s, rad/s, 1, 1, N m, rad -> N m, 1/s.
    Validity: loops of the windup alone; they do not depend on rate (P. R. Dahl's law).
    Source: R. Dhaouadi, F. H. Ghorbel, P. S. Gandhi, A new dynamic model of hysteresis in harmonic drives, IEEE Trans.
        Industrial Electronics 50 (2003) 1165.
    """
    rate = rotor_rate / ratio - joint_rate
    return windup_loss * wound, (rate - abs(rate) * wound) / windup_memory


@recursion
def strained(x: Array, displacement: float) -> Array:
    r"""Strain z (n,) of P. R. Dahl's bristles along x (n,), from z = 0: its magnitude stays below 1.

    Equation: $dz/dx = (1 - z \operatorname{sign} dx) / x_0$, exactly: between two samples z approaches the sign of the
        change with $e^{-|\Delta x| / x_0}$.
    """
    z = np.zeros_like(x)
    for k in range(1, len(x)):
        change = x[k] - x[k - 1]
        sense = 1.0 if change > 0.0 else -1.0
        z[k] = sense + (z[k - 1] - sense) * exp(-abs(change) / displacement)
    return z


def of_channel(reading: Array, loop: float, loop_memory: float) -> Array:
    r"""Change of a channel by what its load was before.

    Equation: $\Delta y = -h z$, $dz/dy = (1 - z \operatorname{sign} dy) / y_0$.
    Units: the channel's, the channel's, the channel's -> the channel's.
    Validity: does not depend on rate; from a virgin state at the recording's start.
    Source: VDI/VDE 2638, Characteristics of force transducers: terms and definitions (2008).
    """
    return -loop * strained(reading, loop_memory)


def of_encoder(reading: Array, play: float, play_memory: float) -> Array:
    r"""Change of an angle by the coupling between shaft and encoder.

    Equation: $\Delta\theta = -h z$, $dz/d\theta = (1 - z \operatorname{sign} d\theta) / \theta_0$.
    Units: rad, rad, rad -> rad.
    Validity: does not depend on rate; from the middle at the recording's start.
    Source: L. M. Sanchez-Brea, T. Morlanes, Metrological errors in optical encoders, Measurement Science and
        Technology 19 (2008) 115104.
    """
    return -play * strained(reading, play_memory)


DAHL = Effect(
    "dahl",
    Port.JOINT_TORQUE,
    friction,
    (
        amplitude("dahl", "N m", Normal(0.0, 0.5), "friction torque", 100.0, dry=True),
        Parameter(
            "dahl_displacement",
            "rad",
            LogNormal(1e-3, 1.0),
            "angle after a reversal over which it builds up",
            (1e-5, 5e-3),
            grid=(2e-4, 1e-3),
        ),
    ),
    states=(State("dahl_strain", "1", 0.0, "bristles' deflection over its greatest"),),
    wires=wired(rate="joint_rate", strain="dahl_strain", level="dahl", displacement="dahl_displacement"),
    family="friction",
    order=290,
)
MOTOR_DAHL = Effect(
    "motor_dahl",
    Port.MOTOR_TORQUE,
    friction,
    (
        amplitude("presliding", "N m", Normal(0.0, 5e-3), "friction torque", 10.0, dry=True),
        Parameter(
            "presliding_angle",
            "rad",
            LogNormal(0.05, 1.0),
            "of the motor, after a reversal, over which it builds up",
            (5e-3, 10.0),
            grid=(0.02, 0.1, 0.5),
        ),
    ),
    states=(State("presliding_strain", "1", 0.0, "bristles' deflection over its greatest"),),
    wires=wired(rate="rotor_rate", strain="presliding_strain", level="presliding", displacement="presliding_angle"),
    family="friction",
    order=180,
)
TRANSMISSION_HYSTERESIS = Effect(
    "transmission_hysteresis",
    Port.TRANSMISSION,
    windup,
    (
        amplitude("windup_loss", "N m", Normal(0.0, 0.5), "half height of the loop", 50.0, dry=True),
        Parameter(
            "windup_memory",
            "rad",
            LogNormal(5e-5, 1.0),
            "windup after a reversal over which it builds up",
            (1e-6, 0.1),
            grid=(1e-5, 5e-5, 2e-4),
        ),
    ),
    states=(State("wound", "1", 0.0, "share of the loop's half height"),),
    family="hysteresis",
    order=220,
)
CHANNEL_HYSTERESIS = Sensing(
    "channel_hysteresis",
    SensingPort.CHANNEL,
    of_channel,
    (
        amplitude("loop", "1", Normal(0.0, 0.05), "half the loop's width, in the channel's unit", 1e3),
        Parameter(
            "loop_memory",
            "1",
            LogNormal(1.0, 1.0),
            "change of load that closes it, in the channel's unit",
            (1e-9, 1e6),
            grid=(0.003, 0.01, 0.03, 0.1, 0.3),
            over="reading.span",
        ),
    ),
    whole_band=True,
    family="sensor hysteresis",
    order=70,
)
ENCODER_HYSTERESIS = Sensing(
    "encoder_hysteresis",
    SensingPort.ENCODER,
    of_encoder,
    (
        amplitude("play", "rad", Normal(0.0, 1e-4), "half the play", 0.1),
        Parameter(
            "play_memory",
            "rad",
            LogNormal(5e-4, 1.0),
            "angle after a reversal over which it is taken up",
            (1e-7, 1.0),
            grid=(2e-4, 2e-3),
        ),
    ),
    whole_band=True,
    family="sensor hysteresis",
    order=190,
)
