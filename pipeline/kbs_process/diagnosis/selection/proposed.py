"""What smoothing proposes, judged in the plant; and what a round of the search comes to."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from kbs_process.diagnosis.acceptance.needed import Accepted
from kbs_process.diagnosis.acceptance.outcome import Location
from kbs_process.diagnosis.acceptance.supposed import Noted
from kbs_process.diagnosis.experiments.floor import Floor
from kbs_process.diagnosis.nominal.joint import Standing, standing_of
from kbs_process.diagnosis.nominal.known import Known, as_it_is
from kbs_process.diagnosis.proposing.clocks import timed
from kbs_process.diagnosis.proposing.tryout import of_every_clock
from kbs_process.diagnosis.proposing.view import View
from kbs_process.diagnosis.screening.localise import cells_and_ports
from kbs_process.diagnosis.screening.ports import port_test
from kbs_process.diagnosis.screening.scene import Scene
from kbs_process.diagnosis.screening.screen import Catalogued, Screening
from kbs_process.diagnosis.selection.believed import believed
from kbs_process.diagnosis.selection.effort import Effort
from kbs_process.diagnosis.selection.leaders import tried
from kbs_process.diagnosis.smoothing.as_plant import hypothesis_of
from kbs_process.diagnosis.smoothing.search import Proposal, Smoothed

_COMPARED = 2  # effects of other places or physics that are told beside one


@dataclass(frozen=True, slots=True, eq=False)
class Round:
    """A look for one more effect."""

    accepted: Accepted | None
    standing: Standing
    seen: Standing  # from where laws were looked for, and `place` is
    screening: Screening
    noted: Noted
    place: Location | None


def numbers_beside(known: Known, smoothed: Smoothed, simulate: Effort) -> Standing:
    """Known numbers where they are beside the effects that smoothing found: what these do is left."""
    there = hypothesis_of(smoothed.beside)
    limits = known.parameters
    value = np.clip(there.values(known.free), limits.lower, limits.upper)
    moved = replace(known, hypothesis=known.hypothesis.at(known.free, value), value=value, shown={})
    return standing_of(as_it_is(moved, simulate), {})


def nothing(standing: Standing, floor: Floor) -> Round:
    """Smoothing found nothing: what numbers leave, if anything, enters at a place."""
    view = View.at(standing, [])
    return Round(None, standing, standing, view.screening, Noted(), place_of(standing, floor, view.scene))


def proposed(
    proposal: Proposal, standing: Standing, seen: Standing, floor: Floor, simulate: Effort, accepted: Sequence[Accepted]
) -> Round:
    """Let the plant judge what smoothing proposes, from where numbers are `seen` at."""
    chosen = dict.fromkeys([proposal.candidate, *proposal.alike])
    view = View.at(seen, list(chosen | dict.fromkeys(proposal.others[:_COMPARED])))
    place, noted = place_of(seen, floor, view.scene), Noted()
    worth = [
        one
        for one in view.screening.candidates
        if isinstance(one.suspect, Catalogued) and one.suspect.candidate in chosen
    ]
    worth = [timed(view.bench, one, view.suspects) if of_every_clock(one) else one for one in worth]
    passed, fallen = tried(worth, view, seen, floor, simulate, leaps=False)
    noted.fell(*fallen)
    found = believed(passed, view, standing, place, floor, simulate, accepted, noted) if passed else None
    return Round(found, standing if found is None else found.tried.standing, seen, view.screening, noted, place)


def place_of(standing: Standing, floor: Floor, scene: Scene) -> Location | None:
    """Where what is left enters; None for a rig that its motion drives, or where there is too little of it."""
    if not scene.paths:
        return None
    cells, models, names = cells_and_ports(standing, floor, scene.paths)
    if not len(cells.z):
        return None
    test = port_test(cells, models)
    return Location(test, cells, tuple(names[port] for port in test.only))
