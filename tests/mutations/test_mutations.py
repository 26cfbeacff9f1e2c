"""A few of the mutated inputs, and whether what judges them would see what is wrong."""

from __future__ import annotations

import random
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from kbs_process.errors import RecordingError
from kbs_process.recordings.mcap.framing import CHUNK_OP, DATA_END_OP, MAGIC, PRIVATE_OP, RECORD_HEAD
from mutations import encodings, recordings, tables
from mutations.subject import Outcome, Subject, damaged

pytestmark = pytest.mark.slow

TESTS = Path(__file__).parents[1]
QUICK = ("toml", "init", "csv", "npy", "mcap ros2", "mcap ros2, no checksums", "mcap json, no checksums", "schemas")
# Run in a process without threads, as the judges fork.
PROBE = """
import sys
from pathlib import Path
from mutations import test_mutations
print(test_mutations.probe(sys.argv[1], Path(sys.argv[2])))
"""


def run(*words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, *words], cwd=TESTS, capture_output=True, text=True, timeout=500, check=False)


def test_a_few_of_each_kind_are_refused_right_or_reported() -> None:
    ended = run("-m", "mutations", "63", "--seed", "100000", "--only", *QUICK)
    assert ended.returncode == 0, ended.stdout + ended.stderr
    assert all(name in ended.stdout for name in QUICK)


def test_a_byte_too_many_takes_one_message_wherever_it_pushes_a_number_s_last_byte(tmp_path: Path) -> None:
    """Of a number below zero it lands where an opcode belongs, and looks like that of an application's record."""
    path, sound = tmp_path / recordings.FILE, recordings.sound_rows()
    (subject,) = (one for one in recordings.SUBJECTS if one.name == "mcap ros2, no checksums")
    subject.make(tmp_path)
    whole = path.read_bytes()
    tried, at = 0, len(MAGIC)
    while (opcode := whole[at]) != DATA_END_OP:
        at += RECORD_HEAD.size + RECORD_HEAD.unpack_from(whole, at)[1]
        if opcode == CHUNK_OP and whole[at - 1] >= PRIVATE_OP:
            path.write_bytes(whole[: at - 4] + whole[at - 4 : at - 3] + whole[at - 4 :])
            read, losses = recordings.rows_of(path)
            assert set(read) < sound and len(read) == len(sound) - 1
            assert losses
            tried += 1
    assert tried > 5


def _refuses(_: Path) -> None:
    raise RecordingError("no")


def _fails(_: Path) -> None:
    raise ZeroDivisionError


def _dies(_: Path) -> None:
    sys.exit(3)


def _takes_memory(_: Path) -> None:
    np.ones(50_000_000).sum()


def _hangs(_: Path) -> None:
    time.sleep(60.0)


def _reads(_: Path) -> None:
    pass


READERS: dict[str, tuple[Callable[[Path], None], Outcome]] = {
    "refuses": (_refuses, "refused"),
    "fails": (_fails, "fault"),
    "dies": (_dies, "fault"),
    "takes memory": (_takes_memory, "memory"),
    "hangs": (_hangs, "hang"),
    "reads": (_reads, "right"),
}


def probe(name: str, folder: Path) -> Outcome:
    """What is said of a reader that behaves so."""
    from mutations import process

    process.SECONDS = 5.0

    def judge(folder: Path, tell: Callable[..., None]) -> None:
        READERS[name][0](folder)
        tell("right")

    subject = Subject(name, 1.0, Path.mkdir, lambda rng, folder: "nothing", judge)
    return process.try_one(subject, folder, 1).outcome


@pytest.mark.parametrize("name", READERS)
def test_every_way_to_end_is_told(name: str, tmp_path: Path) -> None:
    ended = run("-c", PROBE, name, str(tmp_path))
    assert ended.stdout.strip() == READERS[name][1], ended.stderr


def test_a_number_that_no_other_reader_has_is_wrong(tmp_path: Path) -> None:
    """A cell is another number, which one reader of two does not see."""
    tables.SUBJECTS[0].make(tmp_path)
    path, told = tmp_path / "run.csv", list[Outcome]()
    first, _, *rest = path.read_text(encoding="utf-8").splitlines()
    path.write_text("\n".join([first, "0.0,1.0,2.0,3.0,0.0", *rest]), encoding="utf-8")
    tables.judged("run.csv", lambda _: tables.sound())(tmp_path, told.append)
    assert told == ["wrong"]
    (tmp_path / "campaign").rename(tmp_path / "campaign of before")
    tables.SUBJECTS[0].judge(tmp_path, told.append)
    assert told == ["wrong", "wrong", "right"]


@pytest.mark.parametrize(
    ("name", "way"), [(name, way) for name in ("tdms", "mf4", "mat") for way in ("as made", *encodings.WAYS[name])]
)
def test_what_is_sound_is_right_in_every_way_to_write_it(tmp_path: Path, name: str, way: str) -> None:
    subject, told = next(one for one in tables.SUBJECTS if one.name == name), list[Outcome]()
    subject.make(tmp_path)
    if way != "as made":
        (tmp_path / f"run.{name}").unlink()
        encodings.WAYS[name][way](tmp_path / f"run.{name}", tables.sound())
    subject.judge(tmp_path, told.append)
    assert told[-1] == "right"


def test_damage_is_the_same_for_the_same_seed() -> None:
    data = bytes(range(256)) * 4
    changed = [damaged(random.Random(seed), data) for seed in range(40)]
    assert changed == [damaged(random.Random(seed), data) for seed in range(40)]
    assert all(one != data for one, what in changed if "zero" not in what and "random" not in what)
