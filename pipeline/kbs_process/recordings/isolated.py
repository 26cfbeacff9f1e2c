"""Reading in a child process: a damaged or hostile file may kill, hang or bloat the child, not the command.

Protocol, on the child's standard output: the columns and what is left out, one line of JSON; or, where columns were
asked for, their cells, each array one line of JSON (dtype, count) and its bytes, and in the end what was odd, one line
of JSON (an object). Nothing that is received is executed or unpickled.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import astuple
from importlib.util import find_spec
from pathlib import Path
from threading import Timer
from typing import IO

import numpy as np

from kbs_process.errors import KbsError, RecordingError
from kbs_process.recordings.formats import Format, Text, format_named
from kbs_process.recordings.tables import UNPACKED, Cells, Column, LeftOut

MODULE = "kbs_process.recordings.isolated"
SILENCE_S = 300.0  # a child that sends nothing for so long hangs
CPU_FLOOR_S = 120  # that reading may take, whatever the size
BYTES_A_CPU_S = 1 << 18  # and a second for so many bytes more
DATA_FLOOR = 1 << 30  # bytes that a file of any size may expand to, and `UNPACKED` times its size
MEMORY_FLOOR = 1 << 29  # bytes of private memory; the libraries themselves take less than half of it
SAID = 3  # status of a child that says why
MEMORY_BY_SIZE = 64  # and so many times the file's size


class IsolatedTable:
    """A binary file, read by a child process."""

    def __init__(self, path: Path, name: str, declared: Format) -> None:
        if declared.library and find_spec(declared.library) is None:
            raise KbsError(
                f"reading {name} needs the package '{declared.library}'",
                where=str(path),
                remedy="pip install 'kbs-process[formats]'",
            )
        self.path = path
        self._format = name
        self.odd = Counter[str]()
        with self._child(()) as child, _watched(child) as stream:
            line = stream.readline()
            entries, left_out = json.loads(line) if line.endswith(b"\n") else ((), ())
        self.columns = tuple(Column(*entry) for entry in entries)
        self.left_out: LeftOut = tuple(left_out)
        if not self.columns:
            remedy = "; ".join(self.left_out[:5]) or "export it again, with numbers"
            raise RecordingError("holds no column of numbers", where=str(path), remedy=remedy)

    def chunks(self, names: Sequence[str]) -> Iterator[tuple[Cells, ...]]:
        left = DATA_FLOOR + UNPACKED * self.path.stat().st_size
        with self._child(names) as child:
            while True:
                received = [self._receive(child) for _ in names]
                cells = tuple(one for one in received if one is not None)
                if len(cells) < len(names):
                    return  # the end; if it came too soon, leaving the context raises
                left -= sum(one.nbytes for one in cells)
                if left < 0:
                    raise RecordingError(
                        "declares far more samples than a file of its size can hold",
                        where=str(self.path),
                        remedy="export it again; what it declares was not recorded",
                    )
                yield cells

    def _receive(self, child: subprocess.Popen[bytes]) -> Cells | None:
        """Return the next array, or None where there is no more."""
        with _watched(child) as stream:
            header = stream.readline()
            if not header.endswith(b"\n"):
                return None
            message = json.loads(header)
            if isinstance(message, dict):
                self.odd = Counter(message)
                return None
            kind, count = message
            dtype = np.dtype(kind)
            data = stream.read(count * dtype.itemsize)
        return np.frombuffer(data, dtype) if len(data) == count * dtype.itemsize else None

    @contextmanager
    def _child(self, names: Sequence[str]) -> Iterator[subprocess.Popen[bytes]]:
        """Run a child; raise RecordingError with its last words where it fails."""
        command = [sys.executable, "-P", "-m", MODULE, self._format, str(self.path), json.dumps(list(names))]
        with (
            tempfile.TemporaryFile() as complaints,
            # In one zone everywhere: what is read must not depend on where it is read.
            subprocess.Popen(
                command, stdout=subprocess.PIPE, stderr=complaints, env={**os.environ, "TZ": "UTC"}
            ) as child,
        ):
            try:
                yield child
            except (ValueError, TypeError) as error:  # what comes is not of the protocol
                child.kill()
                raise RecordingError(
                    f"cannot be read as {self._format}: its reader speaks no sense ({error})",
                    where=str(self.path),
                    remedy="check that the file is whole, and its format (format = ... in the mapping)",
                ) from error
            except BaseException:
                child.kill()
                raise
            status = child.wait()
            if status:
                complaints.seek(0)
                words = complaints.read().decode("utf-8", "replace").strip().rpartition("\n")[2]
                raise RecordingError(
                    f"cannot be read as {self._format}: {_cause(status, words)}",
                    where=str(self.path),
                    remedy="check that the file is whole, and its format (format = ... in the mapping)",
                )


def _cause(status: int, words: str) -> str:
    if status < 0:
        return f"its reader was killed by {signal.Signals(-status).name}, as damaged files do"
    return words if status == SAID else f"its reader ended with status {status}, as damaged files make it do"


@contextmanager
def _watched(child: subprocess.Popen[bytes]) -> Iterator[IO[bytes]]:
    """Give the child's output; kill the child where it stays silent."""
    timer = Timer(SILENCE_S, child.kill)
    timer.daemon = True
    timer.start()
    try:
        assert child.stdout is not None
        yield child.stdout
    finally:
        timer.cancel()


