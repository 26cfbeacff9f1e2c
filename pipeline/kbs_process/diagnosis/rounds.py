"""Round by round: screen, simulate the leaders, gate, accept the most probable, and look again at what is left."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import chi2

from kbs_process.diagnosis.curves import CurveSuspect, curves
from kbs_process.diagnosis.detection import Detection, detect
from kbs_process.diagnosis.finding import Tried, explained_share, find_of, merged
from kbs_process.diagnosis.floor import Floor
from kbs_process.diagnosis.gate import Fold, Gate, gate, whiteness
from kbs_process.diagnosis.gls import Background, Sums, score
from kbs_process.diagnosis.hypothesis import Prediction, Simulate
from kbs_process.diagnosis.joint import Standing, standing_of, with_extra
from kbs_process.diagnosis.known import MOVED, Known, settled
from kbs_process.diagnosis.localise import cells_and_ports
from kbs_process.diagnosis.outcome import (
    Absorbed,
    Find,
    Moved,
    Outcome,
    Place,
    Refused,
    Verdict,
)
from kbs_process.diagnosis.ports import port_test
from kbs_process.diagnosis.proposals import proposed
from kbs_process.diagnosis.ranges import ranges_of
from kbs_process.diagnosis.rivals import probabilities
from kbs_process.diagnosis.scene import Scene
from kbs_process.diagnosis.screen import Bench, Catalogued, Found, Screening, Suspect, screen
from kbs_process.diagnosis.suspects import candidates
from kbs_process.diagnosis.thresholds import (
    FALSE_ALARM,
    LAW_VARIANCE,
    LEAD,
    LEADERS,
    ORDERED,
    ROUNDS,
    SECOND,
    SETTLED,
    SETTLED_SHARE,
)
from kbs_process.diagnosis.tryout import extra_of, identity


@dataclass(frozen=True, slots=True, eq=False)
class _Round:
    find: Find | None
    standing: Standing
    screening: Screening
    refused: tuple[Refused, ...]
    place: Place | None


def diagnose(
    known: Known, floor: Floor, predicted: Mapping[int, Prediction], simulate: Simulate, before: Detection
) -> Outcome:
    """Find the laws that the refitted known parameters leave out.

    `predicted` are the predictions of `known.hypothesis` by drive, `before` is what detection says of them.
    """
    standing = Standing(known, predicted, {})
    finds: list[Find] = []
    rounds: list[_Round] = []
    for _ in range(ROUNDS):
        rounds.append(_round(standing, floor, simulate))
        standing = rounds[-1].standing
        if rounds[-1].find is None:
            break
        finds.append(rounds[-1].find)
        if not _detected(standing, floor, known.experiment.fit).left:
            break
    last = rounds[-1]
    left = last.place
    if last.find is not None:
        left = _place(standing, floor, Scene.of(known.experiment, standing.hypothesis, standing.predicted))
    after = _detected(standing, floor, known.experiment.fit) if finds else before
    held_out = None
    if known.experiment.held_out:
        begun = _detected(Standing(known, predicted, {}), floor, known.experiment.held_out)
        held_out = begun, _detected(standing, floor, known.experiment.held_out) if finds else begun
    moved = _moved(standing.known)
    return Outcome(
        verdict=_verdict(finds, moved, after),
        before=before,
        after=after,
        held_out=held_out,
        log_p=_mismatch(before, rounds[0]),
        moved=moved,
        finds=merged(finds),
        refused=last.refused,
        absorbed=_absorbed(last.screening),
        place=rounds[0].place,
        left=left,
        whiteness=(whiteness(known), whiteness(standing.known)),
        looked_at=rounds[0].screening.looked_at,
        standing=standing,
    )


def _mismatch(before: Detection, first: _Round) -> float:
    """The lesser of two p-values, of any mismatch and of the first find, times two (Bonferroni).

    A suspect that did not pass the gate does not count: small gains are more frequent than chance has them, as the
    plant is not exact.
    """
    if first.find is None:
        return before.log_p
    found = min(
        one.log_p for one in first.screening.candidates if identity(one.suspect) == first.find.identity
    )
    return float(min(0.0, np.log(2.0) + min(before.log_p, found)))


def suspects_of(standing: Standing, scene: Scene) -> list[Suspect]:
    """The catalogue at every site with every shape, then curves that no law of it has."""
    experiment, rig = scene.experiment, standing.hypothesis.rig
    references = sorted({experiment.reference(k) for k in range(len(experiment.repeats))})
    ranges = ranges_of(
        [scene.signals[drive] for drive in references if drive in scene.signals],
        [standing.predicted[drive].values for drive in references],
        experiment.channels,
        experiment.dt,
        proposed=proposed(standing.known, scene),
        temperature=any(trial.temperature is not None for trial in experiment.trials),
    )
    columns = next((signals.columns for signals in scene.signals.values()), ())
    recorded = all(one.schedule is None or one.schedule.field is not None for one in experiment.drives)
    chosen = candidates(
        rig,
        experiment.effects,
        ranges,
        columns,
        experiment.channels,
        accepted=standing.hypothesis.effects,
        field_recorded=recorded,
    )
    return [*(Catalogued(candidate, scene) for candidate in chosen), *curves(scene)]


def _round(standing: Standing, floor: Floor, simulate: Simulate) -> _Round:
    known = standing.known
    scene = Scene.of(known.experiment, standing.hypothesis, standing.predicted)
    bench = Bench.of(known, scene)
    screening = screen(bench, suspects_of(standing, scene))
    place = _place(standing, floor, scene)
    first, others = _leaders(screening, known.excess)
    tried, refused = _tried(first, standing, bench, scene, floor, simulate)
    for found in others:
        if tried:
            break
        tried, more = _tried([found], standing, bench, scene, floor, simulate)
        refused += more
    if not tried:
        return _Round(None, standing, screening, tuple(refused), place)
    chances = probabilities([one.standing.known for one in tried], bench.background.rows)
    best = int(np.argmax(chances))
    tried[best] = replace(tried[best], standing=_settled(tried[best].standing, floor, simulate, leaps=1))
    find = find_of(tried, best, chances, standing, screening, place)
    return _Round(find, tried[best].standing, screening, tuple(refused), place)


def _settled(standing: Standing, floor: Floor, simulate: Simulate, *, leaps: int) -> Standing:
    """All numbers refitted with the law in the plant, or on its prediction, if that takes away more."""
    known = standing.known
    at_floor = not _detected(standing, floor, known.experiment.fit).left
    if known.experiment.drives[0].schedule is None or (leaps and at_floor):
        return standing
    moved = settled(known, simulate, leaps=leaps, laws=standing.laws)
    return standing_of(moved, standing.laws, simulate) if moved.cost < known.cost else standing


def _leaders(screening: Screening, excess: float) -> tuple[list[Found], list[Found]]:
    """The most probable suspects, as many as the linear plant may have in the wrong order, and a few that come next.

    A law that repeats predicts what was not recorded; one whose size and phase are each recording's own does not. It
    leads only where none that repeats does half of what it does.
    """
    able = [found for found in screening.candidates if found.significant and not found.absorbed]
    repeating = [found for found in able if not found.suspect.each_trial]
    if repeating and 2.0 * repeating[0].score.gain >= able[0].score.gain:
        able = repeating
    if not able:
        return [], []
    bound = (1.0 - LEAD) * able[0].score.gain
    # Where even the best does little of what there is to do, the plant is far from linear, and so is their order.
    if able[0].score.gain < ORDERED * excess:
        bound = 0.0
    first = [found for found in able if found.score.gain >= bound or found is able[0]][:LEADERS]
    return first, [found for found in able if found not in first][:SECOND]


def _tried(
    leaders: Sequence[Found], standing: Standing, bench: Bench, scene: Scene, floor: Floor, simulate: Simulate
) -> tuple[list[Tried], list[Refused]]:
    """Leaders refitted and gated: those that passed, and those that did not."""
    judged: list[tuple[Found, Standing, Gate]] = []
    joined = []
    for found in leaders:
        if found.suspect.each_trial:
            judged.append((found, *_trial_by_trial(found.suspect, standing, bench)))
        else:
            joined.append((found, with_extra(standing, extra_of(found, standing, bench, scene), simulate)))
    joined.sort(key=lambda one: float(np.nan_to_num(one[1].known.cost, nan=np.inf)))
    most = standing.known.cost - joined[0][1].known.cost if joined else 0.0
    for place, (found, new) in enumerate(joined):
        enough = standing.known.cost - new.known.cost >= SETTLED_SHARE * most
        end = _settled(new, floor, simulate, leaps=0) if place < SETTLED and enough else new
        judged.append((found, end, _gated(found, standing, end)))
    passed = [Tried(*one) for one in judged if one[2].passed]
    refused = [
        Refused(identity(found.suspect), found.score.rho_eff, verdict.reasons)
        for found, _, verdict in judged
        if not verdict.passed
    ]
    return passed, refused


def _gated(found: Found, before: Standing, after: Standing) -> Gate:
    begin = len(before.known.value)
    verdict = gate(before.known, after.known, range(begin, begin + len(found.suspect.amplitudes)))
    share = explained_share(before.known, after.known)
    if isinstance(found.suspect, CurveSuspect) and share is not None and not share >= LAW_VARIANCE:
        reason = f"a curve that explains {100.0 * share:.0f} % of the held-out excess is no law"
        verdict = replace(verdict, passed=False, reasons=(*verdict.reasons, reason))
    return verdict


def _trial_by_trial(suspect: Suspect, standing: Standing, bench: Bench) -> tuple[Standing, Gate]:
    """A law whose size and phase are each recording's own is taken off each; every one set apart has to show it."""
    known, experiment = standing.known, standing.known.experiment
    precision = np.where(np.isfinite(known.parameters.sigma), known.sigma, np.inf) ** -2.0
    plain = {experiment.reference(k): np.zeros(0) for k in range(len(experiment.repeats))}
    plain = {drive: bench.signatures([suspect], drive) for drive in plain}
    trials, residual, folds, strengths = list(experiment.trials), list(known.residual), [], []
    for k, trial in enumerate(experiment.trials):
        columns = plain[experiment.reference(trial.trajectory)]
        whitened = known.metric[k](columns)
        fitted = known.experiment.reference(trial.trajectory) in known.slopes
        J = known.jacobian(k) if fitted else np.zeros((len(whitened), len(precision)))
        background = Background.of({k: known.residual[k]}, {k: J}, precision)
        own = score(background, Sums.over(background, {k: whitened}))
        trials[k] = replace(trial, measured=trial.measured - (columns @ own.amplitude) * trial.valid[:, None])
        residual[k] = known.residual[k] - whitened @ own.amplitude
        if trial.role != "calibration":
            strengths.append(own.gain)
            rows = float(known.rows[k])
            before, after = (float(z @ z) / rows for z in (known.residual[k], residual[k]))
            bound = float(chi2.isf(FALSE_ALARM, max(own.rank, 1)))
            folds.append(Fold(trial.name, before, after, own.gain - bound))
    worse = tuple(fold.trial for fold in folds if fold.gain <= 0.0)
    reasons = (f"{', '.join(worse)} do not show it",) if worse else ()
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
    return replace(standing, known=changed), verdict


