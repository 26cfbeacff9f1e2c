"""The archived identification of DUMMY1 against the numbers that the generator had, which no part of it has read."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

ROOT = Path(__file__).parents[3]


@pytest.fixture(scope="module")
def results() -> dict[str, Any]:
    told: dict[str, Any] = json.loads((ROOT / "reports" / "DUMMY1-identify" / "results.json").read_text())
    return told


@pytest.fixture(scope="module")
def hardware() -> dict[str, Any]:
    told = json.loads((ROOT / "tests" / "archive" / "truth" / "DUMMY1.json").read_text())
    numbers: dict[str, Any] = told["hardware"]
    return numbers


def true(hardware: dict[str, Any], name: str) -> float:
    value = np.asarray(hardware[name.partition("[")[0]])
    return float(value[tuple(int(index) for index in re.findall(r"\[(\d+)\]", name))])


def error(hardware: dict[str, Any], one: dict[str, Any]) -> float:
    difference = float(one["value"]) - true(hardware, one["name"])
    return (difference + np.pi) % (2.0 * np.pi) - np.pi if ".phi_" in one["name"] else difference


def test_errors_are_within_the_bound(results: dict[str, Any], hardware: dict[str, Any]) -> None:
    gears = [one for one in results["parameters"] if one["group"] != "rig"]
    z = np.array([error(hardware, one) / one["sigma"] for one in gears])
    assert len(z) == 32
    assert np.sqrt(np.mean(z**2)) < 1.5
    assert np.mean(np.abs(z) <= 1.96) >= 0.84  # 27 of 32: five or more outside have a chance of 2 %


def test_profile_intervals_hold_most_of_the_critical_numbers(results: dict[str, Any], hardware: dict[str, Any]) -> None:
    critical = [one for one in results["parameters"] if one["interval"] is not None]
    assert len(critical) == 18
    held = [
        one["interval"]["low"] <= one["value"] - error(hardware, one) <= one["interval"]["high"] for one in critical
    ]
    assert sum(held) >= 14
