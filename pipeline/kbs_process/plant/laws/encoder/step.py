"""A step of an encoder's error where a coarse code switches."""

from __future__ import annotations

import numpy as np

from kbs_process.plant.effect import Normal, Parameter, amplitude
from kbs_process.plant.sensing import Sensing, SensingPort
from kbs_process.signals.records import Array


def change(reading: Array, step: float, step_angle: float) -> Array:
    r"""Change of an angle beyond the place where a converter switches to its next range.

    Equation: $\Delta\theta = s$ where $\theta > \theta_0$, else 0.
    Units: rad, rad, rad -> rad.
    Validity: one place; the same in both senses.
    Source: IEEE Std 1241-2010, Terminology and test methods for analog-to-digital converters.
    """
    return np.where(reading > step_angle, step, 0.0)


ENCODER_STEP = Sensing(
    "encoder_step",
    SensingPort.ENCODER,
    change,
    (
        amplitude("step", "rad", Normal(0.0, 3e-4), "of the error", 0.1),
        Parameter(
            "step_angle",
            "rad",
            Normal(0.0, 3.0),
            "where it switches",
            (-100.0, 100.0),
            grid=tuple((i + 0.5) / 24.0 for i in range(24)),
            over="reading",
        ),
    ),
    whole_band=True,
    family="converter",
    order=170,
)
