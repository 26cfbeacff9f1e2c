"""Results on disk: written aside, then put in place in one step, by one process at a time.

Beside the target T lie, while its results are written,
    .T.lock      locked (flock) by the process that writes, which removes it at its end
    .T.new-XXXX  the new results, growing
    .T.old       the old results, where the system cannot exchange two folders in one step
A process that is killed leaves some of them behind; the next one that holds the lock, for which a file that nobody has
locked is none, cleans up.
"""

from __future__ import annotations

import ctypes
import errno
import fcntl
import os
import shutil
import sys
import tempfile
from collections.abc import Collection, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from kbs_process import interruption
from kbs_process.errors import OutputError

RESULTS = "results.json"  # a folder that holds this file is one that may be replaced

_FULL = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}
_REFUSED = {
    errno.EACCES,
    errno.EPERM,
    errno.EROFS,
    errno.EEXIST,
    errno.ENOTDIR,
    errno.ENOENT,
}  # the last three: below a file, or where no folder can be


@contextmanager
def writing(target: Path, *, marker: str = RESULTS) -> Iterator[Path]:
    """Yield an empty private folder that replaces `target`, whole, when the block ends well.

    Until then, and whenever the block fails or the process dies, `target` stays as it was. A folder that is
    not empty is replaced only if it holds `marker`, which every set of results has to contain.

    Raises OutputError if the place cannot be written, is full, holds something else, or is being written.
    """
    target = target.absolute()
    with _explaining(target), _locked(target):
        _recover(target)
        _refuse_foreign(target, marker)
        private = _private_folder(target)
        try:
            yield private
            if not (private / marker).is_file():
                raise RuntimeError(f"results without {marker}")
            _flush(private)
            interruption.check()
            _put_in_place(private, target)
        finally:
            shutil.rmtree(private, ignore_errors=True)


@contextmanager
def revising(target: Path, *, without: Collection[str] = (), marker: str = RESULTS) -> Iterator[Path]:
    """Yield a private folder with the files of `target`, save those `without`, that replaces it like `writing`.

    The files are links to the old ones: the block may add files, and must not write into those it finds.
    """
    if not (target / marker).is_file():
        raise OutputError(f"holds no results (no {marker})", where=str(target), remedy="process the campaign first")
    with writing(target, marker=marker) as private:
        link_tree(target, private, without=without)
        yield private


def link_tree(source: Path, target: Path, *, without: Collection[str] = ()) -> None:
    """Let `target` have the files of `source`, save entries `without`: links, where the file system can."""
    shutil.copytree(
        source,
        target,
        copy_function=_link,
        dirs_exist_ok=True,
        ignore=lambda folder, names: [name for name in names if name in without and Path(folder) == source],
    )


def _link(source: str, target: str) -> None:
    """Link a file where the file system can, copy it elsewhere."""
    try:
        os.link(source, target)
    except OSError:
        shutil.copy2(source, target)


@contextmanager
def _locked(target: Path) -> Iterator[None]:
    """Hold the lock of `target`, or say who does."""
    target.parent.mkdir(parents=True, exist_ok=True)
    lock = _beside(target, "lock")
    while (descriptor := _lock(lock, target)) is None:
        pass
    try:
        os.write(descriptor, f"process {os.getpid()} on {os.uname().nodename}".encode())
        yield
    finally:
        # While it is locked: who has opened it already finds, once it is his, that it is no longer there (`_lock`).
        with suppress(OSError):
            if _is_at(descriptor, lock):
                lock.unlink()
        os.close(descriptor)


def _lock(path: Path, target: Path) -> int | None:
    """Return a descriptor of the file, locked and empty; None where its holder has removed it meanwhile."""
    descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        if _is_at(descriptor, path):
            os.ftruncate(descriptor, 0)
            return descriptor
    except BlockingIOError as error:
        holder = os.read(descriptor, 200).decode(errors="replace").strip() or "another process"
        os.close(descriptor)
        raise OutputError(
            f"{holder} is writing results there",
            where=str(target),
            remedy="wait until it is done, or name another folder with --output",
        ) from error
    except BaseException:
        os.close(descriptor)
        raise
    os.close(descriptor)
    return None


