"""Which of some laws that passed the gate is believed: the likeliest that passes once more with all numbers settled."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.special import softmax

from kbs_process.diagnosis.acceptance.finding import Tried, find_of
from kbs_process.diagnosis.acceptance.needed import Accepted
from kbs_process.diagnosis.acceptance.outcome import Location
from kbs_process.diagnosis.acceptance.remains import only_while, too_little
from kbs_process.diagnosis.acceptance.rivals import evidences
from kbs_process.diagnosis.acceptance.supposed import Noted
from kbs_process.diagnosis.acceptance.verdict import gated
from kbs_process.diagnosis.experiments.floor import Floor
from kbs_process.diagnosis.experiments.hypothesis import Simulate
from kbs_process.diagnosis.experiments.thresholds import CONTESTED, GATE_SIGMA, MOST, SECOND, SETTLED, TOLERATED
from kbs_process.diagnosis.facts import Identity, Place
from kbs_process.diagnosis.nominal.joint import Standing
from kbs_process.diagnosis.nominal.settling import released, resettled
from kbs_process.diagnosis.proposing.tryout import identity
from kbs_process.diagnosis.proposing.view import View
from kbs_process.diagnosis.screening.screen import Found
from kbs_process.diagnosis.screening.shapes import bettered
from kbs_process.diagnosis.selection.effort import Effort
from kbs_process.diagnosis.selection.leaders import reread, tried
from kbs_process.plant.effect import UNNAMED
from kbs_process.signals.records import Array


def believed(
    passed: Sequence[Tried],
    view: View,
    standing: Standing,
    place: Location | None,
    floor: Floor,
    simulate: Effort,
    accepted: Sequence[Accepted],
    noted: Noted,
) -> Accepted | None:
    """The likeliest of some laws that passed which passes once more with all numbers settled beside it, if one does.

    Beside the numbers that it was looked for from first; once all have settled, beside those that leave least.
    """
    if names := named_there(passed, noted.identities, view):
        more, less = tried(names, view, view.standing, floor, simulate)
        passed = [*passed, *more]
        noted.fell(*less)
    every = contested(passed, floor, simulate)
    passed = continued(named_first(every), [one.find.identity for one in accepted])
    if (beyond := beaten(passed, noted.fallen)) is not None:
        # What is missing elsewhere, or numbers that have yet to settle, speaks against it; the others are farther off.
        noted.forget(beyond)
        beyond = _settled(beyond, standing, floor, simulate)
        if not beyond.gate.passed:
            follows = f"{_law(beyond).law} leaves less"
            noted.fell(replace(beyond, gate=beyond.gate.but("nor with all numbers settled")))
            noted.fell(*(replace(one, gate=one.gate.but(follows)) for one in passed))
            return None
        passed = [beyond, *passed]
    chances = inherited(passed, every, view.bench.background.rows)
    order = [int(k) for k in np.argsort(-chances, kind="stable")]
    for number, best in enumerate(order[: SETTLED if beyond is None else 1]):
        told = passed[best] if passed[best] is beyond else _settled(passed[best], standing, floor, simulate)
        if reasons := (
            told.gate.reasons
            or _as_well_elsewhere(told, passed, standing)
            or _stands_in(told, standing, floor, simulate, accepted)
        ):
            noted.fell(replace(told, gate=told.gate.but(*reasons)) if told.gate.passed else told)
            continue
        # Told anew, it may be what another was: their chances are one then.
        others = [k for k in order[number + 1 :] if _law(passed[k]) != _law(told)]
        chance = chances[others] / max(float(chances[order[number:]].sum()), np.finfo(np.float64).tiny)
        find = find_of(
            [told, *(passed[k] for k in others)], np.array([1.0 - float(chance.sum()), *chance]), standing,
            place, noted.identities,
        )  # fmt: skip
        return Accepted(told, find, standing)
    return None


def contested(passed: Sequence[Tried], floor: Floor, simulate: Simulate) -> list[Tried]:
    """Laws that passed; where those of several places leave as little, the best of each place with numbers at ease.

    What their numbers are strained by then decides between them: it was done before any law was in the plant.
    """
    best = min(passed, key=lambda one: one.standing.known.cost)
    first: dict[Place, Tried] = {}
    for one in sorted(passed, key=lambda one: one.standing.known.cost):
        if one.own.names and _as_good(one, best):
            first.setdefault(_law(one).place, one)
    if len(first) < 2:
        return list(passed)
    rivals = list(first.values())[:CONTESTED]
    eased = [replace(one, standing=released(one.standing, floor, simulate)) for one in rivals]
    return [eased[rivals.index(one)] if one in rivals else one for one in passed]


def inherited(passed: Sequence[Tried], every: Sequence[Tried], rows: int) -> Array:
    """(passed,) chance of each; that of a curve which gave way to a law of its place is the likeliest law's there.

    What a formula has differently from nature says nothing of where nature acts.
    """
    gone = [one for one in every if one not in passed]
    all_laws = [*passed, *gone]
    logs = evidences([one.standing.known for one in all_laws], rows, [_each_time(one) for one in all_laws])
    mine, theirs = logs[: len(passed)].copy(), logs[len(passed) :]
    for one, log in zip(gone, theirs, strict=True):
        heirs = [k for k, other in enumerate(passed) if _law(other).place == _law(one).place]
        if heirs and _law(one).family == UNNAMED:
            heir = max(heirs, key=lambda k: logs[k])
            mine[heir] = np.logaddexp(mine[heir], log)
    return np.asarray(softmax(mine), dtype=np.float64)


def _settled(one: Tried, before: Standing, floor: Floor, simulate: Simulate) -> Tried:
    """A law that passed, with all numbers settled beside it, told anew and judged again."""
    settled = one.standing
    if not one.leapt:
        settled = resettled(settled, floor, simulate, leaps=1)
    if settled.known.excess < MOST * before.known.excess:
        settled = released(settled, floor, simulate)
    return _judged_again(reread(replace(one, standing=settled), before, floor, simulate), before, simulate)


def _as_well_elsewhere(told: Tried, passed: Sequence[Tried], before: Standing) -> tuple[str, ...]:
    """Why a law that is a few sigmas off zero by the scatter of parts is not known to be where it is; else nothing.

    Where numbers had taken nearly all of it up, laws at other places do as well.
    """
    if before.known.gross or not told.own.names or told.gate.sigmas >= GATE_SIGMA:
        return ()
    elsewhere = [_law(one) for one in passed if _as_good(one, told) and _law(one).place != _law(told).place]
    return tuple(f"{one.law} ({one.place.port}) does as well, and parts of recordings differ" for one in elsewhere)


def _stands_in(
    told: Tried, standing: Standing, floor: Floor, simulate: Simulate, accepted: Sequence[Accepted]
) -> tuple[str, ...]:
    """Why a law that has settled stands in for something else, or for what an earlier one lacks; nothing, if not."""
    earlier = [(one.find.identity.law, one.tried.own) for one in accepted if one.find.identity != _law(told)]
    # One more action of a law at the same place is part of the find.
    more = any(one.find.identity == _law(told) for one in accepted)
    little = too_little(standing, told.standing, floor, sigmas=told.gate.sigmas, more=more)
    return little or only_while(earlier, standing, told.standing.known, simulate)


def _each_time(one: Tried) -> int:
    """Numbers that a law brought which are each recording's own, and no free ones of the model."""
    suspect, experiment = one.found.suspect, one.standing.known.experiment
    if not suspect.each_trial:
        return 0
    trajectories = {experiment.trials[k].trajectory for k in experiment.fit}
    return len(suspect.amplitudes) * len(experiment.fit) + (suspect.places > 1) * len(trajectories)


