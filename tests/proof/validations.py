"""How often the diagnosis is right, from the stored sets and cases to the documents; from tests/:

    python -m proof.validations

It writes docs/validations.md, and the block between the marks in README.md and docs/diagnose.md.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from proof.aims import find
from proof.answer import Answer
from proof.match import match
from proof.page import concealed, said
from proof.pooled import pooled
from proof.score import ALL, STRONG, Bench, Row
from proof.truth import Truth
from proof.words import NULLS, OURS, RIVALS

ROOT = Path(__file__).resolve().parents[2]
STORE = ROOT / "reports" / "proof"
PAGE = ROOT / "docs" / "validations.md"
MARKED = (ROOT / "README.md", ROOT / "docs" / "diagnose.md")
BLOCK = re.compile(r"(?<=<!-- how often right -->\n).*?(?=<!-- end -->)", re.DOTALL)

# What users read, and the number of the table that it is.
_NUMBERS = {
    "mismatch detected": "mismatch detected, where there is an effect",
    "false find": "effect reported, where there is none",
    "port": "port right",
    "place": "place right: port, and axis or channel",
    "place in first three": "place among the first three",
    "physics": "physics right: place and family",
    "port, in no catalogue": "port right, effect outside the catalogue",
    "called unnamed": "reported as a measured curve, likewise",
    "all of several": "all places right, of two or three effects",
    "one of several": "one place right, likewise",
    "superfluous find": "an effect too many reported",
    'said "none", and is': '"none" said, and nothing is there',
    'said "parameters off", and are': '"parameters off" said, and some are',
    'find of "physics" at its place': 'effect of a "physics" answer at its place',
    'find of "undecided" at its place': 'nearest effect of an "undecided" answer at its place',
    "interval covers": "interval of a parameter holds the truth",
}
_EACH = {
    "mismatch detected": "mismatch detected",
    "false find": "effect where there is none",
    "place": "place",
    "physics": "physics",
    "port, in no catalogue": "port, outside the catalogue",
    "all of several": "all of several",
}
_NULL = {
    "nothing": "no effect",
    "within": "no effect; parameters within their uncertainties",
    "beyond": "no effect; beyond their uncertainty: ",
}
_LIMITS = """- The code and the test bench changed between sets. The table says how often the answers were right.
  It measures no single version.
- A right family can still be wrong in fact. One of the right ones is the curve of another channel.
- "Undecided" with the right effect as the nearest one counts as right.
- The catalogue grew towards what the generator makes: 14 of its effects were outside at first, 6 are now.
- Some effects (creep, tilt, tones, drag) have the same formula in both engines. They are the easier ones.
- Trials of earlier sets were studied after they were opened, and thresholds were set on some of them.
- A *strength* is the effect's distance from the repeatability in the whitened metric. What the nominal parameters can
  absorb is taken out to first order. A refit absorbs more, so that some strengths are too large.
