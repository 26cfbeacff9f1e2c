"""Leaders of a screen, one after the other put into the plant, refitted and gated."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from scipy.linalg import cho_solve
from scipy.stats import chi2

from kbs_process.diagnosis.curves import CurveSuspect
from kbs_process.diagnosis.dissipation import drives, pushes
from kbs_process.diagnosis.evenness import evenly, parts
from kbs_process.diagnosis.families import UNNAMED
from kbs_process.diagnosis.finding import Tried, explained_share
from kbs_process.diagnosis.floor import Floor
from kbs_process.diagnosis.gate import Fold, Gate, gate, whiteness
from kbs_process.diagnosis.gls import Background, Score, Sums, score
from kbs_process.diagnosis.hypothesis import Simulate
from kbs_process.diagnosis.joint import Own, Standing, bare, moved_on, with_extra
from kbs_process.diagnosis.known import Known
from kbs_process.diagnosis.orders import with_orders
from kbs_process.diagnosis.outcome import Refused
from kbs_process.diagnosis.plausible import implausible, undone
from kbs_process.diagnosis.race import at_floor, own_of, raced
from kbs_process.diagnosis.rivals import probabilities
from kbs_process.diagnosis.screen import Bench, Catalogued, Found, Suspect
from kbs_process.diagnosis.settling import resettled
from kbs_process.diagnosis.shapes import bends, bettered, fitted, possible
from kbs_process.diagnosis.side_by_side import side_by_side
from kbs_process.diagnosis.suspects import BY
from kbs_process.diagnosis.thresholds import (
    BENT,
    FALSE_ALARM,
    LAW_VARIANCE,
    LEAD,
    LEADERS,
    REREAD,
    SECOND,
    SHAPED,
    TOLERATED,
)
from kbs_process.diagnosis.tryout import extra_of, identity, in_plant
from kbs_process.diagnosis.view import View
from kbs_process.plant.effect import Effect
from kbs_process.signals.records import Array


def leaders(view: View, among: Callable[[Found], bool] = lambda _: True) -> tuple[list[Found], list[Found]]:
    """The most probable suspects, as many as the linear plant may have in the wrong order, and a few that come next.

    Each with its shape bettered along the linear plant, if that could bring it among them, and with all orders that it
    needs. Of a law that a channel can
    show in many ways, as products of others are, the best stands for all; laws of one family at one place come after
    the best of the others.
    """
    best: dict[tuple[str, ...], Found] = {}
    for found in filter(among, view.able):
        best.setdefault(_way(found), found)
    able = list(best.values())[:SHAPED]
    if not able:
        return [], []
    least = (1.0 - LEAD) * max(found.score.gain for found in able) / BENT if view.ordered else 0.0
    worth = [found for found in able if found.score.gain >= least]
    shaped = side_by_side(partial(bettered, view.bench), worth)
    able = [*(with_orders(view, one) for one in shaped), *(one for one in able if one not in worth)]
    able = sorted(filter(possible, able), key=lambda found: -found.log_evidence)
    if not able:
        return [], []
    bound = (1.0 - LEAD) * able[0].score.gain if view.ordered else 0.0
    gross = view.standing.known.gross
    first = various([found for found in able if found.score.gain >= bound or found is able[0]])
    first = first[: SHAPED if gross else LEADERS]
    return first, [found for found in able if found not in first][: SHAPED if gross else SECOND]


def various(chosen: Sequence[Found]) -> list[Found]:
    """The best of each family at each place, then the others; in either part the order is kept.

    Many orders together follow what another law of their family has, and do not stand for it. Delays are alike to first
    order, and the plant alone tells them apart.
    """
    best: dict[tuple[str, ...], Found] = {}
    for found in chosen:
        own = identity(found.suspect)
        several = isinstance(found.suspect, Catalogued) and bool(found.suspect.candidate.again)
        kind = own.law if _delays(found.suspect) else own.family
        best.setdefault((own.port, own.axis, kind, str(several), *own.channels), found)
    return [*best.values(), *(found for found in chosen if found not in best.values())]


def _delays(suspect: Suspect) -> bool:
    law = suspect.candidate.effect if isinstance(suspect, Catalogued) else None
    return isinstance(law, Effect) and bool(law.delay)


def _way(found: Found) -> tuple[str, ...]:
    own = identity(found.suspect)
    return own.port, own.axis, own.law, *own.channels[:1]


def tried(
    chosen: Sequence[Found], view: View, before: Standing, floor: Floor, simulate: Simulate
) -> tuple[list[Tried], list[Refused]]:
    """Leaders of a view refitted and gated against what was believed `before`: those that passed, and those that did
    not.
    """

    judged = [
        Tried(found, *_trial_by_trial(found.suspect, view.standing, view.bench), view.screening, Own((), ()))
        for found in chosen
        if found.suspect.each_trial
    ]
    runners = raced([found for found in chosen if not found.suspect.each_trial], view, floor, simulate)
    for number, runner in enumerate(runners):
        own = own_of(runner.found, before, runner.standing)
        verdict = gated(runner.found, before, runner.standing, own)
        if number == 0 and not (verdict.passed or runner.leapt) and at_floor(runner, floor):
            # It left nothing after its first steps. What other numbers lack there may be all that speaks against it.
            runner = replace(runner, standing=moved_on(runner.standing, simulate), leapt=True)
            verdict = gated(runner.found, before, runner.standing, own)
        judged.append(Tried(runner.found, runner.standing, verdict, view.screening, own, runner.leapt))
    passed = [one for one in judged if one.gate.passed]
    refused = [
        Refused(identity(one.found.suspect), one.found.score.rho_eff, one.gate.reasons)
        for one in judged
        if not one.gate.passed
    ]
    return passed, refused


def gated(found: Found, before: Standing, after: Standing, own: Own) -> Gate:
    """The gate's verdict on a law that `after` has and `before` is without; sizes have to be such as it may have."""
    known = after.known
    places = [known.names.index(name) for name in own.amplitudes]
    shapes = [known.names.index(name) for name in own.names if name not in own.amplitudes]
    verdict = gate(before.known, known, places, shapes)
    # What minima of the known parameters leave differs, and is no law's.
    share = explained_share(before.known, known, beyond=TOLERATED)
    index = np.array(places)
    a, C = known.value[index], known.covariance[np.ix_(index, index)]
    if identity(found.suspect).family == UNNAMED:
        if share is None and known.experiment.held_out:
            verdict = verdict.but("recordings that were held out leave nothing that would show a curve")
        if share is not None and not share >= LAW_VARIANCE:
            verdict = verdict.but(
                f"a curve that explains {100.0 * share:.0f} % of the held-out excess is no law"
            )
    if isinstance(found.suspect, CurveSuspect):
        return verdict.but(*pushes(found.suspect, a, C))
    if not isinstance(found.suspect, Catalogued):
        return verdict
    free = _undone(found.suspect, a, known.value[shapes])
    return verdict.but(*_oversized(found.suspect, a, np.sqrt(np.diag(C)), free), *drives(found.suspect, a, C))


