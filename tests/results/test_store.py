"""Old results stay whole whatever happens while new ones are written."""

from __future__ import annotations

import errno
import itertools
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path
from types import FrameType
from typing import Any

import pytest

from kbs_process.errors import OutputError
from kbs_process.results import store
from kbs_process.results.store import revising, writing

MARKER = store.RESULTS


def write(target: Path, text: str) -> None:
    with writing(target) as folder:
        (folder / MARKER).write_text(text)
        (folder / "tables").mkdir()
        (folder / "tables" / "a.parquet").write_text(text)


def content(target: Path) -> dict[str, str]:
    files = (path for path in target.rglob("*") if path.is_file() and path.name != store.LIST)
    return {str(path.relative_to(target)): path.read_text() for path in files}


def whole(text: str) -> dict[str, str]:
    return {MARKER: text, "tables/a.parquet": text}


def leftovers(target: Path) -> list[str]:
    return sorted(path.name for path in target.parent.iterdir() if path.name != target.name)


def child(code: str, target: Path, *, prelude: str = "") -> subprocess.Popen[str]:
    """Start a process that imports the store, runs `prelude`, and then `code` with `target`."""
    program = (
        "import os, sys, time, resource, signal\nfrom pathlib import Path\n"
        "from kbs_process.results.store import writing\nfrom kbs_process.errors import OutputError\n"
        f"{prelude}\ntarget = Path(sys.argv[1])\n{code}\n"
    )
    return subprocess.Popen(
        [sys.executable, "-c", program, str(target)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


HALF_WAY = """
with writing(target) as folder:
    (folder / "results.json").write_text("new")
    print("half-way", flush=True)
    time.sleep(60)
"""


@pytest.mark.parametrize("exchange", [True, False])
def test_results_replace_results(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, exchange: bool) -> None:
    if not exchange:
        monkeypatch.setattr(store.ctypes, "CDLL", lambda *_, **__: object())  # a system without renameat2
    target = tmp_path / "reports" / "A"
    write(target, "first")
    assert content(target) == whole("first")
    write(target, "second")
    assert content(target) == whole("second")
    assert leftovers(target) == []


def test_this_system_exchanges_folders_in_one_step(tmp_path: Path) -> None:
    if not sys.platform.startswith("linux"):
        pytest.skip("renameat2 is Linux's")
    one, other = tmp_path / "one", tmp_path / "other"
    one.mkdir()
    other.mkdir()
    (one / "file").touch()
    assert store._exchange(one, other)
    assert (other / "file").exists()


def test_an_error_leaves_the_old_results(tmp_path: Path) -> None:
    target = tmp_path / "A"
    write(target, "old")

    def fail() -> None:
        with writing(target) as folder:
            (folder / MARKER).write_text("new")
            raise ValueError("fault")

    with pytest.raises(ValueError, match="fault"):
        fail()
    assert content(target) == whole("old")
    assert leftovers(target) == []


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # between `open` and its `with`
def test_an_interrupt_at_any_line_before_the_block_leaves_nothing_behind(tmp_path: Path) -> None:
    target = tmp_path / "A"
    write(target, "old")

    def interrupted(at: int) -> bool:
        lines = itertools.count()

        def trace(frame: FrameType, event: str, argument: object) -> Any:
            if frame.f_code.co_filename != store.__file__ or "lock" in frame.f_code.co_name:
                return None  # a lock is held until the process ends: this one goes on
            if event == "line" and next(lines) == at:
                raise KeyboardInterrupt
            return trace

        before = sys.gettrace()
        sys.settrace(trace)
        try:
            with writing(target) as folder:
                sys.settrace(before)
                assert folder.name in leftovers(target)
        except KeyboardInterrupt:
            return True
        finally:
            sys.settrace(before)
        return False

    tried = 0
    while interrupted(tried):
        # A lock may stay: it is held by nobody, and the next run takes it.
        assert set(leftovers(target)) <= {".A.lock"}, tried
        tried += 1
    assert tried > 10


def test_a_kill_leaves_the_old_results_and_the_next_run_cleans_up(tmp_path: Path) -> None:
    target = tmp_path / "A"
    write(target, "old")
    process = child(HALF_WAY, target)
    assert process.stdout is not None
    assert process.stdout.readline() == "half-way\n"
    process.send_signal(signal.SIGKILL)
    process.communicate()
    assert content(target) == whole("old")
    lock, private = leftovers(target)
    assert lock == ".A.lock" and private.startswith(".A.new-")
    write(target, "new")
    assert content(target) == whole("new")
    assert leftovers(target) == []


def test_a_kill_between_the_two_renames_is_undone_by_the_next_run(tmp_path: Path) -> None:
    """Without an exchange in one step there is an instant without results: they are found again."""
    target = tmp_path / "A"
    write(target, "old")
    prelude = (
        "from kbs_process.results import store\n"
        "store._exchange = lambda one, other: False\n"
        "rename = Path.rename\n"
        "def dying(self, other):\n"
        "    rename(self, other)\n"
        "    os.kill(os.getpid(), signal.SIGKILL)\n"
        "Path.rename = dying"
    )
    code = 'with writing(target) as folder: (folder / "results.json").write_text("new")'
    process = child(code, target, prelude=prelude)
    process.communicate()
    assert process.returncode == -signal.SIGKILL
    assert not target.exists()

    def fail() -> None:
        with writing(target):
            raise ValueError("before anything is written")

    with pytest.raises(ValueError, match="before"):
        fail()
    assert content(target) == whole("old")
    assert leftovers(target) == []


def test_two_at_once(tmp_path: Path) -> None:
    target = tmp_path / "A"
    process = child(HALF_WAY, target)
    try:
        assert process.stdout is not None
        assert process.stdout.readline() == "half-way\n"
        with pytest.raises(OutputError, match=f"process {process.pid} on .* is writing") as caught:
            write(target, "second")
        assert "another folder" in caught.value.remedy
        assert not target.exists()
    finally:
        process.kill()
        process.communicate()
    write(target, "third")
    assert content(target) == whole("third")


def test_a_lock_that_is_removed_and_made_anew_is_never_held_twice(tmp_path: Path) -> None:
    """Each descriptor of a file is locked by itself: threads stand for processes."""
    target, inside, together = tmp_path / "A", [], []

    def again_and_again(name: int) -> None:
        for _ in range(400):
            try:
                with store._locked(target):
                    inside.append(name)
                    together.append(len(inside))
                    time.sleep(0)
                    inside.remove(name)
            except OutputError:
                time.sleep(0)

    threads = [threading.Thread(target=again_and_again, args=(name,)) for name in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert set(together) == {1}
    assert len(together) > 100
    assert leftovers(target) == []


def test_the_lock_of_a_file_that_its_holder_removed_is_asked_for_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One process opens the file, another one ends and removes it, then the first one locks what is gone."""
    target, lock, flock = tmp_path / "A", tmp_path / ".A.lock", store.fcntl.flock
    asked = []

    def late(descriptor: int, operation: int) -> None:
        asked.append(descriptor)
        if len(asked) == 1:
            lock.unlink()
        flock(descriptor, operation)

    monkeypatch.setattr(store.fcntl, "flock", late)
    with store._locked(target):
        assert len(asked) == 2
        assert lock.read_text().startswith(f"process {os.getpid()} on ")
    assert leftovers(target) == []


def test_a_reader_never_sees_half_results(tmp_path: Path) -> None:
    """While results are replaced again and again, every look finds one set, and a whole one."""
    if not sys.platform.startswith("linux"):
        pytest.skip("one step is Linux's")
    target = tmp_path / "A"
    write(target, "0")
    done = threading.Event()
    missing = 0

    def look() -> None:
        nonlocal missing
        while not done.is_set():
            missing += not (target / MARKER).exists()

    reader = threading.Thread(target=look)
    reader.start()
    for index in range(20):
        write(target, str(index))
    done.set()
    reader.join()
    assert missing == 0


FULL = """
try:
    with writing(target) as folder:
        (folder / "results.json").write_text("new")
        (folder / "big").write_bytes(bytes(4_000_000))
except OutputError as error:
    print(error)
"""


def test_a_file_beyond_the_limit_leaves_the_old_results(tmp_path: Path) -> None:
    """The system refuses to let a file grow, as it does on a full disk."""
    target = tmp_path / "A"
    write(target, "old")
    prelude = (
        "signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (1_000_000, 1_000_000))"
    )
    out, err = child(FULL, target, prelude=prelude).communicate()
    assert "the disk is full" in out, err
    assert "on another disk" in out
    assert content(target) == whole("old")
    assert leftovers(target) == []


def test_a_full_disk_leaves_the_old_results(tmp_path: Path) -> None:
    disk = tmp_path / "disk"
    disk.mkdir()
    mounted = shutil.which("mount") and subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=1m", "tmpfs", str(disk)], capture_output=True, check=False
    )
    if not mounted or mounted.returncode:
        pytest.skip("mounting a small disk needs more rights")
    try:
        target = disk / "A"
        write(target, "old")
        out, err = child(FULL, target).communicate()
        assert "the disk is full (No space left on device)" in out, err
        assert content(target) == whole("old")
        assert leftovers(target) == []
    finally:
        subprocess.run(["umount", str(disk)], check=True)


def test_a_folder_that_may_not_be_written() -> None:
    """Checked as a user without rights; root may write everywhere, and pytest's folders are closed to others."""
    with tempfile.TemporaryDirectory() as place:
        Path(place).chmod(0o755)
        reports = Path(place) / "reports"
        write(reports / "A", "old")
        reports.chmod(0o555)
        out, err = child(FULL, reports / "A", prelude="os.geteuid() or os.setuid(65534)").communicate()
        reports.chmod(0o755)
        assert "cannot be written: Permission denied" in out, err
        assert str(reports / "A") in out
        assert "that you may write to" in out
        assert content(reports / "A") == whole("old")


def test_a_read_only_file_system(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(path: Path, *arguments: object) -> int:
        raise OSError(errno.EROFS, os.strerror(errno.EROFS), str(path))

    monkeypatch.setattr(os, "open", refuse)
    with pytest.raises(OutputError, match="Read-only file system"):
        write(tmp_path / "A", "new")


def test_a_full_disk_that_a_writer_reports_in_its_own_words(tmp_path: Path) -> None:
    def write_elaborately() -> None:
        with writing(tmp_path / "A"):
            try:
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            except OSError as error:
                raise OutputError("cannot be written", where="processed.mcap") from error

    with pytest.raises(OutputError, match="the disk is full") as caught:
        write_elaborately()
    assert caught.value.where == str(tmp_path / "A")


def test_a_file_that_cannot_be_read_is_not_blamed_on_the_results(tmp_path: Path) -> None:
    def read_elsewhere() -> None:
        with writing(tmp_path / "reports" / "A"):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), "/elsewhere/recording.mcap")

    with pytest.raises(PermissionError):
        read_elsewhere()


def test_a_folder_with_something_else_is_not_replaced(tmp_path: Path) -> None:
    target = tmp_path / "thesis"
    target.mkdir()
    (target / "chapter1.tex").write_text("years of work")
    with pytest.raises(OutputError, match="kbs-process did not make it"):
        write(target, "new")
    assert (target / "chapter1.tex").read_text() == "years of work"


def test_revising_keeps_what_it_does_not_replace(tmp_path: Path) -> None:
    target = tmp_path / "A"
    with writing(target) as folder:
        (folder / MARKER).write_text("old")
        (folder / "tables").mkdir()
        (folder / "tables" / "a.parquet").write_text("old")
        (folder / "index.html").write_text("old page")
    with revising(target, without=("index.html",)) as folder:
        assert not (folder / "index.html").exists()
        (folder / "index.html").write_text("new page")
        assert (target / "index.html").read_text() == "old page"
    assert content(target) == whole("old") | {"index.html": "new page"}


def test_an_error_while_revising_names_the_folder_that_stays(tmp_path: Path) -> None:
    target = tmp_path / "A"
    write(target, "old")
    with pytest.raises(OutputError) as refused, revising(target) as folder:
        raise OutputError("is damaged", where=str(folder / MARKER))
    assert refused.value.where == str(target / MARKER)


def test_results_are_as_readable_as_any_folder(tmp_path: Path) -> None:
    target, other = tmp_path / "A", tmp_path / "B"
    write(target, "new")
    other.mkdir()
    assert target.stat().st_mode == other.stat().st_mode


def test_a_place_where_no_folder_can_be() -> None:
    with pytest.raises(OutputError, match="cannot be written"):
        write(Path("/proc/no-such-folder"), "new")


def test_files_of_the_user_stay(tmp_path: Path) -> None:
    target, elsewhere = tmp_path / "A", tmp_path / "elsewhere"
    write(target, "old")
    elsewhere.mkdir()
    (elsewhere / "thesis.tex").write_text("years of work")
    (target / "tables" / "notes.txt").write_text("seen by me")
    (target / "linked").symlink_to(elsewhere)
    for text in ("new", "newer"):
        write(target, text)
        assert content(target) == whole(text) | {"tables/notes.txt": "seen by me"}
        assert (target / "linked").readlink() == elsewhere
    with revising(target) as folder:
        (folder / "index.html").write_text("page")
    write(target, "newest")
    assert content(target) == whole("newest") | {"tables/notes.txt": "seen by me"}
    assert (elsewhere / "thesis.tex").read_text() == "years of work"


def test_a_file_that_the_user_changed_is_not_lost(tmp_path: Path) -> None:
    target = tmp_path / "A"
    write(target, "old")
    (target / "tables" / "a.parquet").write_text("corrected by hand")
    for change in (lambda: write(target, "new"), lambda: revising(target).__enter__()):
        with pytest.raises(OutputError, match=r"a\.parquet: was changed since"):
            change()
    assert content(target) == whole("old") | {"tables/a.parquet": "corrected by hand"}


def test_a_file_of_the_user_in_the_place_of_a_result_is_not_lost(tmp_path: Path) -> None:
    target = tmp_path / "A"
    write(target, "old")
    (target / "index.html").write_text("mine")
    with pytest.raises(OutputError, match="stands where a result has to be"), writing(target) as folder:
        (folder / "index.html").write_text("page")
    assert content(target) == whole("old") | {"index.html": "mine"}


def test_a_folder_with_results_of_something_else_is_not_replaced(tmp_path: Path) -> None:
    target = tmp_path / "p"
    (target / "src").mkdir(parents=True)
    (target / MARKER).write_text('{"other": 1}')
    (target / "src" / "a.py").write_text("x")
    with pytest.raises(OutputError, match="kbs-process did not make it"):
        write(target, "new")
    assert content(target) == {MARKER: '{"other": 1}', "src/a.py": "x"}


@pytest.mark.parametrize(
    ("before", "after"), list(itertools.permutations(("campaign.toml", "predicted.mcap", MARKER), 2))
)
def test_only_its_own_kind_is_replaced(tmp_path: Path, before: str, after: str) -> None:
    target = tmp_path / "A"

    def make(kind: str) -> None:
        with writing(target, kind) as folder:
            (folder / kind).write_text(kind)
            (folder / "provenance.json").write_text(kind)

    make(before)
    with pytest.raises(OutputError, match=f"as something else .no {after}.: nothing was changed"):
        make(after)
    assert content(target) == {before: before, "provenance.json": before} and leftovers(target) == []
    make(before)


def test_what_stands_beside_the_results_and_is_the_users_stays(tmp_path: Path) -> None:
    target = tmp_path / "A"
    for name in (".A.old", ".A.new-photos", ".A.new-abcdefgh"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "mine").write_text("mine")
    write(target, "first")
    write(target, "second")
    assert content(target) == whole("second")
    assert leftovers(target) == [".A.new-abcdefgh", ".A.new-photos", ".A.old"]


@pytest.mark.parametrize("kind", ["link", "dangling", "hard link", "file", "folder", "pipe"])
def test_a_lock_that_is_not_one_is_not_touched(tmp_path: Path, kind: str) -> None:
    target, lock, victim = tmp_path / "out" / "A", tmp_path / "out" / ".A.lock", tmp_path / "keys"
    target.parent.mkdir()
    victim.write_text("ssh-ed25519 AAAA")
    makers: dict[str, Callable[[], object]] = {
        "link": lambda: lock.symlink_to(victim),
        "dangling": lambda: lock.symlink_to(tmp_path / "nothing"),
        "hard link": lambda: lock.hardlink_to(victim),
        "file": lambda: lock.write_text("my notes"),
        "folder": lock.mkdir,
        "pipe": lambda: os.mkfifo(lock),
    }
    makers[kind]()
    with pytest.raises(OutputError, match="no lock of kbs-process"):
        write(target, "new")
    assert victim.read_text() == "ssh-ed25519 AAAA"
    assert os.path.lexists(lock) and not target.exists() and not (tmp_path / "nothing").exists()
    assert kind != "file" or lock.read_text() == "my notes"


def test_results_go_where_a_link_leads_and_the_link_stays(tmp_path: Path) -> None:
    disk, target = tmp_path / "disk", tmp_path / "results"
    disk.mkdir()
    target.symlink_to(disk)
    write(target, "first")
    write(target, "second")
    assert target.readlink() == disk
    assert content(disk) == whole("second")


@pytest.mark.parametrize("name", ["n" * 243, "n" * 300, "/".join(["n" * 200] * 30)])
def test_a_name_that_is_too_long(tmp_path: Path, name: str) -> None:
    with pytest.raises(OutputError, match="cannot be written: File name too long"):
        write(tmp_path / name, "new")


def test_the_list_of_results_is_one_that_others_can_check(tmp_path: Path) -> None:
    target = tmp_path / "A"
    write(target, "new")
    told = subprocess.check_output(["sha256sum", "-c", "--strict", store.LIST], cwd=target, text=True)
    assert told == "results.json: OK\ntables/a.parquet: OK\n"


def test_results_of_before_such_lists_are_revised_but_not_replaced(tmp_path: Path) -> None:
    target = tmp_path / "A"
    target.mkdir()
    for name in (MARKER, "index.html", "notes.txt"):
        (target / name).write_text("old")
    with revising(target, without=("index.html",)) as folder:
        (folder / "index.html").write_text("new page")
    assert content(target) == {MARKER: "old", "index.html": "new page", "notes.txt": "old"}
    with pytest.raises(OutputError, match="stands where a result has to be"):
        write(target, "new")
    assert content(target) == {MARKER: "old", "index.html": "new page", "notes.txt": "old"}
