"""Sealed sets that were run one after the other, as one table; from tests/:

    python -m proof.pooled SCORE... --output FOLDER [--method NAME ...]

The sets' code and bench were each frozen, and changed between them: this is how often what we landed was right, no
measure of any one version. Trials that one of the methods has not answered are left out, so that all are compared on
the same ones.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TypeVar

import msgspec

from proof.__main__ import table
from proof.answer import Answer
from proof.page import write_page
from proof.score import Bench, score
from proof.truth import Truth
from proof.words import METHODS, OURS

_CHANGED = "Code and bench were frozen for each set, and changed from one to the next."
K = TypeVar("K")
V = TypeVar("V", Truth, Answer)


def pooled(sets: Sequence[Bench], methods: Sequence[str], command: str) -> Bench:
    """One bench of all trials that every method has answered; raises ValueError if there is none, or sets disagree."""
    splits = {one.split for one in sets}
    if len(splits) > 1:
        raise ValueError("development and validation trials are not pooled")
    truths = _once((truth.trial, truth) for one in sets for truth in one.truths)
    answers = _once(((answer.method, answer.trial), answer) for one in sets for answer in one.answers)
    kept = [name for name in sorted(truths) if all((method, name) in answers for method in methods)]
    if not kept:
        raise ValueError(f"no trial was answered by {' and '.join(methods)}")
    told = [truths[name] for name in kept]
    said = [answers[method, name] for method in methods for name in kept]
    return Bench(
        split=sets[0].split,
        seed=", ".join(dict.fromkeys(one.seed for one in sets)),
        command=command,
        isolation="; ".join(dict.fromkeys(one.isolation for one in sets)),
        rows=score(told, said),
        truths=tuple(told),
        answers=tuple(said),
    )


def _once(entries: Iterable[tuple[K, V]]) -> dict[K, V]:
    """By key; sets may share trials, and then have to say the same of them."""
    found: dict[K, V] = {}
    for key, value in entries:
        if found.setdefault(key, value) != value:
            raise ValueError(f"two sets say different things of {key}")
    return found


def main(arguments: Sequence[str] | None = None) -> None:
    """Pool sets; write table and page."""
    parser = argparse.ArgumentParser(prog="python -m proof.pooled", description=__doc__)
    parser.add_argument("score", nargs="+", type=Path, help="score.json of a set")
    parser.add_argument("--output", "-o", type=Path, required=True, help="where table and page go")
    parser.add_argument("--method", action="append", choices=METHODS, help="repeatable [default: ours]")
    asked = parser.parse_args(arguments)
    methods = tuple(dict.fromkeys(asked.method or (OURS,)))
    try:
        sets = [msgspec.json.decode(path.read_bytes(), type=Bench) for path in asked.score]
        named = [*map(str, asked.score), "--output", str(asked.output), *(f"--method '{m}'" for m in methods)]
        bench = pooled(sets, methods, f"{' '.join(['python -m proof.pooled', *named])}. {_CHANGED}")
    except (OSError, ValueError, msgspec.ValidationError) as error:
        parser.error(str(error))
    asked.output.mkdir(parents=True, exist_ok=True)
    rows = msgspec.json.encode(bench.rows, order="deterministic") + b"\n"
    (asked.output / "rows.json").write_bytes(rows)  # truths and answers are in the sets' score.json
    write_page(bench, asked.output / "index.html")
    print("\n".join(table(bench.rows)))
    print(f"Report: {asked.output / 'index.html'}")


if __name__ == "__main__":
    main()
