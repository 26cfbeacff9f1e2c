"""results.json: its schema, and what is refused."""

from __future__ import annotations

import json
import math
from pathlib import Path

import jsonschema
import pytest

from kbs_process.errors import OutputError
from kbs_process.report import results as r
from report import sample

SCHEMA = Path(__file__).parents[2] / "schemas" / "results.schema.json"


def test_the_committed_schema_is_the_one_of_the_records() -> None:
    assert json.loads(SCHEMA.read_text()) == r.schema()


def test_the_sample_satisfies_the_schema_and_survives_a_round_trip() -> None:
    results = sample.command_results()
    content = r.encode(results)
    jsonschema.Draft202012Validator(json.loads(SCHEMA.read_text())).validate(json.loads(content))
    assert r.decode(content) == results
    assert r.encode(r.decode(content)) == content


def test_numbers_that_could_not_be_determined_become_null() -> None:
    resonance = r.Resonance(axis="x", frequency_Hz=2.0, source="", sigma_Hz=math.nan)
    minimal = r.Results(
        campaign=sample.command_results().campaign,
        verdict=r.Conclusion(status="none", sentence=""),
        provenance=sample.PROVENANCE,
        resonances=(resonance,),
    )
    assert r.decode(r.encode(minimal)).resonances[0].sigma_Hz is None


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
        r.load(tmp_path)
    assert said in str(caught.value)
    assert str(tmp_path) in str(caught.value)
    assert caught.value.remedy


@pytest.mark.parametrize("content", [b"", b"{", b"\xff\xfe", b"[]"])
def test_what_is_no_json_is_refused(content, tmp_path) -> None:
    (tmp_path / "results.json").write_bytes(content)
    with pytest.raises(OutputError, match="not a results file"):
        r.load(tmp_path)


def test_an_empty_folder_is_refused_with_a_remedy(tmp_path) -> None:
    with pytest.raises(OutputError, match="no results here"):
        r.load(tmp_path)
