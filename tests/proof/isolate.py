"""Runs a method on a trial where it can see the trial, and nothing that says what is concealed in it.

The method gets a process and a scratch folder of its own, with a copy of the trial under its meaningless name, and an
environment of eight variables. Where the system allows it (Linux with user namespaces and util-linux), the folders
in `hidden` are empty to it, so are the network and all processes but its own, and no privilege is left to undo
that. `level` says which of the two it is; results state it.
"""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import cache
from pathlib import Path

CHECKOUT = Path(__file__).resolve().parents[2]
# A bench that is killed takes its methods along: they would answer on for half an hour, and hear of no signal but that.
_UNSHARE = (
    "setpriv", "--pdeathsig", "KILL",
    "unshare", "--user", "--map-root-user", "--mount", "--net", "--ipc", "--pid", "--fork", "--kill-child",
    "--mount-proc",
)  # fmt: skip
# Covers each folder named before "--" with an empty one, gives up all capabilities, and becomes what follows.
_COVER = (
    'while [ "$1" != "--" ]; do mount -t tmpfs -o ro,size=4k none "$1" || exit 97; shift; done; shift; '
    'exec setpriv --bounding-set=-all --inh-caps=-all --no-new-privs "$@"'
)


@cache
def level() -> str:
    """What separates a method from the key here: "namespace", or "process" alone."""
    if not sys.platform.startswith("linux") or not (shutil.which("unshare") and shutil.which("setpriv")):
        return "process"
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "secret").touch()
        probe = [*_covered([Path(folder)]), "ls", folder]
        done = subprocess.run(probe, capture_output=True, text=True, check=False)
    return "namespace" if done.returncode == 0 and not done.stdout.strip() else "process"


def run(
    command: Sequence[str], scratch: Path, *, hidden: Sequence[Path], timeout_s: float, path: Sequence[Path] = ()
) -> subprocess.CompletedProcess[str]:
    """Run `command` in `scratch`; `path` is where it may import from beside installed packages.

    Raises subprocess.TimeoutExpired; the process and all that it started are gone then.
    """
    covered = _covered([folder for folder in hidden if folder.is_dir()]) if level() == "namespace" else []
    with subprocess.Popen(
        [*covered, *command],
        cwd=scratch,
        env=environment(scratch, path),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as process:
        try:
            out, error = process.communicate(timeout=timeout_s)
        except BaseException:
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            raise
    return subprocess.CompletedProcess(process.args, process.returncode, out, error)


def environment(scratch: Path, path: Sequence[Path] = ()) -> Mapping[str, str]:
    """All that a method's process is told."""
    (scratch / "tmp").mkdir(exist_ok=True)
    return {
        "PATH": os.environ.get("PATH", os.defpath),
        "LANG": "C.UTF-8",
        "HOME": str(scratch),
        "TMPDIR": str(scratch / "tmp"),
        "OPENBLAS_NUM_THREADS": "1",
        "OMP_NUM_THREADS": "1",
        "KBS_CACHE": str(_compiled_code()),
        "KBS_CACHE_MB": "0",  # what one method has computed is none of another's business
        "PYTHONPATH": os.pathsep.join(str(folder) for folder in path),
    }


def _covered(hidden: Sequence[Path]) -> list[str]:
    return [*_UNSHARE, "sh", "-c", _COVER, "sh", *(str(folder) for folder in hidden), "--"]


def _compiled_code() -> Path:
    """Where plants are kept once compiled: half a minute of each trial without it."""
    from kbs_process.cache import cache_folder

    return cache_folder()