def _place(standing: Standing, floor: Floor, scene: Scene) -> Place | None:
    if not scene.paths:
        return None
    cells, models, _ = cells_and_ports(standing, floor, scene.paths)
    return Place(port_test(cells, models), cells) if len(cells.z) else None


def _detected(standing: Standing, floor: Floor, trials: Sequence[int]) -> Detection:
    """Detection on readings from which laws that are columns of the prediction are taken off."""
    known = standing.known
    experiment = known.experiment
    if standing.laws:
        corrected = tuple(
            replace(
                trial,
                measured=trial.measured
                - (standing.shown(k) - standing.predicted[trial.drive].values) * trial.valid[:, None],
            )
            for k, trial in enumerate(experiment.trials)
        )
        experiment = replace(experiment, trials=corrected)
    return detect(experiment, floor, standing.predicted, trials, known=known)


def _moved(known: Known) -> tuple[Moved, ...]:
    return tuple(
        Moved(name, float(value), float(sigma), float(sigmas))
        for name, value, sigma, sigmas in zip(known.names, known.value, known.sigma, known.moved, strict=True)
        if abs(sigmas) > MOVED
    )


def _absorbed(screening: Screening) -> tuple[Absorbed, ...]:
    return tuple(
        Absorbed(identity(found.suspect), found.score.kappa, found.score.rho, found.absorbed_by)
        for found in screening.candidates
        if found.absorbed and found.significant
    )


def _verdict(finds: Sequence[Find], moved: Sequence[Moved], after: Detection) -> Verdict:
    if finds:
        return "physics"
    if after.left:
        return "undecided"
    return "parameters off" if moved else "none"
