"""A clock that wanders about the other: its oscillator warms and cools by turns, or it is set again and again."""

from __future__ import annotations

import numpy as np

from kbs_process.plant.effect import LogNormal, Normal, Parameter, sine_and_cosine
from kbs_process.plant.sensing import Sensing, SensingPort
from kbs_process.signals.records import Array


def lateness(time: Array, wander_sin: float, wander_cos: float, wander_period: float) -> Array:
    r"""By how much stamps are late that are early and late by turns.

    Equation: $y_\mathrm{read}(t) = y(t - a \sin(2 \pi t / P) - b \cos(2 \pi t / P))$.
    Units: s, s, s, s -> s.
    Validity: one period; its phase is a recording's own.
    Source: D. W. Allan, N. Ashby, C. C. Hodge, The science of timekeeping, Hewlett-Packard AN 1289 (1997).
    """
    phase = 2.0 * np.pi * time / wander_period
    return np.asarray(wander_sin * np.sin(phase) + wander_cos * np.cos(phase), dtype=np.float64)


CLOCK_WANDER = Sensing(
    "clock_wander",
    SensingPort.STREAM,
    lateness,
    (
        *sine_and_cosine("wander", "s", Normal(0.0, 0.02), "of the deviation", 10.0),
        Parameter(
            "wander_period",
            "s",
            LogNormal(25.0, 0.5),
            "of the deviation",
            (0.1, 1e6),
            # Half a turn more over the longest recording, one after the other: between two, phases run apart.
            grid=tuple(2.0 / halves for halves in range(1, 29)),
            over="time.span",
        ),
    ),
    each_trial=True,
    family="wander",
    order=250,
)
