"""Round by round: screen, simulate the leaders, gate, accept the most probable, and look again at what is left."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from kbs_process.diagnosis.acceptance.finding import Tried, as_it_stands, find_of, merged, trusted
from kbs_process.diagnosis.acceptance.needed import Accepted, in_the_shade, needed
from kbs_process.diagnosis.acceptance.outcome import Absorbed, Outcome
from kbs_process.diagnosis.acceptance.remains import promises_little
from kbs_process.diagnosis.acceptance.supposed import Noted, enough, supposed, wanting
from kbs_process.diagnosis.experiments.floor import Floor
from kbs_process.diagnosis.experiments.hypothesis import Simulate
from kbs_process.diagnosis.experiments.thresholds import (
    HIDDEN,
    LEAST_RHO,
    MOST,
    PROMISED,
    ROUNDS,
    SECOND,
    TRUST,
    TRUST_PART,
)
from kbs_process.diagnosis.facts import Moved
from kbs_process.diagnosis.nominal.detection import Detection
from kbs_process.diagnosis.nominal.joint import Standing, bare, standing_of, without
from kbs_process.diagnosis.nominal.known import MOVED, Known, refit
from kbs_process.diagnosis.nominal.scatter import scattered
from kbs_process.diagnosis.nominal.settling import bent, detected, drawn_back, nominal, resettled, searched
from kbs_process.diagnosis.proposing.clocks import timed
from kbs_process.diagnosis.proposing.sizes import in_the_way, of_mounting, springs
from kbs_process.diagnosis.proposing.tryout import identity, of_every_clock
from kbs_process.diagnosis.proposing.view import View
from kbs_process.diagnosis.screening.scene import Scene
from kbs_process.diagnosis.screening.screen import Catalogued, Found, Screening
from kbs_process.diagnosis.screening.shapes import possible
from kbs_process.diagnosis.selection.believed import believed
from kbs_process.diagnosis.selection.each_recording import jump_gain
from kbs_process.diagnosis.selection.effort import Effort
from kbs_process.diagnosis.selection.leaders import leaders, tried
from kbs_process.diagnosis.selection.proposed import Round, nothing, numbers_beside, place_of, proposed
from kbs_process.diagnosis.side_by_side import side_by_side
from kbs_process.diagnosis.smoothing.search import Smoothed


def diagnose(
    known: Known,
    floor: Floor,
    simulate: Simulate,
    before: Detection,
    near: Known | None = None,
    *,
    beside: bool = False,
    smoothed: Smoothed | None = None,
) -> Outcome:
    """Find the laws that the refitted known parameters leave out; `before` is what detection says of these.

    Where these explain it, but far from their priors, `near` are numbers that stayed: a law beside them is what was
    left out, if both together are likelier by as much as a law has to bring. Numbers that were found `beside` the error
    of a clock have not been pulled by it.
    """
    effort = Effort(simulate, known)
    if near is not None:
        left = detected(standing_of(near, {}), floor, near.experiment.fit)
        instead = _diagnosed(near, floor, effort, left, at_once=True, pulled=not beside)
        if instead.finds:
            alone = _alone(known, near, instead.standing.known, floor, effort)
            if instead.standing.known.cost < alone.cost - LEAST_RHO**2:
                return replace(instead, otherwise=_moved(alone))
            if alone is not known:
                known, before = alone, detected(standing_of(alone, {}), floor, alone.experiment.fit)
    return _diagnosed(known, floor, effort, before, smoothed)


def _alone(known: Known, near: Known, beside: Known, floor: Floor, simulate: Simulate) -> Known:
    """Known numbers without a law, set free from where they were, or from where they are `beside` one.

    A search ends in one of many minima, and those that are without a law begin with as good a chance. A minimum by
    which recordings that were held out are predicted worse is none of theirs.
    """
    unseen = known.experiment.held_out
    start = near.hypothesis.at(near.free, beside.value[: len(near.free)])
    again = refit(known.experiment, start, floor, simulate, leaps=1)
    here, there = (detected(standing_of(one, {}), floor, unseen).ratio if unseen else 1.0 for one in (again, known))
    better = again.cost < known.cost and not here > there
    return replace(again, chi2_before=known.chi2_before) if better else known


def _diagnosed(
    known: Known,
    floor: Floor,
    simulate: Effort,
    before: Detection,
    smoothed: Smoothed | None = None,
    *,
    at_once: bool = False,
    pulled: bool = True,
) -> Outcome:
    """Find what one refit of the known parameters leaves out.

    What numbers alone explain, far from their priors, one law has to explain `at_once`, but for what may be another's:
    laws that leave much are not looked beyond. A search that has cost too much ends with what it has found.
    """
    begun = Standing(known, known.shown, {})
    standing = begun
    accepted: list[Accepted] = []
    rounds: list[Round] = []
    proposals = () if smoothed is None else smoothed.proposals
    for proposal in proposals:
        seen = standing if accepted or smoothed is None else numbers_beside(known, smoothed, simulate)
        rounds.append(proposed(proposal, standing, seen, floor, simulate, accepted))
        if rounds[-1].accepted is not None:
            accepted.append(rounds[-1].accepted)
            standing = rounds[-1].standing
    if not proposals and smoothed is not None:
        rounds.append(nothing(standing, floor))
    # Where smoothing has looked there is nothing else to look for: what the plant refuses, or leaves, has no name.
    for _ in range(ROUNDS if smoothed is None else 0):
        seen = drawn_back(standing, floor, simulate) if pulled or accepted else standing
        looked = [_round(standing, seen, floor, simulate, accepted)]
        if looked[0].accepted is None and not at_once:
            looked += _pair(looked[0], floor, simulate, accepted)
        rounds += looked
        standing = rounds[-1].standing
        found = [one.accepted for one in looked if one.accepted is not None]
        if not found:
            break
        accepted += found
        if (at_once and standing.known.gross) or not (_goes_on(standing, floor) and simulate.goes_on()):
            break
    last = rounds[-1]
    kept, standing, fallen = needed(accepted, standing, floor, simulate)
    left = last.place
    if standing is not last.seen:
        left = place_of(standing, floor, Scene.of(known.experiment, standing.hypothesis, standing.predicted))
    same = standing is begun
    after = before if same else detected(standing, floor, known.experiment.fit)
    held_out = None
    if known.experiment.held_out:
        unseen = detected(begun, floor, known.experiment.held_out)
        held_out = unseen, unseen if same else detected(standing, floor, known.experiment.held_out)
    told = replace(standing, known=replace(standing.known, covariance=scattered(standing.known)))
    finds = [as_it_stands(one.find, one.tried.own, told.known) for one in kept]
    outcome = Outcome(
        before=before,
        after=after,
        held_out=held_out,
        log_p=_mismatch(before, rounds[0].screening, kept),
        moved=_moved(told.known),
        finds=merged(finds),
        refused=(*fallen, *next((one.noted.refused for one in reversed(rounds) if one.noted.refused), ())),
        absorbed=_absorbed(last.screening),
        place=rounds[0].place,
        left=left,
        known=known,
        standing=told,
        strain=standing.known.strain if smoothed is None else (smoothed.beside if accepted else smoothed.alone).strain,
        ended=simulate.ended,
    )
    return replace(outcome, finds=trusted(outcome.finds, TRUST_PART if outcome.verdict == "undecided" else TRUST))


def _goes_on(standing: Standing, floor: Floor) -> bool:
    """Whether something is left beside laws that were found, or numbers have taken something up."""
    return detected(standing, floor, standing.known.experiment.fit).left or bent(standing, floor)


def _mismatch(before: Detection, first: Screening, kept: Sequence[Accepted]) -> float:
    """The lesser of two p-values, of any mismatch and of the first find, times two (Bonferroni).

    A suspect that did not pass the gate does not count: small gains are more frequent than chance has them, as the
    plant is not exact.
    """
    if not kept:
        return before.log_p
    found = (one.log_p for one in first.candidates if identity(one.suspect) == kept[0].find.identity)
    return float(min(0.0, np.log(2.0) + min([before.log_p, *found])))


def _round(
    standing: Standing, seen: Standing, floor: Floor, simulate: Effort, accepted: Sequence[Accepted], least: float = 0.0
) -> Round:
    """Look for one more law from where numbers are `seen` at, which may have been drawn back.

    The best has to promise to gain `least`, of -2 log likelihood.
    """
    if seen.known.cost < standing.known.cost:
        # Numbers had ended in a worse place: what they do alone, once they have settled, is no law's.
        standing = resettled(seen, floor, simulate, leaps=1)
    view = View.of(seen)
    place = place_of(seen, floor, view.scene)
    noted = Noted()
    for passed in _passed(view, standing, floor, simulate, accepted, noted, least):
        if found := believed(passed, view, standing, place, floor, simulate, accepted, noted):
            return Round(found, found.tried.standing, seen, view.screening, noted, place)
    return Round(None, standing, seen, view.screening, noted, place)


def _pair(last: Round, floor: Floor, simulate: Effort, accepted: Sequence[Accepted]) -> tuple[Round, ...]:
    """Two rounds that find two laws, of which neither passes without the other, where the `last` one found none.

    One that did not pass is supposed; if another passes beside it, the supposed one is taken out of the plant, and has
    to be found beside the other like any law.
    """
    for one in supposed(last.noted.fallen, last.standing.known):
        if not simulate.goes_on():
            break
        told = find_of([one], np.ones(1), last.standing, None)
        there = one.standing if one.leapt else resettled(one.standing, floor, simulate, leaps=1)
        beside = [*accepted, Accepted(one, told, last.standing)]
        least = wanting(last.standing.known, there.known)
        other = _round(there, drawn_back(there, floor, simulate), floor, simulate, beside, least)
        if other.accepted is None or not enough(last.standing.known, other.standing.known):
            continue
        seen = bare(other.standing, one.own, simulate)
        again = _round(without(other.standing, one.own, simulate), seen, floor, simulate, [*accepted, other.accepted])
        if again.accepted is not None and enough(last.standing.known, again.standing.known):
            return other, again
    return ()


def _passed(
    view: View,
    before: Standing,
    floor: Floor,
    simulate: Effort,
    accepted: Sequence[Accepted],
    noted: Noted,
    least: float = 0.0,
) -> Iterator[list[Tried]]:
    """Suspects of a view that passed the gate; then, if none of these stands, those that are each recording's own.

    Of the first the ones that leave less already than what was believed `before`, if there are any. Those that did not
    pass are noted.
    """
    passed: list[Tried] = []
    there = detected(before, floor, before.known.experiment.fit)
    if reason := promises_little(view, there):
        noted.refuse(view.able[0], reason)
        return
    for found in view.able:
        if reasons := in_the_shade(found, accepted):
            noted.refuse(found, *reasons)
    # What each recording has of its own predicts none, and beside a law that was found takes up what its formula lacks.
    own = there.left or not accepted
    if own and (jumped := _jumped(view, floor, simulate)):
        yield jumped
    first, others = leaders(
        view, simulate, lambda found: (own or not found.suspect.each_trial) and not in_the_shade(found, accepted)
    )
    if least > 0.0 and _hopeless(first, least):
        noted.refuse(first[0], "the best beside it would leave far too much")
        return
    for number, chosen in enumerate((first, *([found] for found in others))):
        if number > 0 and not simulate.goes_on():
            break
        more, less = tried(chosen, view, view.standing, floor, simulate)
        passed = [*passed, *more]
        noted.fell(*less)
        if less_is_left := [one for one in passed if one.standing.known.cost < before.known.cost]:
            passed = less_is_left
            break
    if simulate.goes_on() and not any(_explains_all(one, floor) for one in passed):
        passed = _joined(passed, _hidden(view, before, floor, simulate, accepted), before, noted)
    if passed:
        yield passed
    if own and (chosen := view.unrepeated[:SECOND]):
        # What seemed to do nearly as well and to come again did not stand.
        more, less = tried(chosen, view, view.standing, floor, simulate)
        noted.fell(*less)
        if more:
            yield more


def _explains_all(one: Tried, floor: Floor) -> bool:
    """Whether a law leaves nothing, and numbers beside it are where the files have them, as far as chance goes."""
    known = one.standing.known
    return not known.strained and not detected(one.standing, floor, known.experiment.fit).left


def _jumped(view: View, floor: Floor, simulate: Effort) -> list[Tried]:
    """Jumps of a clock that do most of so much that numbers may have been pulled, before any law is simulated.

    To first order a jump by a period of what rings does nothing, so the screen's order says nothing of them. They have
    to do more than an error of a clock that all recordings share. Those that do not are judged in their turn.
    """
    known, every = view.standing.known, view.screening.candidates
    chosen = [one for one in every if isinstance(one.suspect, Catalogued) and one.suspect.jumps]
    if not (known.gross and chosen):
        return []
    more, _ = tried(chosen, view, view.standing, floor, simulate)
    gains = [jump_gain(one.found, known, one.standing.known) for one in more]
    jumps = [(one, gain) for one, gain in zip(more, gains, strict=True) if gain > MOST * known.excess]
    if not jumps:
        return []
    clocks = [one for one in every if of_every_clock(one)]
    shared = side_by_side(lambda one: timed(view.bench, one, view.suspects), clocks)
    most = max((one.score.gain for one in shared), default=0.0)
    return [one for one, gain in jumps if gain > most]


def _hidden(view: View, before: Standing, floor: Floor, simulate: Effort, accepted: Sequence[Accepted]) -> list[Tried]:
    """Springs in the way of a drive's torque, from numbers near the files': those that were pulled had taken them up.

    A gear that is softer, or joints that seem to rub, leave little of one, and that has the form of something else.
    """
    if not before.known.strained or not searched(before.known.experiment):
        return []
    near = View.of(nominal(before, simulate), in_the_way)
    chosen = springs(near, simulate, lambda found: not in_the_shade(found, accepted))
    worth = [found for found in chosen if possible(found) and found.score.gain >= LEAST_RHO**2][:HIDDEN]
    more, less = tried(worth, near, view.standing, floor, simulate)
    return [replace(one, screening=view.screening) for one in (*more, *less)]


def _joined(passed: Sequence[Tried], hidden: Sequence[Tried], before: Standing, noted: Noted) -> list[Tried]:
    """Laws that passed with those `hidden` that did: of one law, tried from two places, the better counts."""
    every = list(passed)
    for one in hidden:
        law = identity(one.found.suspect)
        done = [other for other in (*every, *noted.fallen) if identity(other.found.suspect) == law]
        less = any(other.standing.known.cost <= one.standing.known.cost for other in done)
        if less or (not one.gate.passed and any(other.gate.passed for other in done)):
            continue
        for other in done:
            if other in noted.fallen:
                noted.forget(other)
        every = [other for other in every if other not in done]
        if one.standing.known.cost >= before.known.cost:
            noted.fell(replace(one, gate=one.gate.but("no less is left with it than without")))
        elif one.gate.passed:
            every.append(one)
        else:
            noted.fell(one)
    return every


def _hopeless(first: Sequence[Found], least: float) -> bool:
    """Whether the best of some leaders would gain far less than `least`; of a mounting's law no first order tells."""
    most = max((found.score.gain for found in first), default=0.0)
    return PROMISED * most < least and not any(of_mounting(found) for found in first)


def _moved(known: Known) -> tuple[Moved, ...]:
    stated = {name for name, own in zip(known.names, known.stated, strict=True) if own}
    return tuple(
        one for one in known.numbers if one.name in stated and one.sigmas is not None and abs(one.sigmas) > MOVED
    )


def _absorbed(screening: Screening) -> tuple[Absorbed, ...]:
    return tuple(
        Absorbed(identity(found.suspect), found.score.kappa, found.score.rho, found.absorbed_by)
        for found in screening.candidates
        if found.absorbed
    )