- Both engines are ours, and share the specification of frames and signals."""


@dataclass(frozen=True, slots=True)
class Sealed:
    """A sealed set: its number, the code that answered, how many trials were made, and what came of it."""

    number: int
    commit: str
    made: int
    bench: Bench


def load_sets() -> tuple[Sealed, ...]:
    """Return all sealed sets, in the order in which they were opened."""
    entries = tomllib.loads((STORE / "sets.toml").read_text(encoding="utf-8"))["set"]
    return tuple(
        Sealed(number, entry["commit"], entry["sealed"], load_bench(entry["folder"]))
        for number, entry in enumerate(entries, 1)
    )


def load_bench(folder: str) -> Bench:
    """Return the stored bench of a set."""
    return msgspec.json.decode((STORE / folder / "score.json").read_bytes(), type=Bench)


def sentence(rows: Sequence[Row], sets: int, trials: int) -> str:
    """How often the diagnosis is right, as the README says it."""
    place, physics, false, outside = (
        _row(rows, name) for name in ("place", "physics", "false find", "port, in no catalogue")
    )
    return (
        f"The diagnosis is experimental. It was tried on {trials} simulated campaigns with concealed effects "
        f"({sets} sealed\nsets, with changes of the code between them). "
        f"Of {physics.of} single effects that its catalogue has, it named {physics.right}\n"
        f"rightly ({_interval(physics)}), and placed {place.right}. "
        f"Of {outside.of} effects outside the catalogue it found where {outside.right} enter.\n"
        f"It reported an effect in {false.right} of {false.of} campaigns that had none.\n"
    )


def document(sets: Sequence[Sealed], whole: Bench, line: str, rivals: Bench) -> str:
    """The page on how often the diagnosis is right: `line`, all sets as one, rivals, each set, trial and case."""
    made = sum(one.made for one in sets)
    return "\n".join(
        (
            "# How often the diagnosis is right",
            "",
            "<!-- Written by `cd tests && python -m proof.validations`; do not edit. -->",
            "",
            line,
            "A sealed trial is a campaign with effects that its model lacks. What they are is encrypted until all",
            "answers are written ([how](dev/proof.md)). Brackets hold exact binomial intervals of 95 %.",
            "",
            "## All sets together",
            "",
            f"{made} trials were sealed. {len(whole.truths)} are scored. The others were not answered when the time",
            "was up, and stayed sealed.",
            "",
            *_table(("number", "all strengths", "strength 300 and more"), _together(whole.rows)),
            "",
            "What these numbers do not say:",
            "",
            _LIMITS,
            "",
            "## Beside other methods",
            "",
            f"{len(rivals.truths)} of the trials were answered by the rivals, too. All methods get the same",
            "recordings, the same repeatability and the same refit of the nominal parameters.",
            "",
            *(f"- *{name}*: {what}." for name, what in RIVALS.items()),
            "",
            *_table(("number", OURS, *RIVALS), _beside(rivals.rows)),
            "",
            "## Set by set",
            "",
            *_table(("set", "commit", "trials, without an effect", *_EACH.values()), map(_one, sets)),
            "",
            "## Trial by trial",
            "",
            "The number in brackets is the strength. At the transducer the place includes the strongest channel.",
            "*Unnamed* are an effect outside the catalogue, and a measured curve.",
            *(line for one in sets for line in _trials(one)),
            "",
            *_cases(),
        )
    )


def _together(rows: Sequence[Row]) -> Iterable[Sequence[str]]:
    for name, words in _NUMBERS.items():
        if find(rows, OURS, name, ALL):
            yield words, _share(find(rows, OURS, name, ALL)), _share(find(rows, OURS, name, STRONG))


def _beside(rows: Sequence[Row]) -> Iterable[Sequence[str]]:
    for name, words in _NUMBERS.items():
        if find(rows, OURS, name, ALL):
            yield words, *(_count(find(rows, method, name, ALL)) for method in (OURS, *RIVALS))


def _one(one: Sealed) -> Sequence[str]:
    nulls = sum(truth.kind in NULLS for truth in one.bench.truths)
    counts = (_count(find(one.bench.rows, OURS, name, ALL)) for name in _EACH)
    return str(one.number), one.commit, f"{len(one.bench.truths)}, {nulls}", *counts


def _trials(one: Sealed) -> Iterable[str]:
    answers = {answer.trial: answer for answer in one.bench.answers if answer.method == OURS}
    ordered = sorted(one.bench.truths, key=lambda truth: (-truth.level, truth.kind, truth.trial))
    pairs = ((truth, answers[truth.trial]) for truth in ordered)
    rows = ((_strength(truth), said(answer), answer.verdict, _judged(truth, answer)) for truth, answer in pairs)
    yield from ("", f"### Set {one.number}", "", *_table(("concealed", "said", "answer", "right"), rows))


def _strength(truth: Truth) -> str:
    if truth.effects:
        return f"{concealed(truth)} ({truth.level:g})"
    return f"{_NULL[truth.kind]}{', '.join(f'{one.name} by {one.sigmas:.1f} sigma' for one in truth.beyond)}"


def _judged(truth: Truth, answer: Answer) -> str:
    """What of an answer is right."""
    if answer.failure:
        return "no answer"
    if truth.kind in NULLS:
        right = answer.verdict == ("parameters off" if truth.kind == "beyond" else "none")
        return (
            "no" if answer.finds else "yes" if right else "missed" if answer.verdict == "none" else "no effect claimed"
        )
    judged = match(answer, truth.effects)
    if len(judged) > 1:
        return f"{sum(one.place for one in judged)} of {len(judged)} places"
    (one,) = judged
    return "physics" if one.physics else "place" if one.place else "port" if one.port else "no"


def _cases() -> Iterable[str]:
    yield from ("## Campaigns by other hands, and real recordings", "")
    yield "A reader compared answer and truth. Numbers *left* are held-out residuals over the repeatability, as power."
    for group in tomllib.loads((STORE / "cases.toml").read_text(encoding="utf-8"))["group"]:
        yield from ("", f"### {group['title']}", "", group["about"])
        if "command" in group:
            yield from ("", f"    {group['command']}")
        yield ""
        yield from _table(("", "concealed", "answer", "judged", "s"), map(_case, group["case"]))
    yield ""


def _case(case: dict[str, Any]) -> Sequence[str]:
    return case["name"], case["concealed"], case["answer"], case["judged"], str(case.get("seconds", ""))


def _row(rows: Sequence[Row], name: str) -> Row:
    row = find(rows, OURS, name, ALL)
    if row is None:
        raise ValueError(f"no trial tries '{name}'")
    return row


def _share(row: Row | None) -> str:
    return "" if row is None else f"{row.right} of {row.of} ({_interval(row)})"


def _count(row: Row | None) -> str:
    return "" if row is None else f"{row.right} of {row.of}"


def _interval(row: Row) -> str:
    return f"{100 * (row.low or 0.0):.0f} to {100 * (row.high or 0.0):.0f} %"


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> Iterable[str]:
    yield f"| {' | '.join(head)} |"
    yield "| " + " | ".join("---" for _ in head) + " |"
    for row in rows:
        yield f"| {' | '.join(row)} |"


def documents() -> dict[Path, str]:
    """Return every document with its generated text in place."""
    sets = load_sets()
    rivals = pooled([*(one.bench for one in sets), load_bench("validation-3-rivals")], (OURS, *RIVALS), "")
    whole = pooled([one.bench for one in sets], (OURS,), "")
    line = sentence(whole.rows, len(sets), len(whole.truths))
    marked = {path: BLOCK.sub(lambda _: line, path.read_text(encoding="utf-8")) for path in MARKED}
    return {PAGE: document(sets, whole, line, rivals), **marked}


if __name__ == "__main__":
    for path, text in documents().items():
        path.write_text(text, encoding="utf-8")
