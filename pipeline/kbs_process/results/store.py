"""Results on disk: written aside, then put in place in one step, by one process at a time; nothing else is touched.

Beside the target T lie, while its results are written,
    .T.lock      locked (flock) by the process that writes, which removes it at its end
    .T.new-XXXX  the new results, growing
    .T.old       the old results, where the system cannot exchange two folders in one step
A process that is killed leaves some of them behind; the next one that holds the lock, for which a file that nobody has
locked is none, cleans up.

In every folder of results lies a list of the files that were written, each with its SHA-256 (`sha256sum -c` reads it).
What it does not prove to be of this program is the user's: it is kept, or nothing is written. A folder is replaced by
its own kind only, results by results, told by one file that each of a kind has. No link is followed, save that T itself
may be one: then all of this happens where it leads.
"""

from __future__ import annotations

import ctypes
import errno
import fcntl
import hashlib
import os
import re
import secrets
import shutil
import stat
import sys
from collections.abc import Collection, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from kbs_process import interruption
from kbs_process.errors import KbsError, OutputError

RESULTS = "results.json"  # a folder that holds this file holds results
LIST = ".kbs-process.sha256"  # the list of what was written, in a folder of results

_HOLDER = re.compile(rb"(process \d+ on [^\n]*)?")  # what a lock may say
_FULL = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}
_REFUSED = {
    errno.EACCES,
    errno.EPERM,
    errno.EROFS,
    errno.ENAMETOOLONG,
    errno.ELOOP,
    errno.EEXIST,
    errno.ENOTDIR,
    errno.ENOENT,
}  # the last three: below a file, or where no folder can be


@contextmanager
def writing(target: Path, made: str = RESULTS) -> Iterator[Path]:
    """Yield an empty private folder that replaces `target`, whole, when the block ends well.

    `made` is a file that every folder of its kind has: none of another kind is replaced. Until then, and whenever the
    block fails or the process dies, `target` stays as it was. Files in it that this program did not write move into the
    new folder.

    Raises OutputError if the place cannot be written, is full, holds something else, or is being written; or if a file
    was changed since it was written here.
    """
    with _replacing(target, made) as private:
        yield private


@contextmanager
def revising(target: Path, *, without: Collection[str] = ()) -> Iterator[Path]:
    """Yield a private folder with the files of `target`, save those `without`, that replaces it like `writing`.

    The files are links to the old ones: the block may add files, and must not write into those it finds.
    """
    if not (target / RESULTS).is_file():
        raise OutputError(f"holds no results (no {RESULTS})", where=str(target), remedy="process the campaign first")
    with _replacing(target, RESULTS, revised=without) as private:
        link_tree(target, private, without={*without, LIST})
        yield private


@contextmanager
def _replacing(target: Path, made: str, *, revised: Collection[str] | None = None) -> Iterator[Path]:
    """Yield the private folder of `target`, which, where it is `revised`, may be of before such lists.

    Then those entries of it are taken for this program's.
    """
    with _explaining(target):
        target = Path(os.path.realpath(target))
        with _locked(target):
            _recover(target)
            users = _files_of_the_user(target, made, revised=revised)
            # Named before it is made: an interrupt while it is being made leaves nothing either.
            private = target.parent / f".{target.name}.new-{secrets.token_hex(4)}"
            try:
                private.mkdir()
                (private / LIST).touch()
                yield private
                for name in users:
                    _keep(target / name, private / name)
                _list_files(private, save=users)
                _flush(private)
                interruption.check()
                _put_in_place(private, target)
            except KbsError as error:
                error.where = error.where.replace(str(private), str(target))  # which stays
                raise
            finally:
                shutil.rmtree(private, ignore_errors=True)


def link_tree(source: Path, target: Path, *, without: Collection[str] = ()) -> None:
    """Let `target` have the files of `source`, save entries `without`: links, where the file system can."""
    shutil.copytree(
        source,
        target,
        symlinks=True,
        copy_function=_link,
        dirs_exist_ok=True,
        ignore=lambda folder, names: [name for name in names if name in without and Path(folder) == source],
    )


