"""`cd tests && python -m mutations [COUNT]`: try mutated inputs on all cores, and print what became of them."""

from __future__ import annotations

import argparse
import multiprocessing
import os
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from importlib import import_module
from pathlib import Path

from mutations import beginnings, descriptions, recordings, tables
from mutations.process import Tried, try_one
from mutations.subject import BAD, OUTCOMES, Subject

SUBJECTS: tuple[Subject, ...] = (*descriptions.SUBJECTS, *recordings.SUBJECTS, *tables.SUBJECTS, *beginnings.SUBJECTS)
# Imported before processes fork, which then need not.
_LIBRARIES = ("asammdf", "h5py", "nptdms", "scipy.io", "pyarrow.parquet", "mcap_ros2.decoder", "matplotlib.figure")


def shares(count: int, subjects: Sequence[Subject]) -> dict[str, int]:
    """How many of `count` inputs are of each subject."""
    whole = sum(subject.share for subject in subjects)
    return {subject.name: max(1, round(count * subject.share / whole)) for subject in subjects}


def tried(subjects: Sequence[Subject], count: int, seed: int, processes: int) -> Iterator[Tried]:
    """Try inputs in so many processes, and yield what became of each."""
    with tempfile.TemporaryDirectory(prefix="sound-") as name:
        fork = multiprocessing.get_context("fork")
        sound = {subject.name: Path(name) / str(place) for place, subject in enumerate(subjects)}
        numbers = shares(count, subjects)
        # Where a sound input is made, threads run, and whoever forks there may wait for them for ever.
        with fork.Pool(processes, maxtasksperchild=1) as pool:
            pool.starmap(_make, [(subject.name, sound[subject.name]) for subject in subjects], chunksize=1)
        tasks = [
            (subject.name, sound[subject.name], seed + number)
            for subject in subjects
            for number in range(numbers[subject.name])
        ]
        with fork.Pool(processes) as pool:
            yield from pool.imap_unordered(_try, tasks)


def _subject(name: str) -> Subject:
    return next(subject for subject in SUBJECTS if subject.name == name)


def _make(name: str, folder: Path) -> None:
    folder.mkdir()
    _subject(name).make(folder)


def _try(task: tuple[str, Path, int]) -> Tried:
    name, sound, seed = task
    return try_one(_subject(name), sound, seed)


def table(found: Sequence[Tried]) -> str:
    """What became of how many of each subject."""
    counts = Counter((one.subject, one.outcome) for one in found)
    names = list(dict.fromkeys(one.subject for one in found))
    lines = [f"{'':24}" + "".join(f"{outcome:>10}" for outcome in OUTCOMES)]
    lines += [f"{name:24}" + "".join(f"{counts[name, outcome]:10}" for outcome in OUTCOMES) for name in names]
    every = Counter(one.outcome for one in found)
    return "\n".join([*lines, f"{'all ' + str(len(found)):24}" + "".join(f"{every[one]:10}" for one in OUTCOMES)])


def main(words: Sequence[str]) -> int:
    """Try as many as the command line says; return 1 where one of them is not as it should be."""
    parser = argparse.ArgumentParser(prog="python -m mutations", description=__doc__)
    parser.add_argument("count", type=int, nargs="?", default=10_000)
    parser.add_argument("--seed", type=int, default=0, help="number of the first; inputs of one seed are the same")
    parser.add_argument("--only", nargs="+", choices=[subject.name for subject in SUBJECTS], metavar="SUBJECT")
    given = parser.parse_args(words)
    for name in _LIBRARIES:
        import_module(name)
    chosen = [subject for subject in SUBJECTS if given.only is None or subject.name in given.only]
    begun, found = time.monotonic(), list[Tried]()
    for one in tried(chosen, given.count, given.seed, len(os.sched_getaffinity(0))):
        found.append(one)
        if one.outcome in BAD:
            print(f"{one.outcome}: {one.subject}, seed {one.seed}, {one.change}: {one.detail}", flush=True)
    found.sort(key=lambda one: (one.subject, one.seed))
    print(table(found))
    slowest = max(found, key=lambda one: one.seconds)
    print(f"{time.monotonic() - begun:.0f} s; slowest {slowest.seconds:.1f} s: {slowest.subject}, seed {slowest.seed}")
    return 1 if any(one.outcome in BAD for one in found) else 0


if __name__ == "__main__":
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    sys.exit(main(sys.argv[1:]))
