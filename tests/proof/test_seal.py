"""Seals open with the right key, for the right trial, and a method can read neither key nor truth."""

from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path

import pytest

from proof import isolate, seal
from proof.bundle import SEAL, SEAL_DIGEST, TOUCHED, member, pack, unpack
from proof.trials import add_seal, break_seal
from proof.truth import Concealed, Truth

KEY = seal.new_key()
NOTHING = Truth(trial="T1", kind="nothing", split="development")
EFFECT = Concealed(port="motor torque", axis="el", family="cogging", name="law", rho=310.0, rho_eff=300.0)
SOMETHING = Truth(trial="T1", kind="concealed", split="development", level=300.0, effects=(EFFECT,) * 3, rho_eff=300.0)


def test_a_seal_opens_with_its_key_for_its_trial_and_as_it_was_made() -> None:
    sealed = seal.seal(b"what is true", seal.public(KEY), "T1")
    assert seal.unseal(sealed, KEY, "T1") == b"what is true"
    altered = bytearray(sealed)
    altered[1000] ^= 1
    wrong = [(sealed, seal.new_key(), "T1"), (sealed, KEY, "T2"), (bytes(altered), KEY, "T1"), (b"", KEY, "T1")]
    for broken, key, trial in wrong:
        with pytest.raises(seal.SealError):
            seal.unseal(broken, key, trial)


def test_seals_are_of_one_size_differ_each_time_and_do_not_compress(tmp_path: Path) -> None:
    sealed = []
    for told in (NOTHING, NOTHING, SOMETHING):
        add_seal(tmp_path, told, seal.public(KEY))
        sealed.append((tmp_path / SEAL).read_bytes())
    assert len({len(content) for content in sealed}) == 1 and sealed[0] != sealed[1]
    assert b"cogging" not in sealed[2]
    with pytest.raises(seal.SealError, match="do not fit"):
        seal.seal(bytes(seal.SIZE), seal.public(KEY), "T1")


def test_a_seal_that_was_exchanged_is_noticed(tmp_path: Path) -> None:
    add_seal(tmp_path, NOTHING, seal.public(KEY))
    stated = (tmp_path / SEAL_DIGEST).read_text()
    assert break_seal((tmp_path / SEAL).read_bytes(), stated, KEY, "T1") == NOTHING
    add_seal(tmp_path, SOMETHING, seal.public(KEY))
    with pytest.raises(seal.SealError, match="not the one that its folder states"):
        break_seal((tmp_path / SEAL).read_bytes(), stated, KEY, "T1")


def test_a_packed_trial_depends_on_names_and_contents_alone(tmp_path: Path) -> None:
    for name, order in (("one", "ab"), ("two", "ba")):
        (tmp_path / name / "sub").mkdir(parents=True)
        for letter in order:
            (tmp_path / name / "sub" / letter).write_text(letter)
    packed = pack(tmp_path / "one")
    assert packed == pack(tmp_path / "two") and member(packed, "sub/a") == b"a"
    unpack(packed, tmp_path / "three")
    times = {path.stat().st_mtime for path in (tmp_path / "three").rglob("*")}
    assert times == {float(TOUCHED)} and pack(tmp_path / "three") == packed


def _look(scratch: Path, hidden: Path, code: str) -> subprocess.CompletedProcess[str]:
    return isolate.run([sys.executable, "-c", code], scratch, hidden=(hidden,), timeout_s=60.0)


def test_a_method_is_told_nothing_by_its_environment(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("BENCH_KEY", KEY.hex())
    done = _look(tmp_path, tmp_path, "import os; print(sorted(os.environ)); print(open('/dev/stdin').read())")
    assert done.returncode == 0, done.stderr
    of_the_shell = {"PWD", "OLDPWD", "SHLVL", "_", "LC_CTYPE"}
    assert set(eval(done.stdout.splitlines()[0])) - of_the_shell == set(isolate.environment(tmp_path))


@pytest.mark.skipif(isolate.level() != "namespace", reason="there are no user namespaces here")
def test_a_method_sees_neither_key_nor_other_processes_nor_the_network(tmp_path: Path) -> None:
    work, scratch = tmp_path / "work", tmp_path / "scratch"
    for folder in (work, scratch):
        folder.mkdir()
    (work / "key").write_bytes(KEY)
    code = f"""
import ctypes, os, socket
print(os.listdir({str(work)!r}))
print(sum(name.isdigit() for name in os.listdir('/proc')))
print([name for _, name in socket.if_nameindex() if name != 'lo'])
print(ctypes.CDLL(None).umount({str(work)!r}.encode()))
print(os.path.exists({str(work / "key")!r}))
"""
    lines = _look(scratch, work, code).stdout.splitlines()
    assert lines[0] == "[]"
    assert int(lines[1]) == 1  # itself
    assert not {"eth0", "ens3", "wlan0"} & set(eval(lines[2]))
    assert lines[3] == "-1" and lines[4] == "False"


def test_a_method_that_does_not_end_is_ended(tmp_path: Path) -> None:
    with pytest.raises(subprocess.TimeoutExpired):
        isolate.run([sys.executable, "-c", "import time; time.sleep(60)"], tmp_path, hidden=(), timeout_s=0.5)


@pytest.mark.skipif(isolate.level() != "namespace", reason="there are no user namespaces here")
def test_a_method_ends_with_the_bench_that_is_killed(tmp_path: Path) -> None:
    beat = "import time\nwhile True: open('beat', 'a').write('.'); time.sleep(0.02)"
    bench = f"""
from pathlib import Path
from proof import isolate
isolate.run([{sys.executable!r}, "-c", {beat!r}], Path({str(tmp_path)!r}), hidden=(), timeout_s=60.0)
"""
    beats = tmp_path / "beat"
    with subprocess.Popen([sys.executable, "-c", bench], cwd=Path(__file__).parents[1]) as process:
        while not beats.exists():
            assert process.poll() is None
            time.sleep(0.02)
        process.kill()
    time.sleep(0.3)
    last = beats.stat().st_size
    time.sleep(0.3)
    assert beats.stat().st_size == last