def _judged_again(told: Tried, before: Standing, simulate: Simulate) -> Tried:
    """A law with the gate's verdict on it where its numbers have settled."""
    if not told.own.names:
        return told
    return replace(told, gate=gated(told.found, before, told.standing, told.own, simulate))


def named_first(passed: Sequence[Tried]) -> list[Tried]:
    """Laws without the curves that a law of the catalogue does as well as, at the same place.

    A curve follows what a formula has differently from nature, too: as far as the plant is not exact, that is no reason
    to leave a law without its name.
    """
    named = [one for one in passed if _law(one).family != UNNAMED]

    def told(curve: Tried) -> bool:
        return any(_same_axis(_law(one), _law(curve)) and _as_good(one, curve) for one in named)

    return [one for one in passed if one in named or not told(one)]


def _same_axis(one: Identity, other: Identity) -> bool:
    return (one.place.port, one.place.site) == (other.place.port, other.place.site)


def named_there(passed: Sequence[Tried], refused: Sequence[Identity], view: View) -> list[Found]:
    """Laws of the catalogue to try at the place of a curve that leaves least, if the screen had others before them.

    A curve takes the lead from the very law that it follows.
    """
    first = min(passed, key=lambda one: one.standing.known.cost)
    if _law(first).family != UNNAMED:
        return []
    where, done = _law(first), {*map(_law, passed), *refused}
    best: dict[Identity, Found] = {}
    for found in view.able:
        own = identity(found.suspect)
        if own.family != UNNAMED and _same_axis(own, where):
            best.setdefault(own, found)
    return [bettered(view.bench, found) for own, found in best.items() if own not in done][:SECOND]


def continued(passed: Sequence[Tried], accepted: Sequence[Identity]) -> list[Tried]:
    """Laws that were found already, if one more action of one does as well as the best; else all.

    A ripple has more orders than were added at once, and what is left of it has the form of something else, too.
    """
    more = [one for one in passed if _law(one) in accepted and all(_as_good(one, other) for other in passed)]
    return more or list(passed)


def beaten(passed: Sequence[Tried], fallen: Sequence[Tried]) -> Tried | None:
    """The law of the catalogue that leaves least, less than all that passed, of those that are but too uneven.

    What passes beside it follows what it does.
    """
    uneven = [
        one
        for one in fallen
        if one.gate.uneven and _law(one).family != UNNAMED and not any(_as_good(other, one) for other in passed)
    ]
    return min(uneven, key=lambda one: one.standing.known.cost, default=None)


def _as_good(one: Tried, other: Tried) -> bool:
    """Whether a law leaves no more than another, as far as the plant is exact."""
    known = other.standing.known
    return one.standing.known.cost <= known.cost + TOLERATED * known.fit_rows


def _law(one: Tried) -> Identity:
    return identity(one.found.suspect)
