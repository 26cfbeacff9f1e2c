"""An interrupt that foreign code swallows is raised again at the next check."""

from __future__ import annotations

import contextlib
import ctypes
import os
import signal
from pathlib import Path

import llvmlite.binding as llvm
import pytest

from kbs_process import interruption
from kbs_process.progress import SilentProgress
from kbs_process.results.store import RESULTS, writing


def interrupt_that_is_swallowed() -> None:
    with contextlib.suppress(KeyboardInterrupt):
        os.kill(os.getpid(), signal.SIGINT)


def test_progress_raises_it_again() -> None:
    with SilentProgress().task("Simulating") as task, interruption.heeded():
        interruption.check()
        interrupt_that_is_swallowed()
        with pytest.raises(KeyboardInterrupt):
            task.update(0.5)


def test_results_are_not_put_in_place(tmp_path: Path) -> None:
    def run() -> None:
        with writing(tmp_path / "out") as folder:
            (folder / RESULTS).write_text("{}")
            interrupt_that_is_swallowed()

    with interruption.heeded(), pytest.raises(KeyboardInterrupt):
        run()
    assert not (tmp_path / "out").exists()


def test_a_compiler_s_callback_ends() -> None:
    """A compiler whose callback ends early runs what is no machine code."""
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    module = llvm.parse_assembly("define i64 @answer() {\n  ret i64 42\n}")
    machine = llvm.Target.from_default_triple().create_target_machine()
    engine = llvm.create_mcjit_compiler(module, machine)
    asked = []

    def interrupted(*_: object) -> None:
        os.kill(os.getpid(), signal.SIGINT)
        asked.append("object code")

    engine.set_object_cache(notify_func=interrupted, getbuffer_func=interrupted)
    with interruption.heeded():
        engine.finalize_object()
        with pytest.raises(KeyboardInterrupt):
            interruption.check()
    assert asked
    assert ctypes.CFUNCTYPE(ctypes.c_int64)(engine.get_function_address("answer"))() == 42


def test_the_handler_of_before_is_put_back() -> None:
    before = signal.getsignal(signal.SIGINT)
    with interruption.heeded():
        assert signal.getsignal(signal.SIGINT) is not before
    assert signal.getsignal(signal.SIGINT) is before
