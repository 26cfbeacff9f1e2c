"""results.json: its schema, and what is refused."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import jsonschema
import msgspec
import pytest

from kbs_process.errors import OutputError
from kbs_process.report import provenance
from kbs_process.report.build import publish
from kbs_process.report.panel import Cell, Grid
from kbs_process.results.records import Check, Conclusion, InputFile, decode, encode, load, schema_of
from kbs_process.results.versions import VERSION
from kbs_process.studies.correlate import results as r
from kbs_process.studies.correlate.report import _provenance
from kbs_process.studies.correlate.sections import gravity
from kbs_process.studies.documents import DOCUMENTS
from kbs_process.studies.documents import render as build
from report import sample

SCHEMAS = Path(__file__).parents[2] / "schemas"
SCHEMA = SCHEMAS / "results.schema.json"
FORMER = Path(__file__).parent / "former"


@pytest.mark.parametrize("kind", DOCUMENTS)
def test_the_committed_schema_is_the_one_of_the_records(kind: str) -> None:
    document = DOCUMENTS[kind]
    path = SCHEMA if kind == "correlation" else SCHEMAS / f"{kind}.schema.json"
    assert json.loads(path.read_text()) == schema_of(document.record, document.title)


@pytest.mark.parametrize("kind", DOCUMENTS)
def test_results_say_of_what_kind_they_are(kind: str) -> None:
    assert {field.name: field.default for field in msgspec.structs.fields(DOCUMENTS[kind].record)}["kind"] == kind


@pytest.mark.parametrize("kind", DOCUMENTS)
def test_every_kind_says_the_same_version(kind: str) -> None:
    assert {field.name: field.default for field in msgspec.structs.fields(DOCUMENTS[kind].record)}["schema"] == VERSION


def holds(tree: Any, part: Any) -> bool:
    """Whether all that `part` says is said by `tree`, which may say more."""
    if isinstance(part, dict):
        return part.keys() <= tree.keys() and all(holds(tree[key], value) for key, value in part.items())
    if isinstance(part, list):
        return len(tree) == len(part) and all(map(holds, tree, part))
    return bool(tree == part)


@pytest.mark.parametrize("kind", sorted(path.stem for path in FORMER.iterdir()))
def test_results_of_version_1_are_read_and_become_this_version(kind: str) -> None:
    content = (FORMER / f"{kind}.json").read_bytes()
    former = json.loads(content)
    assert former.pop("schema") == 1
    now = json.loads(encode(decode(content, DOCUMENTS[kind].record)))
    assert now.pop("schema") == VERSION == 2
    assert holds(now, former)


@pytest.mark.parametrize("kind", sorted(path.stem for path in FORMER.iterdir()))
def test_results_of_version_1_are_rendered(kind: str, tmp_path: Path) -> None:
    (tmp_path / "results.json").write_bytes((FORMER / f"{kind}.json").read_bytes())
    assert "</html>" in build(tmp_path, pdf=False).read_text(encoding="utf-8")


def test_the_sample_satisfies_the_schema_and_survives_a_round_trip() -> None:
    results = sample.command_results()
    content = encode(results)
    jsonschema.Draft202012Validator(json.loads(SCHEMA.read_text())).validate(json.loads(content))
    assert decode(content, r.Results) == results
    assert encode(decode(content, r.Results)) == content


def test_numbers_that_could_not_be_determined_become_null() -> None:
    resonance = r.Resonance(axis="x", frequency_Hz=2.0, source="", sigma_Hz=math.nan)
    minimal = r.Results(
        campaign=sample.command_results().campaign,
        verdict=Conclusion(status="none", sentence=""),
        provenance=sample.PROVENANCE,
        resonances=(resonance,),
    )
    assert decode(encode(minimal), r.Results).resonances[0].sigma_Hz is None


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda d: d["requirements"][0].update(limitt=1.0), "limitt"),
        (lambda d: d["requirements"][0].update(limit="0.06"), "limit"),
        (lambda d: d.update(schema=99), "schema"),
        (lambda d: d["verdict"].pop("status"), "status"),
    ],
)
def test_a_wrong_field_is_named(change, said, tmp_path) -> None:
    content = json.loads(encode(sample.command_results()))
    change(content)
    (tmp_path / "results.json").write_text(json.dumps(content))
    with pytest.raises(OutputError) as caught:
        load(tmp_path, r.Results)
    assert said in str(caught.value)
    assert str(tmp_path) in str(caught.value)
    assert caught.value.remedy


@pytest.mark.parametrize("content", [b"", b"{", b"\xff\xfe", b"[]"])
def test_what_is_no_json_is_refused(content, tmp_path) -> None:
    (tmp_path / "results.json").write_bytes(content)
    with pytest.raises(OutputError, match="not a results file"):
        load(tmp_path, r.Results)


def test_an_empty_folder_is_refused_with_a_remedy(tmp_path) -> None:
    with pytest.raises(OutputError, match="no results here"):
        load(tmp_path, r.Results)


def test_an_unknown_kind_of_report_is_refused_with_a_remedy(tmp_path) -> None:
    content = json.loads(encode(sample.command_results()))
    content["kind"] = "correlatoin"
    (tmp_path / "results.json").write_text(json.dumps(content))
    with pytest.raises(OutputError, match="no report of kind 'correlatoin'") as caught:
        build(tmp_path)
    assert "correlation" in caught.value.remedy


@pytest.mark.parametrize(("status", "met"), [("pass", True), ("fail", False), ("undecided", False), ("none", None)])
def test_what_is_undecided_is_not_met(tmp_path: Path, status: str, met: bool | None) -> None:
    found = load(sample.one_channel(tmp_path), r.Results)
    verdict = msgspec.structs.replace(found.verdict, status=status)
    told = publish(tmp_path, tmp_path, msgspec.structs.replace(found, verdict=verdict), None, None)
    assert told.requirement_met is met


def test_every_input_is_told_once_and_so_are_the_loggers_files() -> None:
    given = msgspec.structs.replace(
        sample.PROVENANCE,
        inputs=(InputFile(file="campaign.toml", sha256="a"), InputFile(file="recordings/x.mcap", sha256="b")),
    )
    grid = provenance.panel(given, (InputFile(file="x.csv", sha256="c"),)).blocks[2]
    assert isinstance(grid, Grid)
    assert grid.rows == (("campaign.toml", "a"), ("recordings/x.mcap", "b"), ("x.csv, imported", "c"))
    results = sample.command_results()
    campaign = msgspec.structs.replace(results.campaign, sources=(InputFile(file="x.csv", sha256="c"),))
    found = _provenance(msgspec.structs.replace(results, campaign=campaign), None).blocks[2]  # type: ignore[arg-type]
    assert isinstance(found, Grid)
    names = [row[0] for row in found.rows]
    assert len(names) == len(set(names)) and names[-1] == "x.csv, imported"


def test_a_check_of_a_fit_is_told_apart_from_a_verdict() -> None:
    checks = (Check(name="within bounds", ok=False), Check(name="converged", ok=True))
    results = sample.command_results()
    results = msgspec.structs.replace(results, gravity=msgspec.structs.replace(results.gravity, checks=checks))
    grid = gravity.panel(results, None).blocks[-1]  # type: ignore[arg-type]
    assert isinstance(grid, Grid)
    assert [row[1] for row in grid.rows] == [Cell("see detail", "undecided"), Cell("ok", "pass")]
