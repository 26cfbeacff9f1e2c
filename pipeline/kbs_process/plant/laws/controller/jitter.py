"""Cycles of the controller or the driver that come early and late in turn."""

from __future__ import annotations

import math

from kbs_process.plant.effect import Effect, LogNormal, Normal, Parameter, Port, sine_and_cosine


def change(time: float, field_rate: float, jitter_sin: float, jitter_cos: float, jitter_frequency: float) -> float:
    r"""Change of the field whose cycles come late by a time that beats, as with a task that shares the processor.

    Equation: $\Delta\theta_f = -\dot\theta_f (s \sin(2 \pi f t) + c \cos(2 \pi f t))$.
    Units: s, rad/s, s, s, Hz -> rad.
    Validity: first order in the delay, which is less than a cycle; one line of its beat, in phase with the recording's
        beginning. A field at rest shows nothing of it, which tells it from a vibration.
    Source: J. Nilsson, Real-Time Control Systems with Delays, thesis, Lund (1998), chapter 2.
    """
    phase = 2.0 * math.pi * jitter_frequency * time
    return -field_rate * (jitter_sin * math.sin(phase) + jitter_cos * math.cos(phase))


CONTROLLER_JITTER = Effect(
    "controller_jitter",
    Port.FIELD,
    change,
    (
        *sine_and_cosine("jitter", "s", Normal(0.0, 1e-3), "of the delay", 0.05),
        Parameter(
            "jitter_frequency",
            "Hz",
            LogNormal(5.0, 1.0),
            "at which cycles are late",
            (0.01, 500.0),
            over="spectrum",
            proposed="beat",
        ),
    ),
    family="jitter",
    order=80,
)
