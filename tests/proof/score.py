"""The score: one flat table of shares and medians, for every method and strength.

What is counted is every trial of a kind, not only those with an answer: a method that gives up is wrong there.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import msgspec

from proof.answer import Answer, Part
from proof.match import Judged, covered, error_over_bound, match, same_place, superfluous
from proof.rates import CUT_LOG10_P, clopper_pearson, decibels_from_clairvoyant, median_interval
from proof.truth import Truth
from proof.words import NULLS, Split

ALL = "all"
CONFIDENT = 300.0  # strength from which the aims ask for nearly everything
STRONG = f">={CONFIDENT:g}"
_MEDIAN_ERROR = (
    0.6745  # of a normal error's magnitude, in standard deviations: an efficient estimate's median is 1 then
)


class Row(Part, frozen=True, kw_only=True):
    """One number of the table, with its 95 % interval.

    kind "share": `value` = right / of, the interval is Clopper & Pearson's. kind "median": of `of` values, the
    interval from order statistics, None where there are too few. `group` says over which trials: a strength, a kind of
    null, or all.
    """

    method: str
    metric: str
    group: str
    kind: Literal["share", "median"]
    value: float | None
    low: float | None
    high: float | None
    of: int
    right: int | None = None


class Bench(Part, frozen=True, kw_only=True):
    """A bench that was run, with all that its page shows."""

    split: Split
    seed: str
    command: str
    isolation: str
    rows: tuple[Row, ...]
    truths: tuple[Truth, ...]
    answers: tuple[Answer, ...]
    # By trial: of how many of the rig's numbers the interval holds the truth, and how many the recordings tell.
    coverage: dict[str, tuple[int, int]] = msgspec.field(default_factory=dict)


def encode(bench: Bench) -> bytes:
    """Return a bench as it is stored."""
    return msgspec.json.encode(bench, order="deterministic") + b"\n"


@dataclass(frozen=True, slots=True)
class Trial:
    """A truth and one method's answer to it."""

    truth: Truth
    answer: Answer
    judged: tuple[Judged, ...]

    @property
    def group(self) -> str:
        return f"{self.truth.level:g}" if self.truth.kind == "concealed" else self.truth.kind


Tally = Callable[[Trial], Iterable[bool]]
Measure = Callable[[Trial], Iterable[float]]


def single(trial: Trial) -> bool:
    """One effect, of the catalogue."""
    return len(trial.judged) == 1 and trial.judged[0].effect.catalogued


def foreign(trial: Trial) -> bool:
    """One effect, in no catalogue."""
    return len(trial.judged) == 1 and not trial.judged[0].effect.catalogued


def several(trial: Trial) -> bool:
    return len(trial.judged) > 1


def _if(condition: Callable[[Trial], bool], value: Callable[[Judged], bool]) -> Tally:
    return lambda trial: (value(entry) for entry in trial.judged) if condition(trial) else ()


def _equivalents_told(trial: Trial) -> Iterable[bool]:
    """Effects with equivalents, and whether the claim names one of these or the truth and does not hide the other."""
    for entry in trial.judged:
        if entry.effect.equivalents:
            claim = entry.claim
            yield claim is not None and (
                entry.undecided_rightly or (entry.physics and bool(claim.indistinguishable_from))
            )


def _falsely_undecided(trial: Trial) -> Iterable[bool]:
    """Claims of effects that have no equivalent, and whether they are said to have one."""
    for entry in trial.judged:
        if entry.claim is not None and entry.effect.equivalents == ():
            yield bool(entry.claim.indistinguishable_from)


def _covers(trial: Trial) -> Iterable[bool]:
    for entry in trial.judged:
        for estimate, truth in entry.parameters:
            inside = covered(estimate, truth)
            if inside is not None:
                yield inside


def _called_beyond(trial: Trial) -> Iterable[bool]:
    if trial.truth.kind == "beyond":
        yield trial.answer.verdict == "parameters off" and not trial.answer.finds


def _said(verdict: str, *kinds: str) -> Tally:
    """Answers of a verdict, and whether the trial was of such a kind."""
    return lambda trial: (trial.truth.kind in kinds,) if trial.answer.verdict == verdict else ()


def _finds(verdict: str) -> Tally:
    """Finds of answers of a verdict, and whether something concealed is at their place."""
    return lambda trial: (
        any(same_place(find, one.effect) for one in trial.judged)
        for find in (trial.answer.finds if trial.answer.verdict == verdict else ())
    )