def _link(source: str, target: str) -> None:
    """Link a file where the file system can, copy it elsewhere."""
    try:
        os.link(source, target, follow_symlinks=False)
    except OSError:
        shutil.copy2(source, target, follow_symlinks=False)


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
    foreign = OutputError(
        "is no lock of kbs-process, and stands where that has to be",
        where=str(path),
        remedy="move it, or name another folder (of results: --output)",
    )
    try:
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW | os.O_NONBLOCK, 0o644)
    except OSError as error:
        if error.errno in (errno.ELOOP, errno.EISDIR, errno.ENXIO) and os.path.lexists(path):
            raise foreign from None
        raise
    try:
        status = os.fstat(descriptor)
        if not stat.S_ISREG(status.st_mode) or status.st_nlink > 1:
            raise foreign
        said = os.read(descriptor, 300)
        if not _HOLDER.fullmatch(said):
            raise foreign
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        if _is_at(descriptor, path):
            os.ftruncate(descriptor, 0)
            os.lseek(descriptor, 0, os.SEEK_SET)
            return descriptor
    except BlockingIOError as error:
        os.close(descriptor)
        raise OutputError(
            f"{said.decode(errors='replace') or 'another process'} is writing results there",
            where=str(target),
            remedy="wait until it is done, or name another folder (of results: --output)",
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
    if _is_ours(old) and not target.exists():
        old.rename(target)
    made = re.compile(re.escape(_beside(target, "new-").name) + r"\w{8}")
    for path in target.parent.iterdir():
        if (path == old or made.fullmatch(path.name)) and _is_ours(path):
            shutil.rmtree(path, ignore_errors=True)


def _is_ours(folder: Path) -> bool:
    """Whether this program made a folder."""
    return folder.is_dir() and not folder.is_symlink() and (folder / LIST).is_file()


def check_unchanged(folder: Path, name: str = RESULTS) -> None:
    """Raise OutputError if a file of a results folder is not what this program wrote."""
    written = {name: digest for digest, name in _listed(folder)}
    if name in written and (folder / name).is_file() and _digest(folder / name) != written[name]:
        raise OutputError(
            "was changed since kbs-process wrote it", where=str(folder / name), remedy="process the campaign again"
        )


def _files_of_the_user(target: Path, made: str, *, revised: Collection[str] | None) -> list[str]:
    """Return the files in the folder that this program did not write; refuse one that it cannot replace."""
    if not target.exists():
        return []
    written = {name: digest for digest, name in _listed(target)}
    theirs = not target.is_dir() or (any(target.iterdir()) and not _is_ours(target) and revised is None)
    if theirs or (written and made not in {*written, *files_in(target)}):
        raise OutputError(
            f"is there already, and kbs-process did not make it, or as something else (no {made}): nothing was changed",
            where=str(target),
            remedy="name a new or an empty folder",
        )
    users = []
    for name in files_in(target):
        if name not in written:
            if written or name.partition("/")[0] not in (revised or ()):
                users.append(name)
        elif _digest(target / name) != written[name]:
            raise OutputError(
                "was changed since kbs-process wrote it, and would be lost",
                where=str(target / name),
                remedy="move it out of the folder, or name another folder (of results: --output)",
            )
    return users


def files_in(folder: Path) -> list[str]:
    """Return the names of all files and links below a folder, save the list of them, in order."""
    names = []
    for root, folders, files in os.walk(folder):
        links = [name for name in folders if (Path(root) / name).is_symlink()]
        names += [(Path(root) / name).relative_to(folder).as_posix() for name in (*files, *links)]
    return sorted(name for name in names if name != LIST)


def _digest(path: Path) -> str:
    """Return the SHA-256 of a file; of a link, of where it leads."""
    if path.is_symlink():
        return hashlib.sha256(os.fsencode(path.readlink())).hexdigest()
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _list_files(folder: Path, *, save: Collection[str]) -> None:
    """Write the list of a folder's files, `save` those of the user, as `sha256sum` does."""
    names = [name for name in files_in(folder) if name not in set(save)]
    (folder / LIST).write_text("".join(f"{_digest(folder / name)}  {name}\n" for name in names), encoding="utf-8")


def _listed(folder: Path) -> list[tuple[str, str]]:
    """Return digest and name of each file in a folder's list."""
    try:
        lines = (folder / LIST).read_text(encoding="utf-8", errors="replace").splitlines()
    except (FileNotFoundError, NotADirectoryError):
        return []
    return [(digest, name) for digest, _, name in (line.partition("  ") for line in lines)]


def _keep(source: Path, target: Path) -> None:
    """Let a file of the user be in the new results, too."""
    if os.path.lexists(target):
        if _digest(source) == _digest(target):
            return
        raise OutputError(
            "is not of kbs-process, and stands where a result has to be",
            where=str(source),
            remedy="move it, or name another folder (of results: --output)",
        )
    target.parent.mkdir(parents=True, exist_ok=True)
    _link(str(source), str(target))


def _flush(folder: Path) -> None:
    """Make the system write every file to the disk, and the folders that name them."""
    for root, _, files in os.walk(folder):
        for path in (*(Path(root) / name for name in files), Path(root)):
            if not path.is_symlink():
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
                remedy="make room, or name a folder on another disk (of results: --output)",
            ) from error
        if cause.errno in _REFUSED and _concerns(cause, target):
            raise OutputError(
                f"cannot be written: {reason}",
                where=str(target),
                remedy="name a folder that you may write to (of results: --output)",
            ) from error
        raise


def _concerns(error: OSError, target: Path) -> bool:
    """Say whether an error is about the place of the results, and not about a file that was being read."""
    name = error.filename
    return name is None or Path(os.fsdecode(name)).absolute().is_relative_to(target.parent)
