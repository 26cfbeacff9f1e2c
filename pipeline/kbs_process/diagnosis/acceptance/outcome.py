"""What a diagnosis says: every answer a number with an uncertainty, frozen, ready to be recorded."""

from __future__ import annotations

from dataclasses import dataclass

from kbs_process.diagnosis.acceptance.gate import Gate
from kbs_process.diagnosis.experiments.thresholds import DISPUTED
from kbs_process.diagnosis.facts import Answer, Estimate, Identity, Moved, Place
from kbs_process.diagnosis.nominal.detection import Detection
from kbs_process.diagnosis.nominal.joint import Standing
from kbs_process.diagnosis.nominal.known import Known, Strain
from kbs_process.diagnosis.screening.ports import Cells, PortTest
from kbs_process.plant.laws.position.measured_law import Measured
from kbs_process.plant.sensing import Sensing
from kbs_process.signals.records import Array


@dataclass(frozen=True, slots=True)
class Alternative:
    """Another law for the same find."""

    identity: Identity
    probability: float
    rho_delta: float  # whitened distance from the law taken, the rival refitted
    indistinguishable: bool
    refitted: bool  # in the non-linear plant; else along the linear one


@dataclass(frozen=True, slots=True, eq=False)
class Curve:
    """A measured law: value over its regressor with one standard deviation."""

    law: Measured | Sensing
    x: Array  # (m,)
    columns: Array  # (m, coefficients): what a unit of each is there
    value: Array  # (m,) at the port: N m, or rad of an encoder
    sigma: Array  # (m,)


@dataclass(frozen=True, slots=True, eq=False)
class Find:
    """An accepted law."""

    identity: Identity
    named: bool
    equation: str  # its docstring's
    reference: str
    estimates: tuple[Estimate, ...]
    probability: float
    rho_eff: float  # whitened size behind the known parameters
    kappa: float
    gate: Gate
    alternatives: tuple[Alternative, ...]  # most probable first
    ports_alike: tuple[str, ...]  # ports that these channels cannot tell from its own
    held_out_variance: float | None  # share of the excess on held-out recordings that it explains
    curve: Curve | None
    parts: tuple[tuple[Estimate, ...], ...] = ()  # of a law that was found more than once: each action's estimates

    @property
    def actions(self) -> tuple[tuple[Estimate, ...], ...]:
        """Estimates of each time that the law was found."""
        return self.parts or (self.estimates,)

    @property
    def indistinguishable_from(self) -> tuple[Identity, ...]:
        return tuple(other.identity for other in self.alternatives if other.indistinguishable)


@dataclass(frozen=True, slots=True)
class Refused:
    """A suspect that the screen found and that did not become a find."""

    identity: Identity
    rho_eff: float
    reasons: tuple[str, ...]
    left: float | None = None  # power over the floor's beside it, of recordings that are fitted; None: not simulated


@dataclass(frozen=True, slots=True)
class Absorbed:
    """A suspect whose signature the known parameters take up: it may be there, and cannot be told from them."""

    identity: Identity
    kappa: float
    rho: float
    by: tuple[str, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Location:
    """Where the residual lives: the port test and its cells."""

    test: PortTest
    cells: Cells
    # The port where it enters, and those that look the same; none, where others can do it.
    only: tuple[Place, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Outcome:
    """All answers of a diagnosis."""

    before: Detection  # known parameters refitted, no law added
    after: Detection  # with all finds
    held_out: tuple[Detection, Detection] | None  # before and after, on recordings that were not used
    log_p: float  # natural logarithm: that the recordings show nothing beyond floor and known parameters
    moved: tuple[Moved, ...]
    finds: tuple[Find, ...]
    refused: tuple[Refused, ...]
    absorbed: tuple[Absorbed, ...]
    place: Location | None  # before any find; None for a rig that its motion drives
    left: Location | None  # after all finds
    known: Known  # refitted, without any law: what stood before the first find
    standing: Standing  # the corrected model
    strain: Strain  # of all known numbers together
    otherwise: tuple[Moved, ...] = ()  # known parameters that would have to be off if there were no law
    ended: bool = False  # whether the search had cost so much that no more laws were looked for

    @property
    def verdict(self) -> Answer:
        """The answer in a word: finds beside which much is left are no more than the nearest that is known."""
        if (
            self.much
            or self.disputed
            or (not self.finds and (self.after.left or self.after.faint or self.hidden or self.untried))
        ):
            return "undecided"
        if self.finds:
            return "physics"
        return "parameters off" if self.moved else "none"

    @property
    def hidden(self) -> bool:
        """Whether known numbers, none of which is off by itself, may have taken up physics that was left out.

        They leave nothing, but are all together farther off than chance has them.
        """
        return self.strain.strained and not self.after.left and not self.moved

    @property
    def untried(self) -> bool:
        """Whether numbers that are off leave nothing, and not all laws were tried that could be there instead.

        That no law does as well as these numbers is what their being off rests on.
        """
        return self.ended and bool(self.moved)

    @property
    def located(self) -> tuple[Place, ...]:
        """Ports, which look the same, of what is left without a law; nothing where other ports may be it as well."""
        if self.verdict != "undecided" or self.finds or self.unforeseen or self.left is None:
            return ()
        return self.left.only

    @property
    def much(self) -> bool:
        """Whether much is left, in recordings that were fitted or in those that were held out."""
        return self.after.much or (self.held_out is not None and self.held_out[1].much)

    @property
    def disputed(self) -> tuple[Identity, ...]:
        """Laws at other places that the finds may stand for: they do nearly the same, beside numbers that were pulled.

        Where a search leaves these then decides which of the laws does more.
        """
        if not self.strain.strained:
            return ()
        return tuple(
            other.identity
            for find in self.finds
            for other in find.alternatives
            if other.refitted
            and other.rho_delta < DISPUTED * find.rho_eff
            and other.identity.place != find.identity.place
        )

    @property
    def unforeseen(self) -> bool:
        """Whether recordings that were held out show what those that were fitted do not."""
        return not self.after.left and self.held_out is not None and self.held_out[1].much
