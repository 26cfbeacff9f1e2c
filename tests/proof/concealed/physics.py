"""How a physics that can be concealed is declared, and what it is in one trial."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import IntEnum

from proof.concealed.laws import Law
from proof.concealed.ranges import Drawn
from proof.concealed.sensing import Sense


@dataclass(frozen=True, slots=True)
class Within:
    """A place within what the fit recordings sweep: of the joint's angle, or of the channel's reading."""

    low: float = 0.25
    high: float = 0.75


@dataclass(frozen=True, slots=True)
class Shape:
    """A parameter beside the amplitude."""

    name: str
    unit: str
    drawn: Drawn | Within | float  # a number is the same in every trial


@dataclass(frozen=True, slots=True)
class Physics:
    """A physics that can be concealed."""

    name: str
    port: str
    family: str
    law: IntEnum | Sense  # Law, or a law that somebody else lets act
    places: tuple[str, ...]  # joints, links, streams, or channels "Tx" and "Tx<-Fz"; "" where there is but one
    unit: str  # of the amplitude
    first: float  # amplitude tried first
    most: float  # beyond it, the physics would be another one
    shapes: tuple[Shape, ...] = ()
    catalogued: bool = True  # whether a plant's catalogue would name it
    comparable: bool = False  # whether the amplitude means the same in any other formula of this physics


@dataclass(frozen=True, slots=True)
class Effect:
    """A physics in one trial."""

    physics: Physics
    place: str
    shapes: tuple[float, ...]
    amplitude: float

    def scaled(self, amplitude: float) -> Effect:
        """The same with another amplitude."""
        return replace(self, amplitude=amplitude)

    @property
    def axis(self) -> str:
        """Joint, link or stream; "" where that says nothing."""
        return "" if self.physics.port in ("base", "transducer") else self.place

    @property
    def channels(self) -> tuple[str, ...]:
        """Channels of the transducer that it touches itself."""
        return (self.place.partition("<-")[0],) if self.physics.port == "transducer" else ()

    @property
    def on_the_mechanism(self) -> bool:
        """Whether it has to be simulated: what only sensors show has not."""
        return isinstance(self.physics.law, Law) or self.physics.port == "controller"