def _undone(suspect: Catalogued, values: Array, shapes: Array) -> frozenset[str]:
    """Amplitudes of a law of some shape in the plant that others of it undo.

    Of finds that are one law together, the first one's come first.
    """
    if not in_plant(suspect):
        return frozenset()
    amplitudes = dict(zip(suspect.amplitudes, map(float, values), strict=False))
    own = len(bends(suspect.candidate, suspect.scene.hypothesis.rig))
    return undone(fitted(suspect, shapes[:own].tolist()), amplitudes)


def _oversized(
    suspect: Suspect, values: Iterable[float], sigmas: Iterable[float], free: Collection[str] = ()
) -> tuple[str, ...]:
    """Why a law of the catalogue does not have amplitudes of such values and sigmas; nothing, if it may.

    Those that are `free` may have any.
    """
    if not isinstance(suspect, Catalogued):
        return ()
    numbers = zip(map(float, values), map(float, sigmas), strict=True)
    named = dict(zip(suspect.amplitudes, numbers, strict=False))
    return tuple(
        reason for action in suspect.candidate.actions for reason in implausible(action.effect, named, free)
    )


def _trial_by_trial(suspect: Suspect, standing: Standing, bench: Bench) -> tuple[Standing, Gate]:
    """A law whose size and phase are each recording's own is taken off each; every one has to show it all through."""
    known, experiment = standing.known, standing.known.experiment
    precision = np.where(np.isfinite(known.parameters.sigma), known.sigma, np.inf) ** -2.0
    plain = {experiment.reference(k): np.zeros(0) for k in range(len(experiment.repeats))}
    plain = {drive: bench.signatures([suspect], drive) for drive in plain}
    trials, residual, folds, strengths = list(experiment.trials), list(known.residual), [], []
    greatest: list[tuple[float, float]] = [(0.0, 0.0)] * len(suspect.amplitudes)
    for k, trial in enumerate(experiment.trials):
        columns = plain[experiment.reference(trial.trajectory)]
        whitened = known.metric[k](columns)
        fitted = known.experiment.reference(trial.trajectory) in known.slopes
        J = known.jacobian(k) if fitted else np.zeros((len(whitened), len(precision)))
        background = Background.of({k: known.residual[k]}, {k: J}, precision)
        own = score(background, Sums.over(background, {k: whitened}))
        trials[k] = replace(trial, measured=trial.measured - (columns @ own.amplitude) * trial.valid[:, None])
        residual[k] = known.residual[k] - whitened @ own.amplitude
        sigma = np.sqrt(np.diag(own.covariance))
        greatest = [
            max(one, other, key=lambda number: abs(number[0]))
            for one, other in zip(greatest, zip(own.amplitude, sigma, strict=True), strict=True)
        ]
        if trial.role != "calibration":
            gained = _even_gain(background, k, whitened, own, known)
            strengths.append(gained)
            rows = float(known.rows[k])
            before, after = (float(z @ z) / rows for z in (known.residual[k], residual[k]))
            bound = float(chi2.isf(FALSE_ALARM / suspect.places, max(own.rank, 1)))
            folds.append(Fold(trial.name, before, after, gained - bound))
    worse = tuple(fold.trial for fold in folds if fold.gain <= 0.0)
    reasons = (f"{', '.join(worse)} do not show it, all through",) if worse else ()
    if len(folds) < 2:
        reasons = (*reasons, "one recording alone cannot show that it comes again")
    white = whiteness(known), whiteness(replace(known, residual=tuple(residual)))
    changed = replace(known, experiment=replace(experiment, trials=tuple(trials)), residual=tuple(residual))
    verdict = Gate(
        not reasons,
        tuple(folds),
        bool(experiment.held_out),
        float(np.sqrt(min(strengths, default=0.0))),
        white,
        reasons,
    )
    return replace(standing, known=changed), verdict.but(*_oversized(suspect, *zip(*greatest, strict=True)))


