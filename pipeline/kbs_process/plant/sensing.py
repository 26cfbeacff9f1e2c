"""What a sensor or a clock does to its signal: an equation on whole arrays, and where it acts.

As an effect of the plant, a sensing effect is a plain function whose argument names are its wiring, with its
declaration beneath. It returns the change of its reading, to be added, or by how many s the stamps of a clock are late;
it is linear in its amplitudes.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum
from itertools import combinations_with_replacement
from typing import get_type_hints

from kbs_process.plant.effect import LAST, Parameter
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


BY = "<-"  # in the site of a coupling: channel that reads, channel that acts, or the two of which the product does


class SensingPort(Enum):
    """Which signal an equation changes."""

    CHANNEL = "one channel of the transducer, or the effort of a joint"
    COUPLING = "one channel, by another"
    PRODUCT = "one channel, by the product of two"
    ENCODER = "one encoder's angle, rad"
    STREAM = "all channels that one clock stamps"


@dataclass(frozen=True, slots=True)
class Sensing:
    """An equation, the port at which its value acts, and its parameters.

    `each_trial`: its amplitudes belong to a recording, as of what drifts or hums. `whole_band`: vibration beyond the
    working band changes what it does within, as it is not linear in what it reads.
    """

    name: str
    port: SensingPort
    equation: Callable[..., Array]
    parameters: tuple[Parameter, ...]
    reference: str
    each_trial: bool = False
    whole_band: bool = False
    order: int = LAST  # of search; then by name

    def __post_init__(self) -> None:
        where = f"sensing effect '{self.name}'"
        own = {parameter.name for parameter in self.parameters}
        known = {*READINGS, *SCALARS}
        if not self.name.isidentifier():
            raise TypeError(f"{where}: the name is not an identifier")
        if unknown := set(self.arguments) - known - own:
            raise TypeError(f"{where}: {sorted(unknown)} is neither a signal ({', '.join(known)}) nor declared")
        if unused := own - set(self.arguments):
            raise TypeError(f"{where}: {sorted(unused)} is declared, but not an argument of the equation")
        hints = get_type_hints(self.equation)
        wrong = [name for name in self.arguments if hints.get(name) != (Array if name in READINGS else float)]
        if wrong or hints.get("return") != Array:
            raise TypeError(f"{where}: {wrong} or the result have not the type that they are declared with")

    @property
    def arguments(self) -> tuple[str, ...]:
        """Names of the equation's arguments, in order."""
        return tuple(inspect.signature(self.equation).parameters)


def couplings(channels: Sequence[str]) -> list[str]:
    """Sites of what one channel does to another."""
    return [f"{reads}{BY}{acts}" for reads in channels for acts in channels if reads != acts]


def products(channels: Sequence[str]) -> list[str]:
    """Sites of what the product of two channels does to one; its own square is its non-linearity's."""
    pairs = list(combinations_with_replacement(channels, 2))
    return [BY.join((reads, *pair)) for reads in channels for pair in pairs if pair != (reads, reads)]
