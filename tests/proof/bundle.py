"""A trial's folder as one string of bytes that depends on nothing but its files' names and contents."""

from __future__ import annotations

import io
import os
import tarfile
from pathlib import Path

SEAL, SEAL_DIGEST = "sealed.bin", "sealed.sha256"
TOUCHED = 1_000_000_000  # s, modification time of every file: when it was made says nothing


def pack(folder: Path) -> bytes:
    """Return all files below `folder`, in the order of their names, without owner, time or mode."""
    content = io.BytesIO()
    with tarfile.open(fileobj=content, mode="w", format=tarfile.USTAR_FORMAT) as archive:
        for path in sorted(path for path in folder.rglob("*") if path.is_file()):
            entry = tarfile.TarInfo(path.relative_to(folder).as_posix())
            entry.size, entry.mtime, entry.mode = path.stat().st_size, TOUCHED, 0o644
            with path.open("rb") as file:
                archive.addfile(entry, file)
    return content.getvalue()


def unpack(content: bytes, folder: Path) -> None:
    """Write a trial's files into `folder`, all as old as each other."""
    folder.mkdir(parents=True)
    with tarfile.open(fileobj=io.BytesIO(content)) as archive:
        # Where this Python has the filter: Debian's 3.11.2 does not.
        archive.extraction_filter = getattr(tarfile, "data_filter", lambda member, _: member)
        archive.extractall(folder)
    for path in (*folder.rglob("*"), folder):
        os.utime(path, (TOUCHED, TOUCHED))


def member(content: bytes, name: str) -> bytes:
    """Return one file of a trial."""
    with tarfile.open(fileobj=io.BytesIO(content)) as archive:
        file = archive.extractfile(name)
        if file is None:
            raise KeyError(name)
        return file.read()
