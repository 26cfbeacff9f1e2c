"""All orders of a law that has orders: a ripple is seldom one sine, and what is left of it would hide what is not.

Along the linear plant the orders of a law's grid, those that residuals proposed among them, are added one by one to the
best, and harmonics of it: that one next which, all amplitudes fitted anew, gains most.
"""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from kbs_process.diagnosis.experiments.thresholds import FALSE_ALARM, ITS_OWN, LEAST_RHO, ORDERS_SHARE
from kbs_process.diagnosis.proposing.proposals import LONGEST_BEAT
from kbs_process.diagnosis.proposing.view import View
from kbs_process.diagnosis.screening.gls import Score, Sums, score
from kbs_process.diagnosis.screening.ranges import SPECTRUM
from kbs_process.diagnosis.screening.screen import Bench, Catalogued, Found
from kbs_process.diagnosis.screening.suspects import Candidate, free_actions
from kbs_process.estimation.tails import log_tail
from kbs_process.plant.effect import Effect
from kbs_process.plant.laws import find
from kbs_process.signals.records import Array

_PARTS = (1, 2, 3)  # of a series, which comes once a turn at least, that an order may be; or a tone
_EXACT = 1e-9  # of a cycle: beats are proposed as fractions of them
_HARMONICS = 12  # of an order that are tried


def with_orders(view: View, found: Found) -> Found:
    """A suspect of the screen with all orders that it needs; itself, if its law has none or one alone does.

    Each has to gain what a suspect has to, after as many trials as it was chosen from, and to be no smaller a part of
    the whole than what a formula may miss of nature's. It has to be another order on the motions that were recorded: in
    a part of a turn some low ones together are any curve.
    """
    suspect = found.suspect
    if not (isinstance(suspect, Catalogued) and suspect.candidate.effect.in_plant):
        return found
    others = [_of_order(suspect, order) for order in _others(view, suspect)]
    actions = _free(suspect)
    chosen, best = _added(view.bench, suspect, others, found.score, len(actions))
    if not chosen:
        return found
    gained = best.gain - found.score.gain
    spent = 0.5 * (best.rank - found.score.rank) * np.log(view.bench.background.rows)
    again = tuple(_as(action, others[k].candidate) for action, k in zip(actions, chosen, strict=False))
    whole = replace(suspect, candidate=replace(suspect.candidate, again=again))
    return replace(found, suspect=whole, score=best, log_evidence=found.log_evidence + 0.5 * gained - float(spent))


def _others(view: View, suspect: Catalogued) -> list[float]:
    """Orders of a suspect's law that the screen has tried, and harmonics of its own; none of a law without.

    What comes again with a turn is seldom a sine. A residual shows few of its harmonics, and those not in their order:
    its own may be the second or the third of a series.
    """
    tried = [
        value
        for one in view.suspects
        if isinstance(one, Catalogued) and one.family == suspect.family
        for value in _orders(one)
    ]
    own = _orders(suspect)
    tones = any(entry.over == SPECTRUM for entry in suspect.candidate.effect.parameters)
    series = [(order, part) for order in own for part in _parts(view, tones, order) if tones or order >= part]
    highest = view.standing.known.experiment.highest_Hz if tones else max([*tried, *own], default=0.0)
    harmonics = [
        k * order / part
        for order, part in series
        for k in range(1, part * _HARMONICS + 1)
        if k != part and k * order / part <= highest
    ]
    return [value for value in dict.fromkeys([*tried, *harmonics]) if value not in own]


def _parts(view: View, tones: bool, order: float) -> tuple[int, ...]:
    """Which of a series an order may be: of a beat of the controller's cycles the one that it is, too."""
    controller = view.standing.known.experiment.rig.controller
    if not tones or controller is None:
        return _PARTS
    cycles = order * float(controller.cycle)
    beat = Fraction(cycles).limit_denominator(LONGEST_BEAT)
    own = (beat.numerator,) if abs(cycles - beat) < _EXACT and beat.numerator not in _PARTS else ()
    return (*_PARTS, *own)


