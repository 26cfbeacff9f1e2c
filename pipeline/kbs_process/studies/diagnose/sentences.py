"""What a diagnosis says in plain words: its verdict, and a paragraph for a test report."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence

import numpy as np
from scipy.stats import chi2

from kbs_process.diagnosis.experiments.detection import Detection
from kbs_process.diagnosis.experiments.floor import Floor
from kbs_process.diagnosis.experiments.thresholds import RIVALS, told_apart
from kbs_process.diagnosis.nominal.known import LEARNT, NEAR, Known
from kbs_process.diagnosis.selection.outcome import Find, Outcome
from kbs_process.plant.effect import UNNAMED
from kbs_process.studies.diagnose import results as records
from kbs_process.studies.diagnose.terms import place_of, rms

_FLOOR = {
    "repeats": "what repeats of one trajectory differ by",
    "declared": "what their sensors' stated noise explains",
}
_WORDS = {
    "none": "Nothing exceeds {floor}.",
    "parameters off": "Known parameters are off ({moved}): with that nothing exceeds {floor}. Physics that does what "
    "they do would look the same; one that is farther off than its file can be wrong stands for such physics.",
    "undecided": "There is a mismatch, and no law passed the gate.{near}",
}
_FAINT = (
    "Something seems to exceed {floor}, {where}all together by {share:.2g} % of its power: too little to tell what it "
    "is.{moved}{near}"
)
_HIDDEN = (
    "Nothing exceeds {floor}, but known parameters are together farther from what the files say than chance has them "
    "({strain}, p {p:.1g}; most: {names}), though none is by itself: stated "
    "uncertainties are too small, or physics was left out that does what they do. Check these at their source.{near}"
)
_UNTRIED = (
    "Known parameters that are off ({moved}) would explain all: with that nothing exceeds {floor}. Whether a law does "
    "that was left out is open, as the search ended before all were tried."
)
MATTERS = 0.1  # of a limit: in a sum of squares a tenth is a half percent


def _loudest(left: Detection) -> str:
    """The band that is farthest beyond chance."""
    if not left.cells:
        return ""
    cell = min(left.cells, key=lambda one: one.log_p)
    return f"most between {cell.low_Hz:.2g} and {cell.high_Hz:.2g} Hz ({rms(cell.ratio):.3g} times, rms), "


def _nearest(outcome: Outcome) -> str:
    """The law that came nearest to be one: of those that were refused in the plant the one that leaves least."""
    simulated = [one for one in outcome.refused if one.left is not None and np.isfinite(one.left)]
    if not simulated:
        return ""
    near = min(simulated, key=lambda one: (one.left, one.identity.law))
    where = f"{_words(near.identity.law)} ({_where(place_of(near.identity))})"
    return (
        f" Nearest is {where}, which leaves {rms(near.left or 0.0):.3g} times the floor (rms) of what was fitted, but: "
        f"{'; '.join(near.reasons)}."
    )


def _words(name: str) -> str:
    return name.replace("_", " ")


def _where(place: records.Place) -> str:
    return ", ".join(part for part in (place.port, place.site or "/".join(place.channels)) if part)


def _law_in_words(find: Find) -> str:
    """A law and its place, with those of its place that cannot be told from it, and of others that do the same."""
    here = place_of(find.identity)
    laws = {_where(here): [_words(find.identity.law)]}
    for one in find.alternatives:
        there = place_of(one.identity)
        same = one.rho_delta < RIVALS and one.identity.family != UNNAMED
        if one.refitted and one.indistinguishable and (there == here or same):
            laws.setdefault(_where(there), []).append(_words(one.identity.law))
    return ", or ".join(f"{' or '.join(names)} ({where})" for where, names in laws.items())


def sentence(
    outcome: Outcome, trials: Sequence[records.Trial], requirements: Sequence[records.Unexplained], floor: Floor
) -> str:
    """The answer, in one sentence or a few."""
    if not outcome.finds:
        return _unnamed(outcome, trials, floor) + _located(outcome) + _matters(outcome, requirements)
    told = [_law_in_words(find) for find in outcome.finds]
    open_yet = outcome.verdict == "undecided"
    begin = "Nearest to what the model lacks, of the laws known" if open_yet else "The model lacks"
    reserves = _reserve(outcome, trials) + _disputed(outcome) + _pulled(outcome)
    return f"{begin}: {'; '.join(told)}.{reserves}{_matters(outcome, requirements)}"


def _reserve(outcome: Outcome, trials: Sequence[records.Trial]) -> str:
    """What is to be said of finds with which something is left: among known laws they are the nearest ones."""
    if not (outcome.after.left or outcome.much):
        return ""
    most = max(one.ratio for one in (outcome.after, *(outcome.held_out or ())[1:]))
    level = f"{rms(most):.3g} times the floor (rms)"
    return (
        f" With that in the plant {level} is left: more is missing, or a law found stands in for one like it."
        f"{_shown(trials)}"
    )


def _disputed(outcome: Outcome) -> str:
    """What is to be said of laws elsewhere that may be the ones."""
    if not outcome.disputed:
        return ""
    others = dict.fromkeys(f"{_words(one.law)} ({_where(place_of(one))})" for one in outcome.disputed)
    return (
        f" {', '.join(others)} does nearly the same, and beside either known parameters are together farther from what "
        f"the files say than chance has them ({_strain(outcome.standing.known)}): which "
        "of them it is, these recordings do not tell."
    )


def _pulled(outcome: Outcome) -> str:
    """What is to be said of known numbers that went farther beside finds than chance has them."""
    known = outcome.standing.known
    if outcome.disputed or not known.strained:
        return ""
    return (
        " Beside that known parameters are together farther from what the files say than chance has them "
        f"({_strain(known)}; most: {', '.join(farthest(known))}): they are off, or have taken up more that was left "
        "out. Check these at their source."
    )


def _strain(known: Known) -> str:
    strain = known.strain
    return f"squared sigmas {strain.squares:.0f} in {strain.count} directions"


def _shown(trials: Sequence[records.Trial]) -> str:
    """The channel that shows most of the power that is left beyond the floor, if one does."""
    power: defaultdict[str, float] = defaultdict(float)
    for trial in trials:
        for name, ratio in trial.channels.items():
            power[name] += max(0.0, ratio**2 - 1.0)
    total = sum(power.values())
    return "".join(
        f" {name} shows {100.0 * own / total:.0f} % of its power." for name, own in power.items() if own > 0.5 * total
    )


def _matters(outcome: Outcome, requirements: Sequence[records.Unexplained]) -> str:
    """What is left, as requirements count it."""
    if outcome.verdict != "undecided" or not requirements:
        return ""
    worst = max(requirements, key=lambda one: one.share)
    little = ": too little to matter for it" if worst.share < MATTERS else ""
    return (
        f" What is left reaches {worst.corrected:.2g} {worst.unit} ({worst.statistic}, {worst.channel}), "
        f"{100.0 * worst.share:.3g} % of the limit of '{worst.name}'{little}."
    )


def _unnamed(outcome: Outcome, trials: Sequence[records.Trial], floor: Floor) -> str:
    """The answer where there is no find."""
    if outcome.after.faint and not outcome.unforeseen:
        share = 100.0 * (outcome.after.ratio - 1.0)
        moved = " Known parameters are off, too." if outcome.moved else ""
        where, near = _loudest(outcome.after), _nearest(outcome)
        return _FAINT.format(floor=_FLOOR[floor.source], where=where, share=share, moved=moved, near=near)
    if outcome.hidden and not outcome.after.left and not outcome.unforeseen:
        strain = outcome.known.strain
        return _HIDDEN.format(
            floor=_FLOOR[floor.source],
            strain=_strain(outcome.known),
            p=chi2.sf(strain.squares, strain.count),
            names=", ".join(farthest(outcome.known)),
            near=_nearest(outcome),
        )
    if outcome.untried and not outcome.after.left and not outcome.unforeseen:
        return _UNTRIED.format(floor=_FLOOR[floor.source], moved=_off(outcome))
    if not outcome.unforeseen:
        words = _WORDS[outcome.verdict].format(floor=_FLOOR[floor.source], near=_nearest(outcome), moved=_off(outcome))
        return words + (_stopped(outcome.standing.known) if outcome.verdict == "none" else "")
    worst = max((trial for trial in trials if trial.role == "held-out"), key=lambda trial: trial.corrected)
    channel = max(worst.channels, key=lambda name: worst.channels[name])
    return (
        f"Recordings that were fitted are predicted, {worst.recording}, which was held out, is not: "
        f"{channel} differs by {worst.channels[channel]:.3g} times the floor (rms)."
    )


def _off(outcome: Outcome, most: int = 5) -> str:
    """Numbers that are off by themselves, farthest first."""
    far = sorted(outcome.moved, key=lambda one: (-abs(one.sigmas), one.name))
    more = f" and {len(far) - most} more" if len(far) > most else ""
    return ", ".join(f"{one.name} {one.sigmas:+.1f} sigma" for one in far[:most]) + more


def _stopped(known: Known) -> str:
    """Numbers that nothing exceeds the floor with, and that would have gone farther."""
    if not known.stopped:
        return ""
    names = ", ".join(known.stopped)
    return f" For that {names} went as far as chance may have it ({NEAR:.2g} sigma): check that at its source."


def farthest(known: Known, most: int = 3) -> list[str]:
    """Numbers that are farthest from their priors, in units of what a refit is expected to move each by."""
    stated = np.flatnonzero(known.stated)
    learnt = 1.0 - np.minimum(known.sigma[stated] / known.parameters.sigma[stated], 1.0) ** 2
    far = known.moved[stated] / np.sqrt(np.maximum(learnt, LEARNT))
    order = np.argsort(-np.abs(far))[:most]
    return [f"{known.names[stated[i]]} ({known.moved[stated[i]]:+.1f})" for i in order]


def _located(outcome: Outcome) -> str:
    """Which ports can explain what no law did, where some cannot."""
    if outcome.verdict != "undecided" or outcome.unforeseen or outcome.left is None:
        return ""
    if outcome.located:
        names = [port.label for port in outcome.located]
        apart = ", which these recordings cannot tell apart" * (len(names) > 1)
        return f" It enters at {' or '.join(names)}{apart}."
    able = [port.name for port in outcome.left.test.ports if port.sufficient]
    if not able or len(able) == len(outcome.left.test.ports):
        return ""
    return f" An input free to be anything could explain it at {', '.join(able[:4])}{' and others' * (len(able) > 4)}."


def paragraph(
    outcome: Outcome,
    finds: Sequence[records.Find],
    trials: Sequence[records.Trial],
    requirements: Sequence[records.Unexplained],
    floor: Floor,
) -> str:
    """Plain words, to be pasted into a test report."""
    held_out = [trial for trial in trials if trial.role == "held-out"]
    judged = held_out or list(trials)
    which = "recordings that were held out" if held_out else "all recordings (none was held out)"
    nominal, known, corrected = (
        max(getattr(trial, step) for trial in judged) for step in ("nominal", "known", "corrected")
    )
    parts = [
        f"With the parameter files' numbers, prediction and measurement differ by up to {nominal:.3g} times (rms) "
        f"{_FLOOR[floor.source]}, and with all known parameters refitted within their uncertainties by up to "
        f"{known:.3g} times, among {which}."
    ]
    for find in finds:
        numbers = _curve_in_words(find.curve) if find.curve else _numbers_in_words(find.parameters)
        near = told_apart(find.distance)
        apart = [
            _words(one.name) + ("" if one.place == find.place else f" ({_where(one.place)})")
            for one in find.rivals
            if one.distance < (near if one.simulated else RIVALS)
        ]
        left_out = "Nearest to what was left out is" if outcome.verdict == "undecided" else "Left out was"
        begin = left_out if find.named else "No law of the catalogue passes; measured was a"
        parts.append(
            f"{begin} {_words(find.name)} ({_where(find.place)}): {numbers}; probability {find.probability:.2f}"
            + (f", not to be told from {', '.join(apart)} by these recordings." if apart else ".")
        )
    if finds:
        parts.append(
            f"With it in the plant the difference is {corrected:.3g} times the floor.{_reserve(outcome, trials)}"
            f"{_disputed(outcome)}{_pulled(outcome)}"
        )
    else:
        parts.append(_unnamed(outcome, trials, floor) + _located(outcome))
    parts.append(_matters(outcome, requirements).lstrip())
    if outcome.otherwise:
        farthest = sorted(outcome.otherwise, key=lambda moved: -abs(moved.sigmas))[:3]
        numbers = ", ".join(f"{moved.name} by {moved.sigmas:+.1f} sigma" for moved in farthest)
        parts.append(f"Without a law known parameters would have to be off, beyond belief: {numbers}.")
    for moved in outcome.moved[:5]:
        parts.append(f"{moved.name} is off by {moved.sigmas:+.1f} sigma.")
    return " ".join(part for part in parts if part)


def _numbers_in_words(numbers: Sequence[records.Fitted]) -> str:
    return ", ".join(
        f"{one.name} = {one.value:.4g} ({one.low:.4g} to {one.high:.4g}) {one.unit}" for one in numbers[:4]
    )


def _curve_in_words(curve: records.Curve) -> str:
    """Between what a measured law varies, where, and how well that is known."""
    least, *_, most = sorted(range(len(curve.y)), key=lambda k: curve.y[k])
    ends = " to ".join(
        f"{curve.y[k]:.4g} {curve.y_unit} (sigma {curve.sigma[k]:.2g}) at {curve.x[k]:.4g} {curve.x_unit}"
        for k in (least, most)
    )
    return f"from {ends} of the {curve.regressor}"
