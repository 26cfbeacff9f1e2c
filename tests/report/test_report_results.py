"""results.json: its schema, and what is refused."""

from __future__ import annotations

import json
import math
from pathlib import Path

import jsonschema
import msgspec
import pytest

from kbs_process.errors import OutputError
from kbs_process.results.records import decode, load, schema_of
from kbs_process.studies.correlate import results as r
from kbs_process.studies.documents import DOCUMENTS
from kbs_process.studies.documents import render as build
from report import sample

SCHEMAS = Path(__file__).parents[2] / "schemas"
SCHEMA = SCHEMAS / "results.schema.json"


@pytest.mark.parametrize("kind", DOCUMENTS)
def test_the_committed_schema_is_the_one_of_the_records(kind: str) -> None:
    document = DOCUMENTS[kind]
    path = SCHEMA if kind == "correlation" else SCHEMAS / f"{kind}.schema.json"
    assert json.loads(path.read_text()) == schema_of(document.record, document.title)


@pytest.mark.parametrize("kind", DOCUMENTS)
def test_results_say_of_what_kind_they_are(kind: str) -> None:
    assert {field.name: field.default for field in msgspec.structs.fields(DOCUMENTS[kind].record)}["kind"] == kind


def test_the_sample_satisfies_the_schema_and_survives_a_round_trip() -> None:
    results = sample.command_results()
    content = r.encode(results)
    jsonschema.Draft202012Validator(json.loads(SCHEMA.read_text())).validate(json.loads(content))
    assert decode(content, r.Results) == results
    assert r.encode(decode(content, r.Results)) == content


def test_numbers_that_could_not_be_determined_become_null() -> None:
    resonance = r.Resonance(axis="x", frequency_Hz=2.0, source="", sigma_Hz=math.nan)
    minimal = r.Results(
        campaign=sample.command_results().campaign,
        verdict=r.Conclusion(status="none", sentence=""),
        provenance=sample.PROVENANCE,
        resonances=(resonance,),
    )
    assert decode(r.encode(minimal), r.Results).resonances[0].sigma_Hz is None


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
    content = json.loads(r.encode(sample.command_results()))
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
    content = json.loads(r.encode(sample.command_results()))
    content["kind"] = "correlatoin"
    (tmp_path / "results.json").write_text(json.dumps(content))
    with pytest.raises(OutputError, match="no report of kind 'correlatoin'") as caught:
        build(tmp_path)
    assert "correlation" in caught.value.remedy