def _even_gain(background: Background, trial: int, columns: Array, own: Score, known: Known) -> float:
    """Gain of a law in one trial, or the square of its sigmas off zero by what parts of it ask for, if that is less."""
    J = background.J[trial] * background.scale
    done = (columns - J @ cho_solve(background.factor, J.T @ columns)) @ own.amplitude
    left = background.z[trial] - J @ background.shift - done
    own_parts = parts(known.experiment, trial, known.metric[trial], done, left)
    return min(own.gain, max(evenly(known.experiment, {trial: own_parts}), 0.0) ** 2)


def reread(chosen: Tried, before: Standing, floor: Floor, simulate: Simulate) -> Tried:
    """A law of the readings told anew among all of its channel, now that the known numbers have settled beside it.

    In the plant shapes are fitted; such a law has the one that the screen gave it while numbers were still pulled, and
    goes on from there to first order. So it is told again as long as that changes much.
    """
    if in_plant(chosen.found.suspect) or not chosen.own.names:
        return chosen
    enough = TOLERATED * before.known.fit_rows
    for _ in range(REREAD):
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
    if not view.able or _alike(view.able[0].suspect, suspect):
        return chosen
    found = bettered(view.bench, view.able[0])
    new = with_extra(view.standing, extra_of(found, view.standing, view.bench, view.scene), simulate)
    new = resettled(new, floor, simulate, leaps=0)
    own = own_of(found, before, new)
    told = Tried(found, new, gated(found, before, new, own), view.screening, own)
    chances = probabilities([standing.known, new.known], view.bench.background.rows)
    return told if told.gate.passed and chances[1] > chances[0] else chosen


def _reads(suspect: Suspect) -> str:
    """Site of a law of readings; of one that others act on, the channel that reads."""
    return suspect.family[1].split(BY)[0]


def _alike(one: Suspect, other: Suspect) -> bool:
    """Whether two suspects are one law of one shape."""
    if not (isinstance(one, Catalogued) and isinstance(other, Catalogued)):
        return one.family == other.family
    return one.family == other.family and one.candidate.shape == other.candidate.shape
