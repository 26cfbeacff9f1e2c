"""One mutated input in a process of its own: how it ends, in what time and memory."""

from __future__ import annotations

import json
import os
import random
import resource
import shutil
import signal
import sys
import tempfile
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from kbs_process.errors import KbsError
from mutations.subject import Outcome, Subject

SECONDS = 200.0  # of a process, after which it hangs
_MB = 1 << 20
_ALLOWED, _EACH_BYTE = 300 * _MB, 64  # memory: so much, and so much a byte of the input


@dataclass(frozen=True, slots=True)
class Tried:
    """What became of one input."""

    subject: str
    seed: int
    change: str
    outcome: Outcome
    detail: str
    seconds: float


def try_one(subject: Subject, sound: Path, seed: int) -> Tried:
    """Mutate a copy of the sound input in folder `sound` by a seed, and judge it."""
    with tempfile.TemporaryDirectory(prefix="mutated-") as name:
        folder = Path(name) / "input"
        shutil.copytree(sound, folder)
        change = _apart(lambda: subject.mutate(random.Random(f"{subject.name} {seed}"), folder))
        begun = time.monotonic()
        outcome, detail = _judged(subject, folder)
        return Tried(subject.name, seed, change, outcome, detail, time.monotonic() - begun)


def _apart(change: Callable[[], str]) -> str:
    """Return what a function says in a process of its own: this one forks again, and must not have its threads."""
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            os.write(writing, change().encode())
        except BaseException:  # noqa: BLE001  of whatever kind: nothing is said
            traceback.print_exc()
        os._exit(0)
    os.close(writing)
    with os.fdopen(reading, "rb") as pipe:
        said = pipe.read().decode()
    os.waitpid(child, 0)
    assert said, "the input could not be made"
    return said


def _judged(subject: Subject, folder: Path) -> tuple[Outcome, str]:
    size = sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())
    reading, writing = os.pipe()
    sys.stdout.flush()
    child = os.fork()
    if child == 0:
        os.close(reading)
        _child(subject, folder, size, writing)
    os.close(writing)
    said = _read(reading, child)
    _, status = os.waitpid(child, 0)
    if said is None:
        return "hang", f"no answer within {SECONDS:.0f} s"
    lines = [json.loads(line) for line in said.splitlines()]
    if os.waitstatus_to_exitcode(status) == 0 and lines:
        outcome, detail = lines[-1]
        return outcome, detail
    # What it was certain of before the other reader, which is not on trial, ended it.
    if lines:
        return lines[-1][0], "the other reader died"
    return "fault", f"ended with {os.waitstatus_to_exitcode(status)}"


def _read(descriptor: int, child: int) -> str | None:
    """Return what a child writes until it ends, None of one that has to be ended."""

    def end(*_: object) -> None:
        os.killpg(child, signal.SIGKILL)
        raise TimeoutError

    signal.signal(signal.SIGALRM, end)
    signal.setitimer(signal.ITIMER_REAL, SECONDS)
    try:
        with os.fdopen(descriptor) as pipe:
            return pipe.read()
    except TimeoutError:
        return None
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)


def _child(subject: Subject, folder: Path, size: int, descriptor: int) -> None:
    """Judge in this process, write outcomes to the descriptor, and end."""
    os.setpgid(0, 0)
    quiet = os.open(os.devnull, os.O_WRONLY)
    os.dup2(quiet, 1)
    os.dup2(quiet, 2)
    before = _kilobytes(resource.RUSAGE_SELF)

    def tell(outcome: Outcome, detail: str = "") -> None:
        # A child of this process counts what it shared with it at first.
        grown = 1024 * (max(map(_kilobytes, (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))) - before)
        if outcome not in ("wrong", "fault") and grown > _ALLOWED + _EACH_BYTE * size:
            outcome, detail = "memory", f"{grown // _MB} MB for {size} bytes"
        os.write(descriptor, (json.dumps([outcome, detail]) + "\n").encode())

    try:
        subject.judge(folder, tell)
    except KbsError as error:
        tell("refused", str(error)[:200])
    except BaseException:  # noqa: BLE001  of whatever kind
        tell("fault", traceback.format_exc()[-600:])
    os._exit(0)


def _kilobytes(who: int) -> int:
    return resource.getrusage(who).ru_maxrss