def _orders(suspect: Catalogued) -> list[float]:
    names = _of_lines(suspect.candidate)
    return [value for name, value in suspect.candidate.shape if name in names]


def _of_lines(candidate: Candidate) -> set[str]:
    """Names of a law's orders, or of its tones, where these come again in all recordings."""
    effect = candidate.effect
    return {
        entry.name
        for entry in effect.parameters
        if entry.is_order or (entry.over == SPECTRUM and not effect.each_trial)
    }


def _of_order(suspect: Catalogued, order: float) -> Catalogued:
    """A suspect with another order, and the rest of its shape."""
    names = _of_lines(suspect.candidate)
    shape = tuple((name, order if name in names else value) for name, value in suspect.candidate.shape)
    return replace(suspect, candidate=replace(suspect.candidate, shape=shape))


def _added(
    bench: Bench, suspect: Catalogued, others: list[Catalogued], first: Score, most: int
) -> tuple[list[int], Score]:
    """Which of the `others`, at `most` so many, belong to a suspect, and what all of them do."""
    if not others:
        return [], first
    sums = Sums.over(bench.background, bench.columns([suspect, *others]))
    m = len(suspect.amplitudes)
    chosen: list[int] = []
    best, rows = first, bench.background.rows
    whole = sum(float(z @ z) for z in bench.background.z.values()) / rows
    while len(chosen) < most:
        before = _columns([-1, *chosen], m)
        left = [k for k in range(len(others)) if k not in chosen and _own(sums.SS, before, _columns([k], m)) > ITS_OWN]
        if not left:
            break
        tried = [score(bench.background, sums.pick(_columns([-1, *chosen, k], m))) for k in left]
        place = int(np.argmax([one.gain for one in tried]))
        gained, rank = tried[place].gain - best.gain, tried[place].rank - best.rank
        chance = log_tail(max(gained, 0.0), max(rank, 1)) + np.log(len(left))
        # What is left beside all others counts as noise: it has some of every order.
        level = max(1.0, whole - tried[place].gain / rows)
        least = max(level * LEAST_RHO**2, ORDERS_SHARE**2 * first.gain)
        if rank < 1 or not gained > least or chance > np.log(FALSE_ALARM):
            break
        chosen.append(left[place])
        best = tried[place]
    return chosen, best


def _own(SS: Array, before: NDArray[np.intp], new: NDArray[np.intp]) -> float:
    """How far some columns are from those before them, and from each other: the least share of a combination's square.

    1 where all are orthogonal; a sine and a cosine that a short motion shows as one are no order of their own either.
    """
    across = SS[np.ix_(before, new)]
    size = np.sqrt(np.maximum(np.diag(SS), 1e-300))
    basis = np.linalg.lstsq(
        SS[np.ix_(before, before)] / np.outer(size[before], size[before]), across / size[before, None]
    )
    rest = SS[np.ix_(new, new)] - (across / size[before, None]).T @ basis[0]
    return float(np.linalg.eigvalsh(rest / np.outer(size[new], size[new]))[0])


def _columns(members: list[int], m: int) -> NDArray[np.intp]:
    """Places of the amplitudes of some suspects, -1 the first."""
    return np.concatenate([np.arange((k + 1) * m, (k + 2) * m) for k in members])


def _free(suspect: Catalogued) -> list[Effect]:
    """Further actions of a suspect's law that it can have at its site."""
    hypothesis, candidate = suspect.scene.hypothesis, suspect.candidate
    law = find(candidate.name)
    assert law is not None
    free = free_actions(law, hypothesis.rig, candidate.site, hypothesis.effects)
    return [action for action in free if action.name != candidate.effect.name]


def _as(action: Effect, other: Candidate) -> Candidate:
    """A candidate as another action of its law, with names of its own."""
    names = [entry.name for entry in action.parameters if entry.role == "shape"]
    shape = zip(names, (value for _, value in other.shape), strict=True)
    return Candidate(action, other.site, tuple(shape))