def _is_at(descriptor: int, path: Path) -> bool:
    """Whether a file that is open is still the one at `path`."""
    try:
        return os.path.samestat(os.fstat(descriptor), path.stat())
    except FileNotFoundError:
        return False


def _beside(target: Path, suffix: str) -> Path:
    return target.with_name(f".{target.name}.{suffix}")


def _recover(target: Path) -> None:
    """Undo or finish what a process that died has left; only for the holder of the lock."""
    old = _beside(target, "old")
    if old.is_dir() and not target.exists():
        old.rename(target)
    private = _beside(target, "new-").name
    for path in target.parent.iterdir():
        if path == old or path.name.startswith(private):
            shutil.rmtree(path, ignore_errors=True)


def _refuse_foreign(target: Path, marker: str) -> None:
    if not target.exists() or (target / marker).is_file():
        return
    if not target.is_dir() or any(target.iterdir()):
        raise OutputError(
            f"is there already, and holds no results (no {marker})",
            where=str(target),
            remedy="name a new or an empty folder with --output",
        )


def _private_folder(target: Path) -> Path:
    private = Path(tempfile.mkdtemp(prefix=f".{target.name}.new-", dir=target.parent))
    # mkdtemp is for secrets; results are as readable as any folder made here.
    umask = os.umask(0)
    os.umask(umask)
    private.chmod(0o777 & ~umask)
    return private


def _flush(folder: Path) -> None:
    """Make the system write every file to the disk, and the folders that name them."""
    for root, _, files in os.walk(folder):
        for path in (*(Path(root) / name for name in files), Path(root)):
            _fsync(path)


def _fsync(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _put_in_place(private: Path, target: Path) -> None:
    """Let `private` become `target`; the old results, if any, end up in `private` or are gone."""
    if not target.exists():
        private.rename(target)
    elif not _exchange(private, target):
        # Two steps: a death between them leaves the old results in .T.old, where _recover finds them.
        old = _beside(target, "old")
        target.rename(old)
        private.rename(target)
        shutil.rmtree(old)
    _fsync(target.parent)


def _exchange(one: Path, other: Path) -> bool:
    """Exchange two folders in one step; False where the system or the file system cannot."""
    if not sys.platform.startswith("linux"):
        return False
    renameat2 = getattr(ctypes.CDLL(None, use_errno=True), "renameat2", None)
    if renameat2 is None:
        return False
    at_working_directory, rename_exchange = -100, 2
    paths = (os.fsencode(one), os.fsencode(other))
    if renameat2(at_working_directory, paths[0], at_working_directory, paths[1], rename_exchange) == 0:
        return True
    code = ctypes.get_errno()
    if code in (errno.EINVAL, errno.ENOSYS, errno.ENOTSUP):
        return False
    raise OSError(code, os.strerror(code), str(other))


@contextmanager
def _explaining(target: Path) -> Iterator[None]:
    """Turn errors of the system into what a user can act upon: a place that is full, or refuses to be written."""
    try:
        yield
    except (OSError, OutputError) as error:
        cause = error.__cause__ if isinstance(error, OutputError) else error
        if not isinstance(cause, OSError) or cause.errno is None:
            raise
        reason = os.strerror(cause.errno)
        if cause.errno in _FULL:
            raise OutputError(
                f"the disk is full ({reason}); the results of before are whole",
                where=str(target),
                remedy="make room, or name a folder on another disk with --output",
            ) from error
        if cause.errno in _REFUSED and _concerns(cause, target):
            raise OutputError(
                f"cannot be written: {reason}",
                where=str(target),
                remedy="name a folder that you may write to with --output",
            ) from error
        raise


def _concerns(error: OSError, target: Path) -> bool:
    """Say whether an error is about the place of the results, and not about a file that was being read."""
    name = error.filename
    return name is None or Path(os.fsdecode(name)).absolute().is_relative_to(target.parent)
