"""Whether a law's size is one that it may have: what is not is no law, however well it fits.

A law with free amplitudes follows whatever a wrong number or a damaged recording leaves, and the less it has to do with
it, the larger they come out: an encoder that is eccentric by a radian. Every amplitude has bounds in the catalogue.
Amplitudes of one law that undo each other, as the constant and the tail of a spring that stiffens towards one end, are
judged by what they do together.
Those of sensors and clocks, which do not grow with the rig as torques do, have a spread that says what is usual, too.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping

import numpy as np

from kbs_process.diagnosis.screening.screen import Catalogued, Suspect
from kbs_process.diagnosis.screening.signature import port_inputs
from kbs_process.plant.effect import Effect
from kbs_process.plant.sensing import Sensing

SPREADS = 100.0  # of a sensor's law, beyond which it is no sensor's
SIGMAS = 3.0  # by which an amplitude has to be beyond


def undone(suspect: Catalogued, amplitudes: Mapping[str, float]) -> frozenset[str]:
    """Return the amplitudes of a law of the plant that may have any value, as others undo what they do.

    Along all motions the law does no more than such an amplitude would alone, at the bound of its values.
    """
    candidate, scene = suspect.candidate, suspect.scene
    if not isinstance(candidate.effect, Effect) or candidate.again:
        return frozenset()
    rig = scene.hypothesis.rig
    units = np.concatenate([port_inputs(candidate, tapped, rig) for tapped in scene.signals.values()])
    together = np.max(np.abs(np.einsum("nmc,m->nc", units, [amplitudes[e.name] for e in candidate.amplitudes])))
    alone = np.max(np.abs(units), axis=(0, 2))
    return frozenset(
        entry.name
        for entry, one in zip(candidate.amplitudes, alone, strict=True)
        if together <= one * max(map(abs, entry.bounds))
    )


def implausible(
    law: Effect | Sensing, amplitudes: Mapping[str, tuple[float, float]], free: Collection[str] = ()
) -> tuple[str, ...]:
    """Return why a law is refused that has amplitudes of such values and sigmas, by name; nothing, if it may have.

    Those that are `free` may have any.
    """
    reasons = []
    for parameter in law.parameters:
        if parameter.role != "amplitude" or parameter.name not in amplitudes or parameter.name in free:
            continue
        value, sigma = amplitudes[parameter.name]
        least, most = parameter.bounds
        if isinstance(law, Sensing):
            usual = SPREADS * parameter.prior.spread
            least, most = max(least, -usual), min(most, usual)
        # Written so that what is no number is refused.
        if not least - SIGMAS * sigma <= value <= most + SIGMAS * sigma:
            unit = "" if parameter.unit == "1" else f" {parameter.unit}"
            reasons.append(f"{parameter.name} = {value:.3g}{unit}, and it may be {least:.3g} to {most:.3g}{unit}")
    return tuple(reasons)


def oversized(
    suspect: Suspect, values: Iterable[float], sigmas: Iterable[float], free: Collection[str] = ()
) -> tuple[str, ...]:
    """Why a law of the catalogue does not have amplitudes of such values and sigmas; nothing, if it may.

    Those that are `free` may have any.
    """
    if not isinstance(suspect, Catalogued):
        return ()
    numbers = zip(map(float, values), map(float, sigmas), strict=True)
    named = dict(zip(suspect.amplitudes, numbers, strict=False))
    return tuple(reason for action in suspect.candidate.actions for reason in implausible(action.effect, named, free))
