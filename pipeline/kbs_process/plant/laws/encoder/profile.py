"""Error of an encoder's disc that has no name: whatever it is over the angle, or over one period of it."""

from __future__ import annotations

import numpy as np

from kbs_process.plant.effect import UNNAMED, LogNormal, Normal, Parameter, amplitude
from kbs_process.plant.sensing import Sensing, SensingPort
from kbs_process.signals.records import Array

NODES = 16


def change(
    reading: Array,
    profile_1: float,
    profile_2: float,
    profile_3: float,
    profile_4: float,
    profile_5: float,
    profile_6: float,
    profile_7: float,
    profile_8: float,
    profile_9: float,
    profile_10: float,
    profile_11: float,
    profile_12: float,
    profile_13: float,
    profile_14: float,
    profile_15: float,
    profile_period: float,
) -> Array:
    r"""Change of an angle by a measured error that repeats with a period.

    Equation: $\Delta\theta = \sum_k c_k B(u - k)$, $u = 16 \theta / \theta_p$ modulo 16, $B$ the cubic B-spline,
        $\sum_k c_k = 0$.
    Units: rad, rad (fifteen), rad -> rad.
    Validity: what jumps is rounded to a sixteenth of the period. With a period longer than what was swept it is any
        error over the angle, known where the angle has been. Its mean over a period is zero: an offset is the
        encoder's own.
    Source: C. de Boor, A Practical Guide to Splines (2001), chapter IX.
    """
    free = np.array([
        profile_1, profile_2, profile_3, profile_4, profile_5, profile_6, profile_7, profile_8, profile_9,
        profile_10, profile_11, profile_12, profile_13, profile_14, profile_15,
    ])  # fmt: skip
    c = np.append(free, -free.sum())
    u = NODES * (reading / profile_period)
    first = np.floor(u)
    x, k = u - first, first.astype(np.intp)
    weights = (1.0 - x) ** 3, 4.0 - 6.0 * x**2 + 3.0 * x**3, 1.0 + 3.0 * x + 3.0 * x**2 - 3.0 * x**3, x**3
    total: Array = sum((c[(k + j) % NODES] * w for j, w in zip((-1, 0, 1, 2), weights, strict=True)), 0.0 * x)
    return total / 6.0


ENCODER_PROFILE = Sensing(
    "encoder_profile",
    SensingPort.ENCODER,
    change,
    (
        *(
            amplitude(f"profile_{k}", "rad", Normal(0.0, 2e-4), f"about the error at node {k}", 0.1)
            for k in range(1, NODES)
        ),
        # A little more than what is swept: its ends are no neighbours.
        Parameter(
            "profile_period",
            "rad",
            LogNormal(1.0, 2.0),
            "angle after which the error repeats",
            (1e-6, 1e3),
            grid=(1.25,),
            over="reading.span",
            proposed="period",
        ),
    ),
    whole_band=True,
    family=UNNAMED,
    order=200,
)
