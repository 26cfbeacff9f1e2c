"""Plain facts that the search finds and results.json stores as they are: one type for each."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from kbs_process.results.records import Record

Answer = Literal["none", "parameters off", "physics", "undecided"]


class Place(Record, frozen=True):
    """Where physics enters: a port, the joint, link, stream or channel it belongs to, and the channels that show it."""

    port: str
    site: str  # joint, link or stream; "" for base and transducer
    channels: tuple[str, ...] = ()  # that it touches directly, of a transducer; strongest first

    @property
    def label(self) -> str:
        """The place as the port test names it."""
        return " ".join(part for part in (self.port, self.site, " ".join(self.channels)) if part)

    @property
    def words(self) -> str:
        """The place for a reader: port, and joint or channels."""
        return ", ".join(part for part in (self.port, self.site or "/".join(self.channels)) if part)


class Moved(Record, frozen=True, kw_only=True):
    """A known parameter, before and after."""

    name: str
    unit: str
    prior: float
    prior_sigma: float | None  # None: nothing was known, as of a phase
    value: float
    sigma: float
    sigmas: float | None  # from the prior, in its sigma


class Planned(Record, frozen=True):
    """A trajectory that could be run next."""

    trajectory: str
    worth: float  # distance of the nearest rival; without rivals, root of the information's smallest eigenvalue


@dataclass(frozen=True, slots=True)
class Identity:
    """What a law is and where it acts, in the field's words."""

    place: Place
    # Of physics, "unnamed" for a measured law; by it alone laws do not differ: orders of one motor may be of two.
    family: str = field(compare=False)
    law: str  # name in the catalogue, or what the measured law is a function of

    @property
    def name(self) -> str:
        """The law in words."""
        return self.law.replace("_", " ")

    @property
    def words(self) -> str:
        """The law and its place."""
        return f"{self.name} ({self.place.words})"


@dataclass(frozen=True, slots=True)
class Estimate:
    """A number of a law with its 95 % interval; `sigma` 0 where it was chosen from a grid."""

    name: str
    unit: str
    value: float
    sigma: float
    about: float = 0.0  # what was fitted is how far it is from this

    @property
    def low(self) -> float:
        return self.value - 1.96 * self.sigma

    @property
    def high(self) -> float:
        return self.value + 1.96 * self.sigma
