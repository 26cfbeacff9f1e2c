"""What processes a campaign cannot know how it was made: neither by its code nor by the files that it opens."""

import ast
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import IO

import pytest
from mcap.exceptions import EndOfFile
from mcap.records import Attachment, Channel, Header, McapRecord, Metadata
from mcap.stream_reader import StreamReader

from end_to_end.archive_run import Processed
from engine.campaigns import CAMPAIGNS

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "pipeline" / "kbs_process"
# What computes. The command line and the importers name campaigns in their examples.
COMPUTING = (
    "stages",
    "plant",
    "estimation",
    "identification",
    "recordings",
    "rig",
    "signals",
    "campaign",
    "reduction",
    "results",
    "report",
    "studies",
)


def strings(source: Path) -> set[str]:
    """String constants of a module, its docstrings aside."""
    tree = ast.parse(source.read_text())
    documented = [node for node in ast.walk(tree) if isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef))]
    docstrings = {id(node.body[0].value) for node in documented if node.body and isinstance(node.body[0], ast.Expr)}
    return {
        node.value
        for node in ast.walk(tree)
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in docstrings
    }


@pytest.mark.parametrize("folder", COMPUTING)
def test_code_names_neither_campaigns_nor_truth(folder: str):
    campaigns = {path.name for path in (ROOT / "campaigns").iterdir() if path.is_dir()}
    secrets = campaigns | {"truth", "tests/"}
    modules = [path for path in (PACKAGE / folder).rglob("*.py") if "convert" not in path.parts]
    assert modules
    for module in modules:
        found = {text for text in strings(module) if any(secret in text for secret in secrets)}
        assert not found, f"{module.relative_to(ROOT)}: {found}"


@pytest.mark.slow
def test_processing_opens_nothing_but_the_campaign(archived: Callable[[str], Processed]):
    campaign = ROOT / "campaigns" / "ALSTPP00"
    below = [path for path in archived("ALSTPP00").opened if path.is_relative_to(ROOT)]
    code = (ROOT / "pipeline", ROOT / "schemas", ROOT / ".venv", ROOT / ".git")
    strays = [path for path in below if not any(path.is_relative_to(place) for place in (campaign, *code))]
    assert campaign / "campaign.toml" in below
    assert not strays


def numbers_of_truth() -> set[str]:
    """Every number that was drawn, as it is written in the truth files, where it has enough digits to be known by."""
    texts = (path.read_text() for path in (ROOT / "tests" / "archive" / "truth").glob("*.json"))
    found = {number for text in texts for number in re.findall(r"-?\d\.\d+(?:e-?\d+)?", text)}
    return {number.lstrip("-") for number in found if len(number) > 12}


@pytest.mark.parametrize("name", CAMPAIGNS)
def test_campaign_folders_hold_what_a_bench_gives_and_no_more(name: str):
    """Description, parameters, recordings: no other file, no hint of an engine, seed or truth, no number drawn."""
    folder = ROOT / "campaigns" / name
    recordings = {f"recordings/{run.file}" for run in CAMPAIGNS[name].runs}
    others = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()} - recordings
    assert "campaign.toml" in others
    assert all(re.fullmatch(r"campaign\.toml|parameters/\w+\.(toml|csv|json)", other) for other in others), others
    drawn = numbers_of_truth()
    assert len(drawn) > 300
    for other in others:
        text = (folder / other).read_text()
        assert not re.search(r"truth|seed|mujoco|engine that|simulat|synthetic", text, re.IGNORECASE), other
        assert not {number.lstrip("-") for number in re.findall(r"-?\d\.\d+(?:e-?\d+)?", text)} & drawn, other


@pytest.mark.parametrize("name", CAMPAIGNS)
def test_recordings_carry_nothing_beside_their_messages(name: str):
    """No attachments or metadata, one library's name, topics in one order: nothing tells one campaign from another."""
    for run in CAMPAIGNS[name].runs:
        path = ROOT / "campaigns" / name / "recordings" / run.file
        topics = []
        with path.open("rb") as file:
            for record in records(file):
                assert not isinstance(record, Attachment | Metadata), run.file
                if isinstance(record, Header):
                    assert record.library == "kbs engine", run.file
                if isinstance(record, Channel):
                    assert record.metadata == {}, run.file
                    topics.append(record.topic)
        assert topics[:4] == ["/transducer/wrench", "/encoder", "/command", "/motor/field"], run.file


def records(file: IO[bytes]) -> Iterator[McapRecord]:
    """Every record up to where the recorder lost power."""
    try:
        yield from StreamReader(file).records
    except EndOfFile:
        return
