"""The methods that compete, and how each is run on a trial: in a process that cannot see the truth."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from time import monotonic

from proof import answer, isolate
from proof.answer import Answer
from proof.bundle import unpack
from proof.diagnosis import answer_of
from proof.words import OURS

TESTS = Path(__file__).resolve().parents[1]
DIAGNOSE = (sys.executable, "-c", "from kbs_process.cli import main; main()", "diagnose")
TIMEOUT = 1800.0  # s, for one method on one trial


@dataclass(frozen=True, slots=True)
class Job:
    """One trial and the methods that are to answer it; `hidden` are folders that they must not see."""

    trial: str
    content: bytes
    methods: tuple[str, ...]
    hidden: tuple[Path, ...] = ()
    timeout_s: float = TIMEOUT


def answer_trial(job: Job) -> dict[str, bytes]:
    """Return each method's answer as it is written."""
    rivals = tuple(method for method in job.methods if method != OURS)
    answers = {OURS: _ours(job)} if OURS in job.methods else {}
    if rivals:
        answers |= _rivals(job, rivals)
    return {method: answer.encode(given) for method, given in answers.items()}


def _ours(job: Job) -> Answer:
    command = (*DIAGNOSE, job.trial, "--output", "out", "--no-pdf", "--quiet")
    with _run(job, command, hidden=(TESTS,)) as (scratch, seconds, why):
        if why:
            return failed(OURS, job.trial, seconds, why)
        try:
            return answer_of((scratch / "out" / "results.json").read_bytes(), job.trial, seconds)
        except (OSError, ValueError) as error:
            return failed(OURS, job.trial, seconds, str(error))


def _rivals(job: Job, methods: tuple[str, ...]) -> dict[str, Answer]:
    """All rivals in one process: they begin alike."""
    command = (sys.executable, "-m", "proof.rivals", job.trial, ".", *methods)
    hidden = (TESTS / "proof" / "concealed", TESTS / "archive")
    found = {}
    with _run(job, command, hidden=hidden, path=(TESTS,)) as (scratch, seconds, why):
        for method in methods:
            file = scratch / f"{method}.json"
            if file.is_file():
                found[method] = answer.decode(file.read_bytes())
            else:
                found[method] = failed(method, job.trial, seconds, why)
    return found


@contextmanager
def _run(
    job: Job, command: Sequence[str], *, hidden: tuple[Path, ...], path: tuple[Path, ...] = ()
) -> Iterator[tuple[Path, float, str]]:
    """Run a command on a copy of the trial; yield its scratch folder, its seconds, and why it failed, if it did."""
    begin = monotonic()
    with tempfile.TemporaryDirectory(prefix="trial-") as folder:
        scratch, why = Path(folder), ""
        unpack(job.content, scratch / job.trial)
        try:
            done = isolate.run(command, scratch, hidden=(*job.hidden, *hidden), timeout_s=job.timeout_s, path=path)
            if done.returncode:
                why = f"exit status {done.returncode}: {done.stderr.strip()[-500:]}"
        except subprocess.TimeoutExpired:
            why = f"no answer within {job.timeout_s:g} s"
        yield scratch, monotonic() - begin, why


def failed(method: str, trial: str, seconds: float, why: str) -> Answer:
    """Return the answer of a method that gave none."""
    return Answer(method=method, trial=trial, detected=False, verdict="undecided", seconds=seconds, failure=why[:600])