SHARES: Mapping[str, Tally] = {
    "answered": lambda trial: (not trial.answer.failure,),
    "mismatch detected": lambda trial: (trial.answer.detected,) if trial.truth.kind == "concealed" else (),
    "false alarm": lambda trial: (trial.answer.detected,) if trial.truth.kind in ("nothing", "within") else (),
    "false find": lambda trial: (bool(trial.answer.finds),) if trial.truth.kind in NULLS else (),
    "called parameters off": _called_beyond,
    "port": _if(single, lambda entry: entry.port),
    "place": _if(single, lambda entry: entry.place),
    "place in first three": _if(single, lambda entry: entry.place_in_top),
    "physics": _if(single, lambda entry: entry.physics),
    "port, in no catalogue": _if(foreign, lambda entry: entry.port),
    "called unnamed": _if(foreign, lambda entry: entry.claim is not None and not entry.claim.named),
    "called unnamed, though named": _if(single, lambda entry: entry.claim is not None and not entry.claim.named),
    "all of several": lambda trial: (all(e.place for e in trial.judged),) if several(trial) else (),
    "one of several": lambda trial: (any(e.place for e in trial.judged),) if several(trial) else (),
    "superfluous find": lambda trial: (
        (superfluous(trial.answer, trial.judged) > 0,) if trial.truth.kind == "concealed" else ()
    ),
    'said "none", and is': _said("none", "nothing", "within"),
    'said "parameters off", and are': _said("parameters off", "beyond"),
    'find of "physics" at its place': _finds("physics"),
    'find of "undecided" at its place': _finds("undecided"),
    "indistinguishable, and told": _equivalents_told,
    "told apart, but called indistinguishable": _falsely_undecided,
    "interval covers": _covers,
}


def _decibels(trial: Trial) -> Iterable[float]:
    """Of answers whose p-value was not cut off, which says no more than that it is less."""
    given, (low, high) = trial.answer.log10_p, CUT_LOG10_P
    if trial.truth.kind == "concealed" and given is not None and not low < given < high:
        yield decibels_from_clairvoyant(trial.truth.rho_eff, given)


def _before(trial: Trial) -> Iterable[float]:
    if trial.truth.kind == "concealed" and trial.answer.held_out is not None:
        yield trial.answer.held_out.before


def _after(trial: Trial) -> Iterable[float]:
    if trial.truth.kind == "concealed" and trial.answer.held_out is not None:
        yield trial.answer.held_out.after


def _variance(trial: Trial) -> Iterable[float]:
    for entry in trial.judged:
        if not entry.effect.catalogued and entry.claim is not None:
            yield entry.claim.held_out_variance or 0.0


def _errors(trial: Trial) -> Iterable[float]:
    for entry in trial.judged:
        for estimate, truth in entry.parameters:
            yield error_over_bound(estimate, truth) / _MEDIAN_ERROR


MEDIANS: Mapping[str, Measure] = {
    "decibels from the clairvoyant": _decibels,
    "held-out residual over floor, before": _before,
    "held-out residual over floor, after": _after,
    "error over Cramer-Rao bound": _errors,
    "held-out variance of a law in no catalogue": _variance,
    "seconds": lambda trial: (trial.answer.seconds,),
}

LESS_IS_BETTER = frozenset(
    {
        "false alarm", "false find", "called unnamed, though named", "superfluous find",
        "told apart, but called indistinguishable", "decibels from the clairvoyant",
        "held-out residual over floor, after", "error over Cramer-Rao bound", "seconds",
    }
)  # fmt: skip


def score(truths: Sequence[Truth], answers: Iterable[Answer]) -> tuple[Row, ...]:
    """Return the table; every method's answers have to cover every trial."""
    of_method: dict[str, dict[str, Answer]] = {}
    for answer in answers:
        of_method.setdefault(answer.method, {})[answer.trial] = answer
    rows: list[Row] = []
    for method, given in of_method.items():
        missing = {truth.trial for truth in truths} - set(given)
        if missing:
            raise ValueError(f"{method} has no answer for {sorted(missing)}")
        trials = [Trial(truth, given[truth.trial], match(given[truth.trial], truth.effects)) for truth in truths]
        groups: dict[str, list[Trial]] = {ALL: trials}
        for trial in sorted(trials, key=lambda trial: (trial.truth.level, trial.group)):
            groups.setdefault(trial.group, []).append(trial)
        strong = [trial for trial in trials if trial.truth.level >= CONFIDENT]
        if strong:
            groups[STRONG] = strong
        for group, members in groups.items():
            rows += _rows(method, group, members)
    return tuple(rows)


def _rows(method: str, group: str, trials: Sequence[Trial]) -> Iterable[Row]:
    for metric, tally in SHARES.items():
        outcomes = [bool(outcome) for trial in trials for outcome in tally(trial)]
        if outcomes:
            yield share(method, metric, group, sum(outcomes), len(outcomes))
    for metric, measure in MEDIANS.items():
        values = [float(value) for trial in trials for value in measure(trial)]
        if values:
            middle, low, high = (_finite(value) for value in median_interval(values))
            yield Row(
                method=method, metric=metric, group=group, kind="median",
                value=middle, low=low, high=high, of=len(values),
            )  # fmt: skip


def share(method: str, metric: str, group: str, right: int, of: int) -> Row:
    """Return the row of a share."""
    low, high = clopper_pearson(right, of)
    return Row(
        method=method, metric=metric, group=group, kind="share",
        value=right / of, low=low, high=high, of=of, right=right,
    )  # fmt: skip


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
