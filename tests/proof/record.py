"""The benchmark of record: the trials by which a change of the diagnosis is judged; from tests/:

    python -m proof.record --output FOLDER     # what the diagnosis of this checkout says of them, and how much is right
    python -m proof.paired BEFORE AFTER        # what a change gains, trial by trial

The trials are the same for ever, and count as development. Of every five, three conceal one effect that a catalogue
names, one an effect that is in none, and one two effects at once; so the first of them are like all. No family of
physics comes twice before all have come. With them come nulls, which conceal nothing: of every five, two whose numbers
are those of the files, two that are off within their uncertainties and one beyond. Trials that FOLDER/score.json holds
are not answered again: what was begun goes on, and what belongs to other code belongs into another folder.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from time import monotonic
from typing import NamedTuple

import msgspec
import numpy as np

from kbs_process.results.parallel import each, workers
from proof import answer, coverage
from proof.__main__ import table
from proof.answer import Answer
from proof.bundle import pack
from proof.concealed import trials
from proof.concealed.effects import BY_NAME, PHYSICS
from proof.concealed.trials import Kind, Spec
from proof.isolate import CHECKOUT
from proof.methods import Job, answer_trial
from proof.page import write_page
from proof.prove import isolation
from proof.score import ALL, Bench, encode, score, share
from proof.truth import Truth
from proof.words import OURS

SEED = 1996
COUNT, NULLS = 40, 100
SMOOTHER = "smoother"  # a rival that is not part of sealed sets: proof.rivals.smoother
_KINDS: tuple[Kind, ...] = ("within", "nothing", "within", "nothing", "beyond")  # of nulls in turn
_FIRST_NULL = 1000  # index
_LEVELS = (300.0, 100.0, 1000.0, 300.0)  # of the trials in turn, effects of one trial alike


def draw(count: int = COUNT) -> list[Spec]:
    """Say what the first `count` trials are."""
    rng = np.random.default_rng([SEED, 5])
    catalogued = _by_family([physics.name for physics in PHYSICS if physics.catalogued], rng)
    foreign = [str(name) for name in rng.permutation([physics.name for physics in PHYSICS if not physics.catalogued])]
    pairs = [
        (one, other) for one in catalogued for other in catalogued[::-1] if BY_NAME[one].port != BY_NAME[other].port
    ]
    order = rng.permutation(len(pairs))
    specs = []
    for index in range(count):
        turn, place = divmod(index, 5)
        named: tuple[str, ...] = (catalogued[(3 * turn + place) % len(catalogued)],)
        if place == 3:
            named = (foreign[turn % len(foreign)],)
        elif place == 4:
            named = pairs[order[turn]]
        alike = [name for name in (foreign if place == 3 else catalogued) if name not in named]
        spare = [alike[k] for k in np.random.default_rng([SEED, 6, index]).permutation(len(alike))]
        levels = (_LEVELS[(index + turn) % len(_LEVELS)],) * len(named)
        specs.append(Spec("development", SEED, index, "concealed", (*named, *spare), len(named), levels))
    return specs


def nulls(count: int = NULLS) -> list[Spec]:
    """Say what the first `count` nulls are."""
    return [Spec("development", SEED, _FIRST_NULL + k, _KINDS[k % len(_KINDS)]) for k in range(count)]


def name_of(spec: Spec) -> str:
    """What a trial of the record is called."""
    return f"R{spec.index:03d}" if spec.count else f"N{spec.index - _FIRST_NULL:03d}"


def _by_family(names: Sequence[str], rng: np.random.Generator) -> list[str]:
    """Shuffle physics so that each family comes once before any comes again."""
    seen: dict[str, int] = {}
    rounds = []
    for place, k in enumerate(rng.permutation(len(names))):
        family = BY_NAME[names[k]].family
        seen[family] = seen.get(family, 0) + 1
        rounds.append((seen[family], place, names[k]))
    return [name for *_, name in sorted(rounds)]


def made(spec: Spec, cache: Path) -> tuple[bytes, Truth]:
    """Return a trial, packed, and its truth; from `cache`, if it was made before."""
    name = name_of(spec)
    files = cache / f"{name}.tar", cache / f"{name}.json"
    if not all(file.is_file() for file in files):
        cache.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix="make-") as scratch:
            folder = Path(scratch) / name
            told = msgspec.convert(trials.make(spec, folder), Truth)
            for file, content in zip(files, (pack(folder), msgspec.json.encode(told)), strict=True):
                aside = file.with_suffix(".part")
                aside.write_bytes(content)
                aside.replace(file)
    return files[0].read_bytes(), msgspec.json.decode(files[1].read_bytes(), type=Truth)


class Answered(NamedTuple):
    """A trial and what a method says of it."""

    truth: Truth
    answer: Answer
    # The rig's numbers whose intervals hold the truth, of those that are told; None where all may be off.
    covered: tuple[int, int] | None


def answered(spec: Spec, cache: Path, method: str) -> Answered:
    """Make a trial and let a method answer it, in a process that cannot see the truth."""
    content, truth = made(spec, cache)
    given = answer.decode(answer_trial(Job(truth.trial, content, (method,), hidden=(cache,)))[method])
    kept = msgspec.structs.replace(given, numbers=())
    if spec.kind == "beyond" or not given.numbers:
        return Answered(truth, kept, None)
    told = [one for one in coverage.answered(given.numbers, *coverage.hardware(spec)) if one.told]
    return Answered(truth, kept, (sum(one.covered for one in told), len(told)))


def main() -> None:
    """Answer what was not answered before; write score and page after each."""
    options = argparse.ArgumentParser(prog="python -m proof.record", description=__doc__)
    options.add_argument("--output", "-o", type=Path, required=True, help="where score.json and the page go")
    options.add_argument("--trials", type=int, default=COUNT, help=f"the first so many [default: {COUNT}]")
    options.add_argument("--nulls", type=int, default=NULLS, help=f"the first so many nulls [default: {NULLS}]")
    options.add_argument("--method", choices=(OURS, SMOOTHER), default=OURS, help=f"who answers [default: {OURS}]")
    options.add_argument("--cache", type=Path, default=CHECKOUT / ".proof" / "record", help="where made trials stay")
    options.add_argument("--jobs", type=int, default=len(os.sched_getaffinity(0)), help="processes")
    asked = options.parse_args()
    file, begin = asked.output / "score.json", monotonic()
    known: dict[str, Answered] = {}
    if file.is_file():
        before = msgspec.json.decode(file.read_bytes(), type=Bench)
        known = {
            truth.trial: Answered(truth, said, before.coverage.get(truth.trial))
            for truth, said in zip(before.truths, before.answers, strict=True)
        }
    wanted = [*draw(asked.trials), *nulls(asked.nulls)]
    todo = [spec for spec in wanted if name_of(spec) not in known]
    task = partial(answered, cache=asked.cache, method=asked.method)
    os.nice(5)
    with workers(asked.jobs) as pool:
        for done, (_, one) in enumerate(each(pool, task, todo), start=1):
            known[one.truth.trial] = one
            bench = _bench([known[name] for name in sorted(known)])
            asked.output.mkdir(parents=True, exist_ok=True)
            file.write_bytes(encode(bench))
            write_page(bench, asked.output / "index.html")
            print(
                f"{monotonic() - begin:7.1f} s  {one.truth.trial}, {done} of {len(todo)}", file=sys.stderr, flush=True
            )
    print("\n".join(table(msgspec.json.decode(file.read_bytes(), type=Bench).rows)))


def _bench(every: Sequence[Answered]) -> Bench:
    truths, answers = tuple(one.truth for one in every), tuple(one.answer for one in every)
    covered = {one.truth.trial: one.covered for one in every if one.covered is not None}
    held, told = (sum(one[k] for one in covered.values()) for k in (0, 1))
    numbers = (share(answers[0].method, "interval of a rig's number covers", ALL, held, told),) if told else ()
    return Bench(
        split="development",
        seed=str(SEED),
        command="python -m proof.record",
        isolation=isolation(None),
        rows=(*score(truths, answers), *numbers),
        truths=truths,
        answers=answers,
        coverage=covered,
    )


if __name__ == "__main__":
    main()
