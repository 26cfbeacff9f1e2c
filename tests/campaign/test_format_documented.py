"""docs/campaign.md says what the schemas and the table of units say."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from math import pi
from pathlib import Path
from typing import Any

import pytest

from kbs_process.campaign.units import DIMENSIONS, UnitMismatchError, factor
from kbs_process.studies.schemas import schema_text

DOCUMENT = (Path(__file__).parents[2] / "docs" / "campaign.md").read_text(encoding="utf-8")


def keys(node: Any) -> Iterator[str]:
    """Yield the names of all properties that a schema defines."""
    if isinstance(node, dict):
        properties = node.get("properties", {})
        yield from properties
        for child in node.values():
            yield from keys(child)


@pytest.mark.parametrize("schema", ["campaign", "parameters"])
def test_every_key_is_documented(schema: str) -> None:
    prose = re.sub(r"```.*?```", "", DOCUMENT, flags=re.DOTALL)
    words = set(re.findall(r"[A-Za-z_0-9]+", " ".join(re.findall(r"`([^`]+)`", prose))))
    assert set(keys(json.loads(schema_text(schema)))) <= words


def test_the_table_of_units_is_the_code_s() -> None:
    table = DOCUMENT[DOCUMENT.index("## Units") :]
    rows = re.findall(r"^\| ([a-z ]+) \| (`.*`) \|$", table, flags=re.MULTILINE)
    documented = {name: re.findall(r"`([^`]+)`", units) for name, units in rows}
    assert documented == {name: list(units) for name, units in DIMENSIONS.items()}


# Each by its definition, independent of the table.
@pytest.mark.parametrize(
    ("unit", "si", "expected"),
    [
        ("deg", "rad", pi / 180),
        ("arcsec", "rad", pi / 180 / 3600),
        ("rpm", "rad/s", 2 * pi / 60),
        ("N mm", "N m", 1e-3),
        ("N m/deg", "N m/rad", 1 / (pi / 180)),
        ("N m/rpm", "N m s/rad", 1 / (2 * pi / 60)),
        ("g cm^2", "kg m^2", 1e-3 * 1e-2**2),
        ("kg mm^2", "kg m^2", 1e-3**2),
        ("km/h", "m/s", 1000 / 3600),
        ("%", "1", 0.01),
        ("N m s^2/rad^2", "N m s^2/rad^2", 1.0),
    ],
)
def test_factors(unit: str, si: str, expected: float) -> None:
    assert factor(unit, si) == pytest.approx(expected, rel=1e-15)


def test_no_unit_belongs_to_two_dimensions() -> None:
    units = [unit for dimension in DIMENSIONS.values() for unit in dimension]
    assert len(units) == len(set(units))


@pytest.mark.parametrize("si", [next(iter(units)) for units in DIMENSIONS.values()])
def test_another_dimension_is_refused(si: str) -> None:
    other = "kg" if si != "kg" else "m"
    with pytest.raises(UnitMismatchError) as caught:
        factor(other, si)
    assert f"({si}) is expected" in str(caught.value)
    assert f"'{si}'" in caught.value.remedy
