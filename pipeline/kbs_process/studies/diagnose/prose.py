"""The facts that a diagnosis is told by, in its answer, a paragraph and notices; the folder prose/ has the words."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence

import numpy as np
from scipy.stats import chi2

from kbs_process.campaign.config import Campaign
from kbs_process.diagnosis.acceptance.outcome import Find, Outcome
from kbs_process.diagnosis.experiments.experiment import Experiment
from kbs_process.diagnosis.experiments.floor import Floor
from kbs_process.diagnosis.experiments.thresholds import RIVALS, told_apart
from kbs_process.diagnosis.nominal.known import LEARNT, NEAR, Known
from kbs_process.plant.effect import UNNAMED
from kbs_process.reduction.losses import lost
from kbs_process.report.prose import Prose
from kbs_process.results.records import Notice
from kbs_process.studies.diagnose import results as records
from kbs_process.studies.diagnose.corrected import CORRECTED, left_out
from kbs_process.studies.diagnose.reading import PASSED_OVER, passed_over

_TOLD = Prose("kbs_process.studies.diagnose", "answer")
_NOTICES = Prose("kbs_process.studies.diagnose", "notices")
_NOTES = ("floor", "refit", "gate", "order")  # on how to read the results
_FLOOR = {"repeats": "the difference between repeats of one trajectory", "declared": "the sensors' stated noise"}


def rms(ratio: float) -> float:
    """Of a ratio of powers."""
    return float(np.sqrt(max(ratio, 0.0)))


def answer(
    outcome: Outcome, trials: Sequence[records.Trial], requirements: Sequence[records.Unexplained], floor: Floor
) -> str:
    """The answer, in one sentence or a few."""
    laws = [law_in_words(find) for find in outcome.finds]
    return _TOLD("answer", laws=laws, **_facts(outcome, trials, requirements, floor))


def paragraph(
    outcome: Outcome,
    finds: Sequence[records.Find],
    trials: Sequence[records.Trial],
    requirements: Sequence[records.Unexplained],
    floor: Floor,
) -> str:
    """Plain words, to be pasted into a test report."""
    held_out = [trial for trial in trials if trial.role == "held-out"]
    steps = ("nominal", "known", "corrected")
    return _TOLD(
        "paragraph",
        held_out=held_out,
        most={step: max(getattr(trial, step) for trial in held_out or trials) for step in steps},
        finds=[_find(find) for find in finds],
        otherwise=sorted(outcome.otherwise, key=lambda one: -abs(one.sigmas or 0.0)),
        moved=outcome.moved,
        **_facts(outcome, trials, requirements, floor),
    )


def _facts(
    outcome: Outcome, trials: Sequence[records.Trial], requirements: Sequence[records.Unexplained], floor: Floor
) -> dict[str, object]:
    """What the answer and the paragraph both tell."""
    undecided = outcome.verdict == "undecided"
    known = outcome.standing.known if outcome.finds else outcome.known
    strain, after = outcome.strain, outcome.after
    cell = min(after.cells, key=lambda one: one.log_p, default=None)
    unplaced = undecided and not outcome.finds and not outcome.unforeseen and outcome.left is not None
    ports = outcome.left.test.ports if unplaced and outcome.left is not None else ()
    able = [port.name for port in ports if port.sufficient]
    return {
        "case": _case(outcome),
        "undecided": undecided,
        "floor": _FLOOR[floor.source],
        "near": _nearest(outcome),
        "unseen": _unseen(trials) if outcome.unforeseen else None,
        "faint": {"percent": 100.0 * (after.ratio - 1.0), "cell": cell, "ratio": rms(cell.ratio) if cell else None},
        "strain": {
            "squares": strain.squares,
            "count": strain.count,
            "strained": strain.strained,
            "p": chi2.sf(strain.squares, strain.count),
            "most": _farthest(known),
        },
        "off": sorted(outcome.moved, key=lambda one: (-abs(one.sigmas or 0.0), one.name)),
        "stopped": outcome.standing.known.stopped,
        "reach": NEAR,
        "located": [port.label for port in outcome.located],
        "able": able if len(able) < len(ports) else [],
        "left": _left(outcome, trials) if after.left or outcome.much else None,
        "disputed": list(dict.fromkeys(one.words for one in outcome.disputed)),
        "limit": max(requirements, key=lambda one: one.share) if undecided and requirements else None,
    }


def _case(outcome: Outcome) -> str:
    """What is to be told where there is no find."""
    if outcome.unforeseen:
        return "unforeseen"
    if outcome.after.faint:
        return "faint"
    if outcome.hidden and not outcome.after.left:
        return "hidden"
    return "untried" if outcome.untried and not outcome.after.left else outcome.verdict


def _nearest(outcome: Outcome) -> dict[str, object] | None:
    """The law that came nearest to be one: of those that were refused in the plant the one that leaves least."""
    simulated = [(one.left, one) for one in outcome.refused if one.left is not None and np.isfinite(one.left)]
    if not simulated:
        return None
    left, near = min(simulated, key=lambda entry: (entry[0], entry[1].identity.law))
    return {"words": near.identity.words, "left": rms(left), "reasons": near.reasons}


def law_in_words(find: Find) -> str:
    """A law and its place, with those of its place that cannot be told from it, and of others that do the same."""
    own = find.identity
    laws = {own.place.words: [own.name]}
    for one in find.alternatives:
        other = one.identity
        same = one.rho_delta < RIVALS and other.family != UNNAMED
        if one.refitted and one.indistinguishable and (other.place == own.place or same):
            laws.setdefault(other.place.words, []).append(other.name)
    return ", or ".join(f"{' or '.join(names)} ({where})" for where, names in laws.items())


def _left(outcome: Outcome, trials: Sequence[records.Trial]) -> dict[str, object]:
    """How much is left beside finds, and the channel that shows most of its power beyond the floor, if one does."""
    power: defaultdict[str, float] = defaultdict(float)
    for trial in trials:
        for name, ratio in trial.channels.items():
            power[name] += max(0.0, ratio**2 - 1.0)
    total = sum(power.values())
    channel = next((name for name, own in power.items() if own > 0.5 * total), None)
    most = max(one.ratio for one in (outcome.after, *(outcome.held_out or ())[1:]))
    shown = not any(left_out(find) for find in outcome.finds)  # by the corrected model, all that was found
    return {
        "ratio": max(rms(most), *(trial.corrected for trial in trials if shown and trial.role != "calibration"), 0.0),
        "channel": channel,
        "percent": None if channel is None else 100.0 * power[channel] / total,
    }


def _unseen(trials: Sequence[records.Trial]) -> dict[str, object]:
    """The recording that was held out and is predicted worst, and its worst channel."""
    worst = max((trial for trial in trials if trial.role == "held-out"), key=lambda trial: trial.corrected)
    channel = max(worst.channels, key=lambda name: worst.channels[name])
    return {"recording": worst.recording, "channel": channel, "ratio": worst.channels[channel]}


def _farthest(known: Known, most: int = 3) -> list[str]:
    """Numbers that are farthest from their priors, in units of what a refit is expected to move each by."""
    stated = np.flatnonzero(known.stated)
    learnt = 1.0 - np.minimum(known.sigma[stated] / known.parameters.sigma[stated], 1.0) ** 2
    far = known.moved[stated] / np.sqrt(np.maximum(learnt, LEARNT))
    order = np.argsort(-np.abs(far))[:most]
    return [f"{known.names[stated[i]]} ({known.moved[stated[i]]:+.1f})" for i in order]


def _find(find: records.Find) -> dict[str, object]:
    near = told_apart(find.distance)
    apart = (one for one in find.rivals if one.distance < (near if one.simulated else RIVALS))
    return {
        "named": find.named,
        "words": f"{_words(find.name)} ({find.place.words})",
        "numbers": _curve_in_words(find.curve) if find.curve else _numbers_in_words(find.parameters),
        "probability": find.probability,
        "alike": [_words(one.name) + ("" if one.place == find.place else f" ({one.place.words})") for one in apart],
    }


def _words(name: str) -> str:
    return name.replace("_", " ")


def _numbers_in_words(numbers: Sequence[records.Fitted]) -> str:
    """The first four, beginning with those that are known to differ from zero."""
    open_yet = {one.name: one.low <= 0.0 <= one.high for one in numbers}
    first = sorted(numbers, key=lambda one: open_yet[one.name])[:4]
    words = ", ".join(f"{one.name} = {one.value:.4g} ({one.low:.4g} to {one.high:.4g}) {one.unit}" for one in first)
    return words + (", none of which is known to differ from zero" if all(open_yet.values()) else "")


def _curve_in_words(curve: records.Curve) -> str:
    """Between what a measured law varies, where, and how well that is known."""
    least, *_, most = sorted(range(len(curve.y)), key=lambda k: curve.y[k])
    ends = " to ".join(
        f"{curve.y[k]:.4g} {curve.y_unit} (sigma {curve.sigma[k]:.2g}) at {curve.x[k]:.4g} {curve.x_unit}"
        for k in (least, most)
    )
    return f"from {ends} of the {curve.regressor}"


def notices(campaign: Campaign, floor: Floor, outcome: Outcome) -> Iterator[Notice]:
    """What a reader of the results has to know of the recordings that they are of."""
    experiment = outcome.standing.known.experiment
    angle, command = campaign.topics.angle, campaign.topics.command
    mismatch = outcome.verdict != "none"
    for find in outcome.finds:
        if not find.gate.held_out:
            yield _notice("not_held_out", law=find.identity.law)
        if left_out(find):
            yield _notice("each_time", law=find.identity.law, corrected=CORRECTED)
    if not experiment.held_out:
        yield _notice("none_held_out")
    if outcome.unforeseen:
        yield _notice("unforeseen")
    elif outcome.finds and experiment.held_out and not _other_motions(experiment):
        yield _notice("repeated")
    if outcome.ended and mismatch:
        yield _notice("ended")
    if mismatch and angle and command and angle.topic == command.topic:
        yield _notice("commanded")
    if floor.source == "declared":
        yield _notice("declared", floor=floor.statement)
    for entry in campaign.recordings:
        for trial in experiment.trials:
            if trial.name == entry.name:
                yield from lost(entry, [loss for loss in trial.losses if loss.kind != PASSED_OVER])
                yield from passed_over(entry, trial.losses)


def _notice(passage: str, **facts: str) -> Notice:
    severity, what, where, remedy = (part.strip() for part in _NOTICES(passage, **facts).split("|"))
    return Notice(severity="warning" if severity == "warning" else "info", what=what, where=where, remedy=remedy)


def notes() -> tuple[str, ...]:
    """How to read the results."""
    return tuple(_NOTICES(f"note_{name}") for name in _NOTES)


def _other_motions(experiment: Experiment) -> bool:
    """Whether a trajectory was held out of which nothing was fitted."""
    fitted = {experiment.trials[k].trajectory for k in experiment.fit}
    return any(experiment.trials[k].trajectory not in fitted for k in experiment.held_out)
