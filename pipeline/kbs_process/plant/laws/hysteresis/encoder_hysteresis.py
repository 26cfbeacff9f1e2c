"""An encoder that reads late when the sense of rotation changes."""

from __future__ import annotations

from kbs_process.plant.effect import LogNormal, Normal, Parameter
from kbs_process.plant.laws.hysteresis.memory import strained
from kbs_process.plant.sensing import Sensing, SensingPort
from kbs_process.signals.records import Array


def change(reading: Array, play: float, play_memory: float) -> Array:
    r"""Change of an angle by the coupling between shaft and encoder.

    Equation: $\Delta\theta = -h z$, $dz/d\theta = (1 - z \operatorname{sign} d\theta) / \theta_0$.
    Units: rad, rad, rad -> rad.
    Validity: does not depend on rate; from the middle at the recording's start.
    Source: L. M. Sanchez-Brea, T. Morlanes, Metrological errors in optical encoders, Measurement Science and
        Technology 19 (2008) 115104.
    """
    return -play * strained(reading, play_memory)


ENCODER_HYSTERESIS = Sensing(
    name="encoder_hysteresis",
    order=190,
    port=SensingPort.ENCODER,
    equation=change,
    parameters=(
        Parameter("play", "rad", Normal(0.0, 1e-4), "half the play", (-0.1, 0.1), role="amplitude"),
        Parameter(
            "play_memory",
            "rad",
            LogNormal(5e-4, 1.0),
            "angle after a reversal over which it is taken up",
            (1e-7, 1.0),
            grid=(2e-4, 2e-3),
        ),
    ),
    reference="L. M. Sanchez-Brea, T. Morlanes, Metrological errors in optical encoders, Measurement Science and "
    "Technology 19 (2008) 115104",
    whole_band=True,
)
