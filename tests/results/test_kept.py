"""What was computed is not computed again: from the same alone, as it was, and no more than there is room for."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from archived import campaign
from kbs_process.cache import LIMIT
from kbs_process.errors import ConfigError, RecordingError
from kbs_process.progress import SilentProgress
from kbs_process.reduction.preparing import Prepared, fit_gravity, prepare
from kbs_process.results.kept import kept
from kbs_process.signals.records import Loss, Signal
from kbs_process.stages import decouple


class Counted:
    """Makes a result, and counts how often."""

    def __init__(self, made: object = None) -> None:
        self.made, self.times = made, 0

    def __call__(self) -> object:
        self.times += 1
        return self.made


@pytest.fixture(autouse=True)
def stages(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("KBS_CACHE", str(tmp_path))
    monkeypatch.setenv(LIMIT, "100")
    return tmp_path / "stages"


SIGNAL = Signal(0.1, 0.5, np.arange(6.0).reshape(3, 2), ("a", "b"), ("N", "N"), "T", np.ones(3, dtype=np.bool_), ("x",))
EVERY = (
    None, True, 7, -0.0, float("nan"), float("inf"), "Ω", b"\0", Path("a/b"), [1, (2, {3})], {(1, "a"): {"b": ()}},
    np.float64(0.1), np.int64(-5), np.array(2.5), np.zeros((0, 2)), np.array(["ab", "c"]), np.array([1 + 2j]),
    SIGNAL, Loss("gap", "here", 3, detail="of a kind"),
)  # fmt: skip


def alike(one: object, other: object) -> bool:
    """Whether two results are the same to the last bit, and of the same types."""
    if type(one) is not type(other):
        return False
    if isinstance(one, np.ndarray | np.generic):
        same = one.dtype == other.dtype and one.shape == other.shape and one.tobytes() == other.tobytes()  # type: ignore[attr-defined]
        return same and one.flags.c_contiguous == other.flags.c_contiguous  # type: ignore[attr-defined]
    if isinstance(one, tuple | list):
        return len(one) == len(other) and all(map(alike, one, other))  # type: ignore[arg-type]
    if hasattr(one, "__dataclass_fields__"):
        return all(alike(getattr(one, name), getattr(other, name)) for name in one.__dataclass_fields__)
    return repr(one) == repr(other)


@pytest.mark.parametrize("value", EVERY, ids=repr)
def test_what_is_kept_comes_back_as_it_was(value: object) -> None:
    for _ in range(2):
        assert alike(kept("stage", value, Counted(value)), value)
    assert kept("stage", value, never) is not never


def never() -> object:
    raise AssertionError("computed again")


def test_arrays_lie_in_memory_alike_whether_kept_or_not(monkeypatch: pytest.MonkeyPatch) -> None:
    """Or sums over them would differ in their last bits."""
    whole = np.random.default_rng(1).normal(size=(50, 40))
    views = (whole.T, whole[::2, ::3], np.broadcast_to(whole[:1], (3, 40)), whole[:, 3], whole)
    first, second = kept("stage", 1, lambda: views), kept("stage", 1, never)
    monkeypatch.setenv(LIMIT, "0")
    alone = kept("stage", 1, lambda: views)
    for given, one, two, three in zip(views, first, second, alone, strict=True):  # type: ignore[arg-type]
        assert np.array_equal(one, given)
        assert one.strides == two.strides == three.strides


@pytest.mark.parametrize(
    ("stage", "inputs"),
    [
        ("stage", (1, SIGNAL, np.zeros((2, 2)), "b")),
        ("stage", (1, SIGNAL, np.zeros(4), "a")),
        ("stage", (1, SIGNAL, np.zeros((2, 2), dtype=np.float32), "a")),
        ("stage", (True, SIGNAL, np.zeros((2, 2)), "a")),
        ("stage", (1, SIGNAL.derive(SIGNAL.values, "y"), np.zeros((2, 2)), "a")),
        ("other", (1, SIGNAL, np.zeros((2, 2)), "a")),
    ],
)
def test_other_inputs_have_other_results(stage: str, inputs: object) -> None:
    kept("stage", (1, SIGNAL, np.zeros((2, 2)), "a"), Counted())
    made = Counted()
    kept(stage, inputs, made)
    assert made.times == 1


def test_what_fails_is_not_kept() -> None:
    def fails() -> object:
        raise RecordingError("unreadable")

    for _ in range(2):
        with pytest.raises(RecordingError, match="unreadable"):
            kept("stage", 1, fails)
    assert kept("stage", 1, lambda: 2) == 2


def cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-1])


def flip(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[-3] ^= 1
    path.write_bytes(content)


def empty(path: Path) -> None:
    path.write_bytes(b"")


def of_another_key(path: Path) -> None:
    kept("stage", "other", lambda: np.full(9, 5.0))
    (other,) = set(path.parent.iterdir()) - {path}
    other.replace(path)


def linked(path: Path) -> None:
    path.rename(path.with_name("aside"))
    path.symlink_to("aside")


def a_folder(path: Path) -> None:
    path.unlink()
    path.mkdir()


def a_pipe(path: Path) -> None:
    path.unlink()
    os.mkfifo(path)


@pytest.mark.parametrize("damage", [cut, flip, empty, of_another_key, linked, a_folder, a_pipe])
def test_a_damaged_entry_is_made_anew(stages: Path, damage: Callable[[Path], None]) -> None:
    kept("stage", 1, lambda: np.arange(9.0))
    (entry,) = stages.iterdir()
    damage(entry)
    made = Counted(np.arange(9.0))
    assert np.array_equal(kept("stage", 1, made), np.arange(9.0))  # type: ignore[arg-type]
    assert made.times == 1
    if damage is not a_folder:
        assert np.array_equal(kept("stage", 1, never), np.arange(9.0))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "tree", [["record", "os", "system", "true"], ["record", "kbs_process.cli", "main"], ["new"], 5]
)
def test_an_entry_runs_nothing(stages: Path, monkeypatch: pytest.MonkeyPatch, tree: object) -> None:
    """Whatever is written there with a right digest: what is no record of this package is made anew."""
    import hashlib

    import msgspec

    kept("stage", 1, lambda: "right")
    (entry,) = stages.iterdir()
    head = msgspec.msgpack.encode([tree, []] if tree != 5 else tree)
    content = entry.name.encode() + len(head).to_bytes(8, "little") + head
    entry.write_bytes(hashlib.sha256(content).digest() + content)
    monkeypatch.setattr(os, "system", never)
    assert kept("stage", 1, lambda: "right") == "right"


def test_what_was_not_used_for_longest_goes_first(stages: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(LIMIT, "2")
    large = np.zeros(80_000)  # 0.64 MB
    for number in range(3):
        kept("stage", number, lambda: large)
        for age, path in enumerate(sorted(stages.iterdir(), key=lambda path: -path.stat().st_mtime_ns)):
            os.utime(path, (10**9 - age, 10**9 - age))
    kept("stage", 0, never)
    kept("stage", 3, lambda: large)
    assert sum(path.stat().st_size for path in stages.iterdir()) <= 2e6
    kept("stage", 0, never)
    again = Counted(large)
    kept("stage", 1, again)
    assert again.times == 1


def test_what_is_larger_than_the_limit_is_not_kept(stages: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(LIMIT, "1")
    kept("stage", 0, lambda: np.zeros(200_000))
    assert not stages.exists()


def test_nothing_is_kept_or_read_where_that_is_switched_off(stages: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    kept("stage", 1, lambda: "before")
    monkeypatch.setenv(LIMIT, "0")
    assert kept("stage", 1, lambda: "now") == "now"
    assert kept("stage", 2, lambda: "now") == "now"
    assert len(list(stages.iterdir())) == 1


@pytest.mark.parametrize("size", ["much", "-1", "1.5", "٣", "9999999999"])
def test_a_size_that_is_none_is_refused(monkeypatch: pytest.MonkeyPatch, size: str) -> None:
    monkeypatch.setenv(LIMIT, size)
    with pytest.raises(ConfigError, match=f"{LIMIT}: '{size}' is no size in MB"):
        kept("stage", 1, never)


@pytest.mark.parametrize("place", ["a file", "below a file"])
def test_a_cache_that_cannot_be_written_is_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, place: str) -> None:
    file = tmp_path / "file"
    file.write_text("mine")
    monkeypatch.setenv("KBS_CACHE", str(file if place == "a file" else file / "below"))
    assert kept("stage", 1, lambda: 2) == 2
    assert file.read_text() == "mine"


@pytest.mark.slow
def test_reading_and_gravity_are_the_same_from_the_cache(stages: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Bit for bit: what is kept, what has just been computed, and what nobody keeps."""
    sound = campaign("EL089")
    entries = [entry for entry in sound.recordings if entry.role != "held-out"]

    def found() -> tuple[list[Prepared], object]:
        decoupling = decouple.fit(sound.rig)
        prepared = [prepare(sound, entry, decoupling, SilentProgress()) for entry in entries]
        return prepared, fit_gravity(sound, prepared, SilentProgress())

    first, again = found(), found()
    assert len(list(stages.iterdir())) == len(entries) + 1
    monkeypatch.setenv(LIMIT, "0")
    assert alike(first, again)
    assert alike(first, found())


@pytest.mark.slow
def test_a_second_run_computes_no_stage_again(tmp_path: Path) -> None:
    """Nor does processing what `validate` has computed; and all results are the same, to the last bit."""
    stages = tmp_path / "stages"

    def run(*words: str, limit: str = "100") -> set[str]:
        before = {path.name for path in stages.iterdir()} if stages.exists() else set()
        command = [sys.executable, "-m", "kbs_process", *words, "-q"]
        subprocess.run(command, check=True, capture_output=True, env={**os.environ, LIMIT: limit})
        return {path.name for path in stages.iterdir()} - before if stages.exists() else set()

    process = ["campaign/AZPS_ATA", "--no-diagnose", "--no-pdf", "-o"]
    run(*process, str(tmp_path / "alone"), limit="0")
    assert not stages.exists()
    validated = run("validate", "campaign/AZPS_ATA")
    assert validated
    assert run(*process, str(tmp_path / "first"))
    assert not run(*process, str(tmp_path / "second"))
    assert not run("validate", "campaign/AZPS_ATA")
    for name in ("results.json", "index.html", ".kbs-process.sha256"):
        contents = {(tmp_path / folder / name).read_bytes() for folder in ("alone", "first", "second")}
        assert len(contents) == 1
