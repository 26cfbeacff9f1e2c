"""Whether a law's size is one that it may have: what is not is no law, however well it fits.

A law with free amplitudes follows whatever a wrong number or a damaged recording leaves, and the less it has to do with
it, the larger they come out: an encoder that is eccentric by a radian. Every amplitude has bounds in the catalogue.
Those of sensors and clocks, which do not grow with the rig as torques do, have a spread that says what is usual, too.
"""

from __future__ import annotations

from collections.abc import Mapping

from kbs_process.plant.effect import Effect
from kbs_process.plant.sensing.sensing import Sensing

SPREADS = 100.0  # of a sensor's law, beyond which it is no sensor's
SIGMAS = 3.0  # by which an amplitude has to be beyond


def implausible(law: Effect | Sensing, amplitudes: Mapping[str, tuple[float, float]]) -> tuple[str, ...]:
    """Return why a law is refused that has amplitudes of such values and sigmas, by name; nothing, if it may have."""
    reasons = []
    for parameter in law.parameters:
        if parameter.role != "amplitude" or parameter.name not in amplitudes:
            continue
        value, sigma = amplitudes[parameter.name]
        least, most = parameter.bounds
        if isinstance(law, Sensing):
            usual = SPREADS * parameter.prior.spread
            least, most = max(least, -usual), min(most, usual)
        # Written so that what is no number is refused.
        if not least - SIGMAS * sigma <= value <= most + SIGMAS * sigma:
            unit = "" if parameter.unit == "1" else f" {parameter.unit}"
            reasons.append(
                f"{parameter.name} = {value:.3g}{unit}, and it may be {least:.3g} to {most:.3g}{unit}"
            )
    return tuple(reasons)
