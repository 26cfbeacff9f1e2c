"""Names and texts from files cannot command a terminal."""

from __future__ import annotations

import io
import subprocess
import sys
import tomllib
from pathlib import Path

import h5py
import pytest
from mcap.writer import Writer

from kbs_process.campaign.problems import Problems
from kbs_process.errors import ConfigError, RecordingError
from kbs_process.progress import PlainProgress, TerminalProgress
from kbs_process.recordings.mcap.source import open_recording
from kbs_process.recordings.mcap.streams import Stream
from kbs_process.studies.convert.begin import begin
from kbs_process.studies.convert.describe import describe
from kbs_process.terminal import printable

HOSTILE = "/a\x1b]0;owned\x07\x1b[2J\x9b31m\u202emoc\u2066\r\x00\x7fb"


def test_what_commands_a_terminal_is_escaped_and_nothing_else() -> None:
    assert printable(HOSTILE) == r"/a\x1b]0;owned\x07\x1b[2J\x9b31m\u202emoc\u2066\r\x00\x7fb"
    words = "τ = 0.02 N·m, Größe → 5 °C, ärger, 力"
    assert printable(words) == words
    assert printable("a\nfake: clean\u2028b\udc80") == r"a\nfake: clean\u2028b\udc80"


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
    with pytest.raises(RecordingError) as raised:
        list(open_recording(recording).read([Stream("a", "/none", ("x",))]))
    assert len(str(raised.value).splitlines()) == 2 and "\x1b" not in str(raised.value)


def test_names_in_an_error_make_no_line_of_it_and_several_errors_have_theirs() -> None:
    problems = Problems("campaigns/a\nfake: clean")
    for name in ("one", f"two{HOSTILE}\nfake: clean"):
        problems.add(f"{name}.toml:1", f"'{name}' is bad", f"give another than '{name}'")
    with pytest.raises(ConfigError) as raised:
        problems.raise_any()
    lines = str(raised.value).split("\n")
    assert lines[0] == r"campaigns/a\nfake: clean: 2 things are wrong"
    assert lines[1:3] == ["one.toml:1: 'one' is bad", "  -> give another than 'one'"]
    assert len(lines) == 5 and all(line.isprintable() for line in lines)


@pytest.mark.parametrize("verb", [["inspect"], ["import", "--describe"], ["import", "emps", "{}", "a"], ["process"]])
def test_no_name_of_a_file_makes_a_line(verb: list[str], tmp_path: Path) -> None:
    name = f"{tmp_path}/no\x1b[2Jne\nfake: clean"
    words = [word.format(name) for word in verb]
    ran = subprocess.run(
        [sys.executable, "-m", "kbs_process", *words, *([name] if words == verb else [])],
        check=False,
        capture_output=True,
        text=True,
    )
    assert ran.returncode == 2
    assert r"no\x1b[2Jne\nfake: clean" in ran.stderr
    assert not any(line.startswith("fake") for line in ran.stderr.splitlines())


def test_what_is_begun_is_a_mapping_whatever_names_are(tmp_path: Path) -> None:
    names = ["time\x7f\u2028", "\x1b]0;owned\x07\u202e\r\nfake = 1", 'quo"te\\ angle', "N\n[wrench]", "fx"]
    source = tmp_path / "a\x1b[2J\n[fake].h5"
    with h5py.File(source, "w") as file:
        for name in names:
            file.create_dataset(name, data=[1.0, 2.0, 4.0]).attrs["unit"] = "N" if name == "fx" else "N\nfake = 2"
    assert all(line.isprintable() for line in describe(source).splitlines())
    list(begin(tmp_path / "made", [source]))
    trees = {path.stem: tomllib.loads(path.read_text()) for path in (tmp_path / "made").glob("*.toml")}
    assert set(trees["mapping"]) == {"schema", "campaign", "time", "wrench", "encoder", "recording"}
    assert trees["mapping"]["recording"][0]["source"] == source.name
    assert trees["mapping"]["time"]["column"] == "time\x7f\u2028"
    assert set(trees["rig"]) == {"gravity", "transducer", "joint", "body"}
    for path in (tmp_path / "made").glob("*.toml"):
        assert all(line.isprintable() for line in path.read_text().splitlines())


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
