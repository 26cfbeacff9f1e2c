"""The page of the catalogue is what the laws declare, and names every law at its port."""

from __future__ import annotations

import re
from pathlib import Path

from kbs_process.plant.laws import CATALOGUE, MEASURED, SENSING
from kbs_process.plant.laws.document import catalogue

TEXT = (Path(__file__).parents[2] / "docs" / "catalogue.md").read_text(encoding="utf-8")


def test_the_page_is_written_from_the_laws() -> None:
    assert catalogue() == TEXT, "python -m kbs_process.plant.laws > docs/catalogue.md"


def test_every_law_is_listed_at_its_port() -> None:
    listed = dict(re.findall(r"^#### `(\w+)`\n\nAt: ([\w ]+)", TEXT, re.MULTILINE))
    assert listed == {law.name: law.port.name.lower().replace("_", " ") for law in (*CATALOGUE, *MEASURED, *SENSING)}


def test_every_parameter_has_a_row_with_its_unit() -> None:
    rows = re.findall(r"^\| `(\w+)` \| ([^|]+) \|", TEXT, re.MULTILINE)
    declared = [(entry.name, entry.unit) for law in (*CATALOGUE, *MEASURED, *SENSING) for entry in law.parameters]
    assert sorted(rows) == sorted(declared)
