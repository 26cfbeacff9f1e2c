"""The processes of a crew end with the one that they work for, whatever ends that."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

PROGRAM = """
import os
import time

from kbs_process.results.parallel import Crew


def tell(held: float, piece: int) -> None:
    print(os.getpid(), flush=True)
    time.sleep(held)


if __name__ == "__main__":
    with Crew(60.0, 2) as crew:
        list(crew.map(tell, [1, 2]))
"""


def running(pid: int) -> bool:
    """A process that has ended but was not yet waited for runs no more."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] not in "ZX"
    except (FileNotFoundError, ProcessLookupError):
        return False


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="tells who runs by /proc")
@pytest.mark.parametrize("how", [signal.SIGTERM, signal.SIGKILL])
def test_a_crew_ends_with_its_owner(tmp_path: Path, how: signal.Signals) -> None:
    program = tmp_path / "program.py"
    program.write_text(PROGRAM)
    with subprocess.Popen([sys.executable, program], stdout=subprocess.PIPE, text=True) as owner:
        assert owner.stdout is not None
        workers = [int(owner.stdout.readline()) for _ in range(2)]
        try:
            assert len(set(workers)) == 2
            assert all(map(running, workers))
            owner.send_signal(how)
            owner.wait(10.0)
            end = time.monotonic() + 10.0
            while any(map(running, workers)) and time.monotonic() < end:
                time.sleep(0.05)
            assert not any(map(running, workers))
        finally:
            for pid in [owner.pid, *workers]:
                if running(pid):
                    os.kill(pid, signal.SIGKILL)
