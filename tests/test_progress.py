"""Progress says what is done, in a log and on a terminal."""

from __future__ import annotations

import io
import re

import pytest

from kbs_process.progress import PlainProgress, Progress, SilentProgress, TerminalProgress


def work(progress: Progress) -> None:
    with progress.task("Fitting gravity") as outer:
        outer.update(0.5)
        with progress.task("AZPS_ATA") as inner:
            inner.update(1.0)


def test_a_log_gets_one_line_a_task() -> None:
    stream = io.StringIO()
    work(PlainProgress(stream))
    assert stream.getvalue() == "Fitting gravity\nAZPS_ATA\n"


def test_a_terminal_keeps_one_line_for_each_outer_task(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("TERM", "dumb")
    progress = TerminalProgress()
    work(progress)
    work(progress)
    captured = capsys.readouterr()
    assert captured.out == ""
    assert len(re.findall(r"Fitting gravity  \d+\.\d s", captured.err)) == 2


@pytest.mark.parametrize("kind", [SilentProgress, PlainProgress, TerminalProgress])
def test_an_error_goes_through(kind: type[SilentProgress]) -> None:
    progress = kind()

    def fail() -> None:
        with progress.task("Reading"):
            raise ValueError("fault")

    with pytest.raises(ValueError, match="fault"):
        fail()
    work(progress)
