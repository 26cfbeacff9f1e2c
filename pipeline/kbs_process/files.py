"""What may be read as a file: not what could have no end, or keep a reader waiting."""

from __future__ import annotations

import errno
import stat
from pathlib import Path

_OTHERS = {
    stat.S_ISDIR: "it is a folder",
    stat.S_ISFIFO: "it is a pipe: write what comes from it into a file first",
    stat.S_ISSOCK: "it is a socket, not a file",
    stat.S_ISCHR: "it is a device, not a file",
    stat.S_ISBLK: "it is a device, not a file",
}


def regular(path: Path) -> Path:
    """Return the path of a file, or of a link to one.

    Raises OSError, whose `strerror` says what it is instead, or why it cannot be known; FileNotFoundError for nothing.
    """
    mode = path.stat().st_mode
    for is_so, what in _OTHERS.items():
        if is_so(mode):
            raise OSError(errno.EINVAL, what, str(path))
    return path
