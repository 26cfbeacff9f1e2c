"""Leaders of a screen, one after the other put into the plant, refitted and gated."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

from kbs_process.diagnosis.acceptance.finding import Tried
from kbs_process.diagnosis.acceptance.rivals import probabilities
from kbs_process.diagnosis.acceptance.verdict import gated
from kbs_process.diagnosis.experiments.floor import Floor
from kbs_process.diagnosis.experiments.hypothesis import Simulate
from kbs_process.diagnosis.experiments.thresholds import (
    BENT,
    LEAD,
    LEADERS,
    MISTIMED,
    MOST,
    PROMISED,
    REREAD,
    SECOND,
    SHAPED,
    TOLERATED,
)
from kbs_process.diagnosis.nominal.joint import Standing, bare, moved_on, with_extra
from kbs_process.diagnosis.nominal.settling import resettled
from kbs_process.diagnosis.proposing.clocks import timed
from kbs_process.diagnosis.proposing.orders import with_orders
from kbs_process.diagnosis.proposing.sizes import springs
from kbs_process.diagnosis.proposing.tryout import extra_of, identity, in_plant, of_every_clock
from kbs_process.diagnosis.proposing.view import View
from kbs_process.diagnosis.screening.screen import Catalogued, Found, Suspect
from kbs_process.diagnosis.screening.shapes import bettered, possible, uncovered
from kbs_process.diagnosis.selection.each_recording import taken_off, taken_off_again
from kbs_process.diagnosis.selection.effort import Effort
from kbs_process.diagnosis.selection.race import at_floor, own_of, raced
from kbs_process.diagnosis.side_by_side import side_by_side
from kbs_process.plant.effect import UNNAMED, Port
from kbs_process.plant.sensing import BY


def leaders(
    view: View, simulate: Simulate, among: Callable[[Found], bool] = lambda _: True
) -> tuple[list[Found], list[Found]]:
    """The most probable suspects, as many as the linear plant may have in the wrong order, and a few that come next.

    Each with its shape bettered along the linear plant, if that could bring it among them, and with all orders that it
    needs; what is a spring in the way of the drives' torque at the size that does most in the plant. Of a law that a
    channel can show in many ways, as products of others are, the best stands for all; laws of one family at one place
    come after the best of the others.
    """
    best: dict[tuple[str, ...], Found] = {}
    for found in filter(among, view.able):
        best.setdefault(_way(found), found)
    every = list(best.values())
    if not every:
        return [], []
    stiff = [found for found in springs(view, simulate, among) if found not in view.screening.candidates]
    every = [found for found in every if _way(found) not in {*map(_way, stiff)}]
    most = max(found.score.gain for found in (*every, *stiff))
    able = [*every[:SHAPED], *(one for one in every[SHAPED:] if _mistimed(one, most))]
    least = (1.0 - LEAD) * most / BENT if view.ordered else 0.0
    worth = [found for found in able if found.score.gain >= least or _mistimed(found, most)]
    shaped = [*side_by_side(partial(_shaped, view, most), worth), *_covered(view, among)]
    able = [*(with_orders(view, one) for one in shaped), *stiff, *(one for one in able if one not in worth)]
    able = sorted(filter(possible, able), key=lambda found: -found.log_evidence)
    if not able:
        return [], []
    bound = (1.0 - LEAD) * able[0].score.gain if view.ordered else 0.0
    gross = view.standing.known.gross
    first = various([found for found in able if found.score.gain >= bound or found is able[0]])
    first = first[: SHAPED if gross else LEADERS]
    return first, [found for found in able if found not in first][: SHAPED if gross else SECOND]


def _shaped(view: View, most: float, found: Found) -> Found:
    """A suspect at its best shape, or its best size where its signature is another one at every size."""
    if _mistimed(found, most):
        return timed(view.bench, found, view.suspects)
    return bettered(view.bench, found)


def _mistimed(found: Found, most: float) -> bool:
    """Whether it is the error of a clock, the same in all recordings, that does some of the `most` that any does."""
    return of_every_clock(found) and found.score.gain >= MISTIMED * most


def _covered(view: View, among: Callable[[Found], bool]) -> list[Found]:
    """Forces of the laboratory that known numbers take up wherever they were tried, and that may do most of all.

    They are looked at where such a force does much of what there is to do. Beside known numbers that were pulled, one
    does far more in the plant than to first order.
    """
    most = max(found.score.gain for found in view.able)
    if not any(_pulls(found) and found.score.gain >= MOST * most for found in view.able):
        return []
    taken_up = [
        found for found in view.screening.candidates if _anywhere(found) and found.score.rank == 0 and among(found)
    ]
    hidden = side_by_side(partial(_uncovered, view), taken_up)
    least = most / PROMISED if view.standing.known.gross else most
    return [one for one in hidden if one.score.gain > least]


def _uncovered(view: View, found: Found) -> Found:
    alike = [one for one in view.suspects if isinstance(one, Catalogued) and one.family == found.suspect.family]
    return uncovered(view.bench, found, alike)


def _pulls(found: Found) -> bool:
    return isinstance(found.suspect, Catalogued) and found.suspect.candidate.port is Port.EXTERNAL_FORCE


def _anywhere(found: Found) -> bool:
    return isinstance(found.suspect, Catalogued) and found.suspect.candidate.effect.anywhere


def various(chosen: Sequence[Found]) -> list[Found]:
    """The best at each place, then of each other family there, then the others; in each part the order is kept.

    Laws of one place do nearly the same, and would leave none of another's tried. Many orders together follow what
    another law of their family has, and do not stand for it. Delays are alike to first order, and the plant alone tells
    them apart.
    """
    places: dict[tuple[str, ...], Found] = {}
    families: dict[tuple[str, ...], Found] = {}
    for found in chosen:
        own = identity(found.suspect)
        place = own.place.port, own.place.site, *own.place.channels
        several = isinstance(found.suspect, Catalogued) and bool(found.suspect.candidate.again)
        kind = own.law if _delays(found.suspect) else own.family
        places.setdefault(place, found)
        families.setdefault((*place, kind, str(several)), found)
    return list(dict.fromkeys([*places.values(), *families.values(), *chosen]))


def _delays(suspect: Suspect) -> bool:
    return isinstance(suspect, Catalogued) and bool(suspect.candidate.effect.delay)


def _way(found: Found) -> tuple[str, ...]:
    own = identity(found.suspect)
    return own.place.port, own.place.site, own.law, *own.place.channels[:1]


def tried(
    chosen: Sequence[Found], view: View, before: Standing, floor: Floor, simulate: Effort, *, leaps: bool = True
) -> tuple[list[Tried], list[Tried]]:
    """Leaders of a view refitted and gated against what was believed `before`: those that passed, and those that did
    not. Better phases are looked for if `leaps`.
    """
    judged = [taken_off(found, view) for found in chosen if found.suspect.each_trial]
    runners = raced([found for found in chosen if not found.suspect.each_trial], view, floor, simulate, leaps=leaps)
    for number, runner in enumerate(runners):
        own = own_of(runner.found, before, runner.standing)
        verdict = gated(runner.found, before, runner.standing, own, simulate)
        if number == 0 and not (verdict.passed or runner.leapt) and at_floor(runner, floor):
            # It left nothing after its first steps. What other numbers lack there may be all that speaks against it.
            runner = replace(runner, standing=moved_on(runner.standing, simulate, leaps=leaps), leapt=True)
            verdict = gated(runner.found, before, runner.standing, own, simulate)
        judged.append(Tried(runner.found, runner.standing, verdict, view.screening, own, runner.leapt))
    return [one for one in judged if one.gate.passed], [one for one in judged if not one.gate.passed]


def reread(chosen: Tried, before: Standing, floor: Floor, simulate: Simulate) -> Tried:
    """A law of the readings told anew among all of its channel, now that the known numbers have settled beside it.

    In the plant shapes are fitted; such a law has the one that the screen gave it while numbers were still pulled, and
    goes on from there to first order. So it is told again as long as that changes much.
    """
    suspect = chosen.found.suspect
    of_clock = isinstance(suspect, Catalogued) and suspect.of_clock
    if in_plant(suspect) or not (chosen.own.names or of_clock):
        return chosen
    enough = TOLERATED * before.known.fit_rows
    for _ in range(REREAD):
        if not chosen.own.names:
            again = taken_off_again(chosen)
            told = replace(again, standing=resettled(again.standing, floor, simulate, leaps=0))
        elif of_clock:
            told = _set_anew(chosen, before, floor, simulate)
        else:
            told = _told_anew(chosen, before, floor, simulate)
        gained = chosen.standing.known.cost - told.standing.known.cost
        chosen = told
        if not gained > enough:
            break
    return chosen


def _told_anew(chosen: Tried, before: Standing, floor: Floor, simulate: Simulate) -> Tried:
    """The best law of a channel beside the known numbers as they are, if it is likelier than the one `chosen`."""
    suspect, standing = chosen.found.suspect, chosen.standing
    site = _reads(suspect)
    view = View.of(
        bare(standing, chosen.own, simulate),
        lambda one: _reads(one) == site and not in_plant(one) and not one.each_trial,
        linear=False,
    )
    # A curve follows what the law does, and says no more of it than its name does.
    named = identity(suspect).family != UNNAMED
    able = [one for one in view.able if not (named and identity(one.suspect).family == UNNAMED)]
    if not able or _alike(able[0].suspect, suspect):
        return chosen
    found = bettered(view.bench, able[0])
    new = with_extra(view.standing, extra_of(found, view.standing, view.bench, view.scene), simulate)
    new = resettled(new, floor, simulate, leaps=0)
    own = own_of(found, before, new)
    told = Tried(found, new, gated(found, before, new, own, simulate), view.screening, own)
    chances = probabilities([standing.known, new.known], view.bench.background.rows)
    return told if told.gate.passed and chances[1] > chances[0] else chosen


def _set_anew(chosen: Tried, before: Standing, floor: Floor, simulate: Simulate) -> Tried:
    """The error of a clock, of whichever law, at the size that it has beside known numbers as they are, if likelier."""
    standing, site = chosen.standing, _reads(chosen.found.suspect)
    view = View.of(
        bare(standing, chosen.own, simulate),
        lambda one: isinstance(one, Catalogued) and one.of_every_clock and _reads(one) == site,
        linear=False,
    )
    every = [timed(view.bench, one, view.suspects) for one in view.screening.candidates]
    found = max(every, key=lambda one: one.log_evidence)
    new = with_extra(view.standing, extra_of(found, view.standing, view.bench, view.scene), simulate)
    new = resettled(new, floor, simulate, leaps=0)
    own = own_of(found, before, new)
    told = Tried(found, new, gated(found, before, new, own, simulate), chosen.screening, own, chosen.leapt)
    return told if new.known.cost < standing.known.cost else chosen


def _reads(suspect: Suspect) -> str:
    """Site of a law of readings; of one that others act on, the channel that reads."""
    return suspect.family[1].split(BY)[0]


def _alike(one: Suspect, other: Suspect) -> bool:
    """Whether two suspects are one law of one shape."""
    if not (isinstance(one, Catalogued) and isinstance(other, Catalogued)):
        return one.family == other.family
    return one.family == other.family and one.candidate.shape == other.candidate.shape
