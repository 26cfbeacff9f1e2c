"""What a channel reads of the product of two others, or of one and itself."""

from __future__ import annotations

from kbs_process.plant.effect import Normal, Parameter
from kbs_process.plant.sensing import Sensing, SensingPort
from kbs_process.signals.records import Array


def change(acting: Array, interaction: float) -> Array:
    r"""Change of a channel by the product of two: a bridge that a load bends out of its place for another one.

    Equation: $\Delta y_i = x_{ijk} y_j y_k$, `acting` being the product.
    Units: the acting channels' product, SI (the channel's unit over that product's) -> the channel's.
    Validity: one of the 21 second-order terms of a balance's calibration; of the loads that are predicted.
    Source: AIAA R-091A-2020, Calibration and use of internal strain-gage balances with application to wind tunnel
        testing, mathematical model of second order.
    """
    return interaction * acting


CHANNEL_INTERACTION = Sensing(
    name="channel_interaction",
    order=30,
    port=SensingPort.PRODUCT,
    equation=change,
    parameters=(
        Parameter(
            "interaction",
            "SI by channel pair",
            Normal(0.0, 0.02),
            "second-order term of the calibration",
            (-10.0, 10.0),
            role="amplitude",
        ),
    ),
    reference="AIAA R-091A-2020, Calibration and use of internal strain-gage balances with application to wind tunnel "
    "testing",
    whole_band=True,
)
