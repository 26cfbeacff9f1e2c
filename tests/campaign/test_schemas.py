"""schemas/ says to editors what the formats say: each is generated, and takes every file of the archive."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from kbs_process.studies.schemas import FORMATS, schema_text

ROOT = Path(__file__).parents[2]
FILES = sorted((ROOT / "campaigns").rglob("*.toml"))


def stored(name: str) -> Path:
    return ROOT / "schemas" / f"{name}.schema.json"


@pytest.mark.parametrize("name", FORMATS)
def test_the_committed_schema_is_the_one_of_the_format(name: str) -> None:
    text = schema_text(name)
    assert stored(name).read_text(encoding="utf-8") == text, f"kbs-process schema {name}"
    jsonschema.Draft202012Validator.check_schema(json.loads(text))


def as_json(node: Any) -> Any:
    """A tree of TOML as an editor hands it to a schema."""
    return json.loads(json.dumps(node, default=lambda moment: moment.isoformat()))


@pytest.mark.parametrize("file", FILES, ids=lambda path: str(path.relative_to(ROOT)))
def test_an_editor_finds_no_fault_in_the_archive(file: Path) -> None:
    heading, *_ = file.read_text(encoding="utf-8").splitlines()
    schema = (file.parent / heading.removeprefix("#:schema ")).resolve()
    tree = as_json(tomllib.loads(file.read_text(encoding="utf-8")))
    jsonschema.Draft202012Validator(json.loads(schema.read_text(encoding="utf-8"))).validate(tree)


def test_an_editor_tells_a_key_that_is_not_known() -> None:
    schema = json.loads(schema_text("parameters"))
    tree = {"joint": {"az": {"drive": {"ratoi": 1.0}}}}
    (error,) = jsonschema.Draft202012Validator(schema).iter_errors(tree)
    assert list(error.absolute_path) == ["joint", "az", "drive"]
    assert "ratoi" in error.message
