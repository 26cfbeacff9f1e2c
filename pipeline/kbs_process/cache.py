"""The user's cache folder: what may be lost at any time, is checked when it is read, and stays below a limit.

A file of it is named by its key, and begins with the SHA-256 of all that follows. What is damaged, cut off, another
user's, of another key or no file at all is as if it were not there. What was not used for longest goes first.
"""

from __future__ import annotations

import hashlib
import os
import secrets
import stat
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from kbs_process.errors import ConfigError

LIMIT = "KBS_CACHE_MB"
USUAL_MB = 2000
_HEAD = 32 + 64  # digest, and the key


def cache_folder() -> Path:
    """Return the folder: $KBS_CACHE, or the platform's own for caches."""
    if chosen := os.environ.get("KBS_CACHE"):
        return Path(chosen)
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA", Path.home() / "AppData" / "Local")) / "kbs-process" / "Cache"
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches" / "kbs-process"
    return Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "kbs-process"


def limit() -> int:
    """Return how many bytes may be kept; zero keeps nothing, and reads nothing that was."""
    text = os.environ.get(LIMIT) or str(USUAL_MB)
    if not (text.isascii() and text.isdigit() and len(text) < 10):
        raise ConfigError(
            f"'{text}' is no size in MB", where=LIMIT, remedy=f"give a whole number, 0 to keep nothing: {LIMIT}=2000"
        )
    return int(text) * 10**6


def find(key: str) -> memoryview | None:
    """Return what was kept under a key, None where that is not there as it was kept."""
    with suppress(OSError, MemoryError):
        descriptor = os.open(_place(key), os.O_RDONLY | os.O_CLOEXEC | os.O_NOFOLLOW | os.O_NONBLOCK)
        with os.fdopen(descriptor, "rb", buffering=0) as file:
            status = os.fstat(descriptor)
            if not stat.S_ISREG(status.st_mode) or status.st_uid != os.geteuid():
                return None
            content = memoryview(bytearray(status.st_size))
            whole = file.readinto(content) == len(content) >= _HEAD
            if whole and content[:_HEAD] == hashlib.sha256(content[32:]).digest() + key.encode():
                os.utime(descriptor)  # it was used
                return content[_HEAD:]
    return None


def keep(key: str, parts: Sequence[memoryview]) -> None:
    """Keep `parts` under a key, if there is room; make it, at the cost of what was not used for longest."""
    most = limit()
    if sum(len(part) for part in parts) > most:
        return
    with suppress(OSError), _aside(_place(key)) as aside:
        whole = hashlib.sha256(key.encode())
        with aside.open("xb") as file:
            file.write(bytes(32) + key.encode())
            for part in parts:
                whole.update(part)
                file.write(part)
            file.seek(0)
            file.write(whole.digest())
        aside.replace(_place(key))
        _drop_oldest(most)


def _place(key: str) -> Path:
    return cache_folder() / "stages" / key


@contextmanager
def _aside(path: Path) -> Iterator[Path]:
    """Yield the name of a file beside another one, which is gone in the end."""
    path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
    aside = path.with_name(f"{path.name}.{secrets.token_hex(4)}")
    try:
        yield aside
    finally:
        aside.unlink(missing_ok=True)


def _drop_oldest(most: int) -> None:
    """Remove files, those first that were not used for longest, until the rest is small enough."""
    known = []
    for path in (cache_folder() / "stages").iterdir():
        with suppress(OSError):
            status = path.lstat()
            known.append((status.st_mtime_ns, status.st_size, path))
    total = 0
    for _, size, path in sorted(known, reverse=True):
        total += size
        if total > most:
            with suppress(OSError):
                path.unlink()