def _limit_costs(path: Path) -> None:
    if sys.platform != "win32":
        import resource

        size = path.stat().st_size
        for kind, limit in (
            (resource.RLIMIT_DATA, MEMORY_FLOOR + MEMORY_BY_SIZE * size),
            (resource.RLIMIT_CPU, CPU_FLOOR_S + size // BYTES_A_CPU_S),
        ):
            resource.setrlimit(kind, (limit, resource.getrlimit(kind)[1]))


def main(name: str, path: Path, names: Sequence[str]) -> None:
    """Be the child: send the columns, or, where `names` are given, the cells."""
    # Whatever a library prints must not get between the arrays.
    with os.fdopen(os.dup(1), "wb") as out:
        os.dup2(2, 1)
        _limit_costs(path)
        table = format_named(name).read(path, Text())
        if not names:
            entries = list(map(astuple, table.columns))
            out.write(json.dumps((entries, table.left_out)).encode() + b"\n")
            return
        for cells in table.chunks(names):
            for one in cells:
                plain = np.ascontiguousarray(one)
                if plain.ndim != 1 or plain.dtype.kind not in "iufbMU":
                    raise TypeError(f"cells of {plain.ndim} dimensions, {plain.dtype}")
                out.write(json.dumps([plain.dtype.str, len(plain)]).encode() + b"\n")
                out.write(plain.tobytes())
        out.write(json.dumps(table.odd).encode() + b"\n")


# What Python raises where a library takes for granted what a damaged file has not: its words mean nothing to a user.
_STUMBLES = (ArithmeticError, AssertionError, AttributeError, LookupError, NameError, TypeError)


def _reason(error: Exception) -> str:
    """Why a file cannot be read, in one line, as its library says it where it does, and not Python."""
    if isinstance(error, MemoryError):
        return "it asks for far more memory than a file of its size needs"
    said = error.what if isinstance(error, KbsError) else getattr(error, "strerror", None) or str(error)
    words = "" if isinstance(error, _STUMBLES) else " ".join(said.split())
    return words or "what it holds does not fit together: it is damaged, or of another format"


if __name__ == "__main__":
    try:
        main(sys.argv[1], Path(sys.argv[2]), json.loads(sys.argv[3]))
    except Exception as error:  # noqa: BLE001 - the last one to speak for a library, which may raise anything at all
        sys.stderr.write(f"\n{_reason(error)}\n")
        sys.stderr.flush()
        os._exit(SAID)  # at once: what is left of a library would complain on
