"""Names and texts from files cannot command a terminal."""

from __future__ import annotations

import io
import subprocess
import sys
from pathlib import Path

import pytest
from mcap.writer import Writer

from kbs_process.progress import PlainProgress, TerminalProgress
from kbs_process.terminal import printable

HOSTILE = "/a\x1b]0;owned\x07\x1b[2J\x9b31m\u202emoc\u2066\r\x00\x7fb"


def test_what_commands_a_terminal_is_escaped_and_nothing_else() -> None:
    assert printable(HOSTILE) == r"/a\x1b]0;owned\x07\x1b[2J\x9b31m\u202emoc\u2066\r\x00\x7fb"
    words = "τ = 0.02 N·m, Größe → 5 °C, ärger, 力\n  -> next"
    assert printable(words) == words


def test_inspect_shows_the_names_of_topics_and_no_line_of_theirs(tmp_path: Path) -> None:
    recording = tmp_path / "run.mcap"
    with recording.open("wb") as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema(f"type{HOSTILE}", "jsonschema", b"{}")
        topic = f"{HOSTILE}\nfake: clean, all well"
        channel = writer.register_channel(topic=topic, message_encoding="json", schema_id=schema)
        writer.add_message(channel, log_time=0, data=b"{}", publish_time=0)
        writer.finish()
    ran = subprocess.run(
        [sys.executable, "-m", "kbs_process", "inspect", str(recording)], check=False, capture_output=True
    )
    told = (ran.stdout + ran.stderr).decode()
    assert "owned" in told and set(range(32)) & set(told.encode()) == {10}
    assert not any(line.strip().startswith("fake") for line in told.splitlines())


def test_errors_show_names_without_their_commands(tmp_path: Path) -> None:
    ran = subprocess.run(
        [sys.executable, "-m", "kbs_process", "validate", f"{tmp_path}/no\x1b[2Jne"], check=False, capture_output=True
    )
    assert ran.returncode == 2
    assert rb"no\x1b[2Jne" in ran.stderr and b"\x1b" not in ran.stderr


@pytest.mark.parametrize("label", ["run [/foo]", "run [red]", HOSTILE])
def test_a_task_is_named_as_it_is(label: str, monkeypatch: pytest.MonkeyPatch) -> None:
    told = io.StringIO()
    with PlainProgress(told).task(label):
        pass
    assert told.getvalue() == f"{printable(label)}\n"
    shown = io.StringIO()
    monkeypatch.setattr(sys, "stderr", shown)
    with TerminalProgress().task(label):
        pass
    assert printable(label) in shown.getvalue()


def test_a_removed_working_folder_is_told(tmp_path: Path) -> None:
    code = (
        "import os, sys; os.chdir(sys.argv[1]); os.rmdir(sys.argv[1]); from kbs_process.cli import main; "
        "main(['validate', '/tmp'])"
    )
    folder = tmp_path / "gone"
    folder.mkdir()
    ran = subprocess.run([sys.executable, "-c", code, str(folder)], check=False, capture_output=True, text=True)
    assert ran.returncode == 2
    assert "was removed" in ran.stderr
