"""Laws that did not stand, and those of them that may beside another.

Of two that are missing neither may pass alone: what the other leaves over differs from window to window, and pulls the
known numbers. So one that takes much is supposed to be there, for another to be looked for beside it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from kbs_process.diagnosis.acceptance.finding import Tried
from kbs_process.diagnosis.acceptance.outcome import Refused
from kbs_process.diagnosis.experiments.thresholds import MOSTLY_DONE, TAKEN, WAYS
from kbs_process.diagnosis.facts import Identity
from kbs_process.diagnosis.nominal.known import Known
from kbs_process.diagnosis.proposing.tryout import identity
from kbs_process.diagnosis.screening.screen import Found


@dataclass(slots=True)
class Noted:
    """What did not stand in a round, and why."""

    refused: list[Refused] = field(default_factory=list)
    fallen: list[Tried] = field(default_factory=list)  # those of them that were in the plant

    def refuse(self, found: Found, *reasons: str) -> None:
        self.refused.append(Refused(identity(found.suspect), found.score.rho_eff, reasons))

    def fell(self, *tried: Tried) -> None:
        """Note laws that were refitted and did not pass."""
        for one in tried:
            known = one.standing.known
            left = 1.0 + known.excess / known.fit_rows
            self.refused.append(Refused(identity(one.found.suspect), one.found.score.rho_eff, one.gate.reasons, left))
            self.fallen.append(one)

    def forget(self, tried: Tried) -> None:
        """Take out a law that is judged again."""
        self.fallen.remove(tried)
        own = identity(tried.found.suspect)
        self.refused = [one for one in self.refused if one.identity != own]

    @property
    def identities(self) -> list[Identity]:
        return [one.identity for one in self.refused]


def supposed(fallen: Sequence[Tried], before: Known) -> list[Tried]:
    """Laws to suppose, the one that leaves least first: where much is left, those that take some of it at some places.

    One that was taken off each recording has no numbers that could go on beside another.
    """
    if not before.gross:
        return []
    much = [one for one in fallen if one.own.names and taken(before, one.standing.known) >= TAKEN]
    best: dict[tuple[str, ...], Tried] = {}
    for one in sorted(much, key=lambda one: one.standing.known.cost):
        own = identity(one.found.suspect).place
        best.setdefault((own.port, own.site, *own.channels[:1]), one)
    return list(best.values())[:WAYS]


def taken(before: Known, after: Known) -> float:
    """Share of what exceeds the noise that is no longer left."""
    return 1.0 - after.excess / before.excess


def enough(before: Known, after: Known) -> bool:
    """Whether two laws that pass only together leave little: what each follows of the other's is much."""
    return wanting(before, after) <= 0.0


def wanting(before: Known, after: Known) -> float:
    """What another law would have to gain for that, of -2 log likelihood."""
    return after.excess - (1.0 - MOSTLY_DONE) * before.excess
