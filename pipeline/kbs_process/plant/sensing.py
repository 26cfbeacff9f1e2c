"""What a sensor or a clock does to its signal: an equation on whole arrays, and where it acts.

As an effect of the plant, a sensing effect is a plain function whose argument names are its wiring, with its
declaration beneath. It returns the change of its reading, to be added, or by how many s the stamps of a clock are late;
it is linear in its amplitudes.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, wraps
from itertools import combinations_with_replacement
from typing import get_type_hints

from kbs_process.plant.effect import Acts, Law, Parameter
from kbs_process.signals.records import Array

READINGS = {
    "reading": "what the sensor reads without the effect, in its unit",
    "acting": "reading of the channel that acts on this one, product of the two that do",
    "rate": "time derivative of the reading",
    "time": "s, on the recording's time axis",
    "temperature": "degC, of the transducer",
}
SCALARS = {
    "code": "rad, one code of the encoder",
    "drop_time": "s, when the clock of this recording's stream seems to jump",
}
SIGNALS = READINGS | SCALARS
BY = "<-"  # in the site of a coupling: channel that reads, channel that acts, or the two of which the product does
STREAMS = ("wrench", "encoder")
SPREADS = 100.0  # of a prior, beyond which a size is no sensor's


_CHANNEL = "a channel of the transducer, whatever the mechanism does"


class SensingPort(Acts):
    """Which signal an equation changes."""

    CHANNEL = "one channel of the transducer, or the effort of a joint", "transducer", _CHANNEL, SIGNALS, "channel"
    COUPLING = "one channel, by another", "transducer", _CHANNEL, SIGNALS, "channel"
    PRODUCT = "one channel, by the product of two", "transducer", _CHANNEL, SIGNALS, "channel"
    ENCODER = (
        "one encoder's angle, rad",
        "encoder",
        "an angle; in a closed loop without a recorded field also the controller's answer",
        SIGNALS,
        "encoder",
    )
    STREAM = "all channels that one clock stamps", "clock", "all of them", SIGNALS, "stream"

    def sites(self, loads: Sequence[str], bridge: Sequence[str], encoders: Sequence[str]) -> list[str]:
        """Return where a law can act: `loads` are all channels of loads, `bridge` those of the transducer."""
        match self:
            case SensingPort.CHANNEL:
                return list(loads)
            case SensingPort.COUPLING:
                return couplings(bridge)
            case SensingPort.PRODUCT:
                return products(bridge)
            case SensingPort.ENCODER:
                return list(encoders)
            case SensingPort.STREAM:
                return [name for name, stamped in zip(STREAMS, (loads, encoders), strict=True) if stamped]


def couplings(channels: Sequence[str]) -> list[str]:
    """Sites of what one channel does to another."""
    return [f"{reads}{BY}{acts}" for reads in channels for acts in channels if reads != acts]


def products(channels: Sequence[str]) -> list[str]:
    """Sites of what the product of two channels does to one; its own square is its non-linearity's."""
    pairs = list(combinations_with_replacement(channels, 2))
    return [BY.join((reads, *pair)) for reads in channels for pair in pairs if pair != (reads, reads)]


def recursion(function: Callable[[Array, float], Array]) -> Callable[[Array, float], Array]:
    """Compile a recursion over samples when it is first called: the compiler takes longer to import than all laws."""

    @cache
    def compiled() -> Callable[[Array, float], Array]:
        from kbs_process.machine_code import njit

        made: Callable[[Array, float], Array] = njit(cache=True, error_model="numpy")(function)
        return made

    @wraps(function)
    def run(x: Array, displacement: float) -> Array:
        return compiled()(x, displacement)

    return run


@dataclass(frozen=True, slots=True)
class Sensing(Law):
    """An equation, the port at which its value acts, and its parameters.

    `whole_band`: vibration beyond the working band changes what it does within, as it is not linear in what it reads.
    """

    port: SensingPort

    def __post_init__(self) -> None:
        where = f"sensing effect '{self.name}'"
        if not self.name.isidentifier():
            raise TypeError(f"{where}: the name is not an identifier")
        if unknown := set(self.arguments) - set(SIGNALS) - set(self.own):
            raise TypeError(f"{where}: {sorted(unknown)} is neither a signal ({', '.join(SIGNALS)}) nor declared")
        if unused := set(self.own) - set(self.arguments):
            raise TypeError(f"{where}: {sorted(unused)} is declared, but not an argument of the equation")
        hints = get_type_hints(self.equation)
        types = [hint for name, hint in hints.items() if name != "return"]
        wrong = [
            name
            for name, hint in zip(self.arguments, types, strict=True)
            if hint != (Array if name in READINGS else float)
        ]
        if wrong or hints.get("return") != Array:
            raise TypeError(f"{where}: {wrong} or the result have not the type that they are declared with")

    def plausible(self, entry: Parameter) -> tuple[float, float]:
        """Between which values an amplitude is no sign of something else: what is usual does not grow with the rig."""
        low, high = entry.bounds
        usual = SPREADS * entry.prior.spread
        return max(low, -usual), min(high, usual)
