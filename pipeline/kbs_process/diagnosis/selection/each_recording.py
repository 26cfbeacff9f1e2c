"""Laws whose size is each recording's own, as of what drifts, hums or stamps: taken off every one, and judged there.

What a clock does is no small change where vibration is fast. Its correction is made to first order, the recording
stamped anew by it, and so on from there (Newton's method), while that takes more away.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import cho_solve
from scipy.stats import chi2

from kbs_process.diagnosis.acceptance.evenness import evenly, parts
from kbs_process.diagnosis.acceptance.finding import Tried
from kbs_process.diagnosis.acceptance.gate import Fold, Gate, whiteness
from kbs_process.diagnosis.acceptance.plausible import oversized
from kbs_process.diagnosis.experiments.stamps import SIZES
from kbs_process.diagnosis.experiments.thresholds import FALSE_ALARM, MOSTLY_DONE
from kbs_process.diagnosis.nominal.joint import Own, Standing
from kbs_process.diagnosis.nominal.known import Known
from kbs_process.diagnosis.proposing.clocks import by_a_right_clock, unread
from kbs_process.diagnosis.proposing.view import View
from kbs_process.diagnosis.screening.gls import Background, Sums, score
from kbs_process.diagnosis.screening.screen import Catalogued, Found, Suspect
from kbs_process.signals.records import Array

_PASSES = 8  # of a clock's correction, at most


@dataclass(frozen=True, slots=True, eq=False)
class _Off:
    """A law taken off one recording."""

    measured: Array  # (n, c) without it
    left: Array  # (rows,) whitened, that it leaves
    amplitude: Array  # (m,)
    sigma: Array  # (m,)
    rank: int
    gain: float  # of -2 log likelihood
    background: Background  # of the recording with it


def taken_off(found: Found, view: View) -> Tried:
    """A suspect of a view taken off each recording, and the gate's verdict: every one has to show it all through.

    Of a clock's jump that does nearly all of much, half of them: others may show it in one part, the last turn's.
    """
    suspect, known = found.suspect, view.standing.known
    experiment = known.experiment
    references = {experiment.reference(k) for k in range(len(experiment.repeats))}
    plain = {drive: view.bench.signatures([suspect], drive) for drive in references}
    off = _each(suspect, known, plain)
    standing = _without(view.standing, suspect, off)
    folds, strengths = [], []
    shown = [k for k in range(len(off)) if experiment.trials[k].role != "calibration"]
    bounds = {k: float(chi2.isf(FALSE_ALARM / suspect.places, max(off[k].rank, 1))) for k in shown}
    evenly_gained = {k: _even_gain(off[k], k, known) for k in shown}
    mostly = known.gross and jump_gain(found, known, standing.known) > MOSTLY_DONE * known.excess
    half = mostly and 2 * sum(evenly_gained[k] > bounds[k] for k in shown) >= len(shown)
    for k in shown:
        one, rows = off[k], float(known.rows[k])
        before, after = (float(z @ z) / rows for z in (known.residual[k], one.left))
        gained = one.gain if half else evenly_gained[k]
        if evenly_gained[k] > bounds[k] or not half:
            strengths.append(evenly_gained[k])
        folds.append(Fold(experiment.trials[k].name, before, after, gained - bounds[k]))
    worse = tuple(fold.trial for fold in folds if fold.gain <= 0.0)
    reasons = (f"{', '.join(worse)} do not show it, all through",) if worse else ()
    if len(folds) < 2:
        reasons = (*reasons, "one recording alone cannot show that it comes again")
    verdict = Gate(
        not reasons,
        tuple(folds),
        bool(experiment.held_out),
        float(np.sqrt(max(min(strengths, default=0.0), 0.0))),
        (whiteness(known), whiteness(standing.known)),
        reasons,
    )
    sizes = [
        max(((one.amplitude[i], one.sigma[i]) for one in off), key=lambda number: abs(number[0]))
        for i in range(len(suspect.amplitudes))
    ]
    told = replace(found.score, amplitude=np.concatenate([off[k].amplitude for k in experiment.fit]))
    return Tried(
        replace(found, score=told),
        standing,
        verdict.but(*oversized(suspect, *zip(*sizes, strict=True))),
        view.screening,
        Own((), ()),
    )


def jump_gain(found: Found, before: Known, after: Known) -> float:
    """What a jump of a clock does, of -2 log likelihood: more than is done by leaving out what is read about it.

    Less what as many numbers, at as many places, gain by chance. Nothing of any other law.
    """
    suspect, experiment = found.suspect, before.experiment
    if not (isinstance(suspect, Catalogued) and suspect.jumps):
        return 0.0
    erased = sum(float(z @ z) for z in unread_only(suspect, before).values())
    return erased - float(after.chi2[list(experiment.fit)].sum()) - gained_by_chance(suspect, before)


def gained_by_chance(suspect: Suspect, known: Known) -> float:
    """What the numbers of a law that are each recording's own, and its place in each motion, gain of -2 log likelihood
    by chance (Schwarz).
    """
    experiment = known.experiment
    trajectories = {experiment.trials[k].trajectory for k in experiment.fit}
    own = len(experiment.fit) * len(suspect.amplitudes) * np.log(known.fit_rows)
    return float(own + 2.0 * len(trajectories) * np.log(suspect.places))


def unread_only(suspect: Catalogued, known: Known) -> dict[int, Array]:
    """(rows,) what is left of recordings that are fitted where what is read about a jump says nothing, and no more."""
    left = {}
    for k in known.experiment.fit:
        measured = known.experiment.trials[k].measured
        left[k] = known.residual[k] + known.metric[k](unread(suspect, known, k, measured) - measured)
    return left


def taken_off_again(chosen: Tried) -> Tried:
    """The law of a clock, taken off recordings once more: of those that it was taken off, what known numbers leave now.

    They have settled since, and what they had made up for is the clock's.
    """
    suspect, known = chosen.found.suspect, chosen.standing.known
    assert isinstance(suspect, Catalogued)
    experiment = known.experiment
    references = {experiment.reference(k) for k in range(len(experiment.repeats))}
    off = _each(suspect, known, {drive: suspect.outputs(drive) for drive in references})
    standing = _without(chosen.standing, suspect, off)
    if not standing.known.cost < known.cost:
        return chosen
    more = np.concatenate([off[k].amplitude for k in experiment.fit])
    whole = chosen.found.score.amplitude + more
    told = replace(chosen.found, score=replace(chosen.found.score, amplitude=whole))
    sizes = np.abs(whole.reshape(-1, len(suspect.amplitudes))).max(axis=0)
    sigmas = np.max([one.sigma for one in off], axis=0)
    return replace(chosen, found=told, standing=standing, gate=chosen.gate.but(*oversized(suspect, sizes, sigmas)))


def _each(suspect: Suspect, known: Known, plain: Mapping[int, Array]) -> list[_Off]:
    """A law taken off every recording; `plain` is what a unit of its amplitudes does, by reference drive."""
    precision = np.where(np.isfinite(known.parameters.sigma), known.sigma, np.inf) ** -2.0
    found = []
    for k, trial in enumerate(known.experiment.trials):
        reference = known.experiment.reference(trial.trajectory)
        whitened = known.metric[k](plain[reference])
        J = known.jacobian(k) if reference in known.slopes else np.zeros((len(whitened), len(precision)))
        background = Background.of({k: known.residual[k]}, {k: J}, precision)
        own = score(background, Sums.over(background, {k: whitened}))
        first = _Off(
            trial.measured - (plain[reference] @ own.amplitude) * trial.valid[:, None],
            known.residual[k] - whitened @ own.amplitude,
            own.amplitude,
            np.sqrt(np.diag(own.covariance)),
            own.rank,
            own.gain,
            background,
        )
        if isinstance(suspect, Catalogued) and suspect.of_clock:
            first = _by_the_clock(suspect, known, k, whitened, precision, first)
        found.append(first)
    return found


def _by_the_clock(suspect: Catalogued, known: Known, k: int, whitened: Array, precision: Array, first: _Off) -> _Off:
    """A recording stamped by a clock that is right: to first order, then from where each step leads.

    Where much is left, from the best of many sizes, as a jump by a period of what moves is none to first order.
    """
    experiment = known.experiment
    trial = experiment.trials[k]
    late = suspect.late(experiment.reference(trial.trajectory))
    J = first.background.J[k]
    nothing = _height(first.background, k)
    zero = np.zeros_like(first.amplitude)
    best = replace(first, measured=trial.measured, left=first.background.z[k], amplitude=zero, gain=0.0)
    step = first.amplitude

    def at(amplitude: Array) -> tuple[_Off, Background]:
        measured, left = by_a_right_clock(suspect, known, k, late @ amplitude)
        here = Background.of({k: left}, {k: J}, precision)
        return replace(best, measured=measured, left=left, amplitude=amplitude, gain=nothing - _height(here, k)), here

    def from_here(here: Background) -> Array:
        return score(here, Sums.over(here, {k: whitened})).amplitude

    if known.gross and len(zero) == 1 and (most := float(np.abs(late).max())) > 0.0:
        far, there = max((at(np.array([size / most])) for size in SIZES), key=lambda one: one[0].gain)
        if far.gain > max(at(step)[0].gain, 0.0):
            best, step = far, from_here(there)
    for _ in range(_PASSES):
        nearer, here = at(best.amplitude + step)
        if nearer.gain > best.gain:
            best, step = nearer, from_here(here)
        else:
            step = 0.5 * step  # too far for a slope
    return best


def _height(background: Background, k: int) -> float:
    """-2 log likelihood of a recording's residual, known numbers refitted to first order."""
    z = background.z[k]
    return float(z @ z - (background.scale * (background.J[k].T @ z)) @ background.shift)


def _without(standing: Standing, suspect: Suspect, off: list[_Off]) -> Standing:
    """What is believed of recordings from which a law was taken off; what is read about a jump says nothing."""
    known = standing.known
    trials, left = [], []
    for k, (trial, one) in enumerate(zip(known.experiment.trials, off, strict=True)):
        measured = one.measured
        if isinstance(suspect, Catalogued):
            measured = unread(suspect, known, k, measured)
        trials.append(replace(trial, measured=measured))
        left.append(one.left + known.metric[k](measured - one.measured))
    changed = replace(known, experiment=replace(known.experiment, trials=tuple(trials)), residual=tuple(left))
    return replace(standing, known=changed)


def _even_gain(one: _Off, trial: int, known: Known) -> float:
    """Gain of a law in one trial, or the square of its sigmas off zero by what parts of it ask for, if that is less."""
    background = one.background
    J = background.J[trial] * background.scale
    done = background.z[trial] - one.left
    done = done - J @ cho_solve(background.factor, J.T @ done)
    left = background.z[trial] - J @ background.shift - done
    own_parts = parts(known.experiment, trial, known.metric[trial], done, left)
    return min(one.gain, max(evenly(known.experiment, {trial: own_parts}), 0.0) ** 2)
