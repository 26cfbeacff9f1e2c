"""A cache of machine code that is damaged is made anew."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

KERNEL = """from kbs_process.machine_code import njit


@njit(cache=True)
def double(x):
    return 2.0 * x


@njit("float64(float64)", cache=True)
def treble(x):
    return 3.0 * x


print(double(21.0), treble(14.0), sum(double.stats.cache_hits.values()), sum(treble.stats.cache_hits.values()))
"""


def run(folder: Path) -> list[str]:
    environment = os.environ | {"PYTHONPATH": str(folder)}
    environment.pop("NUMBA_CACHE_DIR", None)
    return subprocess.check_output([sys.executable, "-c", "import kernel"], env=environment, text=True).split()


@pytest.mark.slow
@pytest.mark.parametrize("suffix", ["nbi", "nbc"])
@pytest.mark.parametrize("damage", [b"", b"\0" * 4000, b"\x80\x04halved"], ids=["empty", "zeros", "cut"])
def test_a_damaged_cache_is_made_anew(tmp_path: Path, suffix: str, damage: bytes) -> None:
    (tmp_path / "kernel.py").write_text(KERNEL)
    assert run(tmp_path) == ["42.0", "42.0", "0", "0"]
    assert run(tmp_path) == ["42.0", "42.0", "1", "1"]
    for path in (tmp_path / "__pycache__").glob(f"*.{suffix}"):
        path.write_bytes(damage)
    assert run(tmp_path) == ["42.0", "42.0", "0", "0"]
    assert run(tmp_path) == ["42.0", "42.0", "1", "1"]


@pytest.mark.slow
def test_machine_code_with_one_wrong_bit_is_not_run(tmp_path: Path) -> None:
    """It loads: what it does then is anybody's guess."""
    (tmp_path / "kernel.py").write_text(KERNEL)
    run(tmp_path)
    for path in (tmp_path / "__pycache__").glob("*.nbc"):
        code = bytearray(path.read_bytes())
        code[len(code) // 2] ^= 1
        path.write_bytes(code)
    assert run(tmp_path) == ["42.0", "42.0", "0", "0"]
    assert run(tmp_path) == ["42.0", "42.0", "1", "1"]


@pytest.mark.slow
def test_where_nothing_can_be_kept_it_is_compiled(tmp_path: Path) -> None:
    """As on a full disk: what is in the way here are folders of the files' names."""
    (tmp_path / "kernel.py").write_text(KERNEL)
    run(tmp_path)
    for path in [*(tmp_path / "__pycache__").glob("*.nb?")]:
        path.unlink()
        path.mkdir()
    assert run(tmp_path) == ["42.0", "42.0", "0", "0"]


@pytest.mark.slow
def test_what_others_compile_is_kept_as_numba_keeps_it(tmp_path: Path) -> None:
    """Whoever imports the package may not find a cache later that numba alone cannot load."""
    alone = KERNEL.replace("from kbs_process.machine_code import njit", "from numba import njit")
    (tmp_path / "kernel.py").write_text(alone)
    beside = "import kbs_process.machine_code, kernel"
    environment = os.environ | {"PYTHONPATH": str(tmp_path)}
    environment.pop("NUMBA_CACHE_DIR", None)
    subprocess.check_call([sys.executable, "-c", beside], env=environment)
    assert run(tmp_path) == ["42.0", "42.0", "1", "1"]
