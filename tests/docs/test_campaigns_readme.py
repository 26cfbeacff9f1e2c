"""campaigns/README.md against the campaigns: recordings and roles as described, verdicts as processing finds them."""

from __future__ import annotations

import re
import tomllib
from collections import Counter
from pathlib import Path

import pytest

from end_to_end.expected import expected

CAMPAIGNS = Path(__file__).parents[2] / "campaigns"
NAMES = sorted(path.parent.name for path in CAMPAIGNS.glob("*/recordings"))
VERDICT = {"pass": "met", "fail": "not met", "undecided": "undecided", "none": "none stated"}


def rows() -> dict[str, tuple[str, str]]:
    """Recordings and verdict of each campaign in the table."""
    text = (CAMPAIGNS / "README.md").read_text(encoding="utf-8")
    found = re.findall(r"^\| \[(\w+)\]\(\1/campaign\.toml\) \|(.*)\|$", text, flags=re.MULTILINE)
    cells = {name: [cell.strip() for cell in rest.split("|")] for name, rest in found}
    return {name: (row[1], row[-1]) for name, row in cells.items()}


def test_every_campaign_is_described() -> None:
    assert set(NAMES) <= rows().keys()


@pytest.mark.parametrize("name", NAMES)
def test_recordings_and_roles(name: str) -> None:
    document = tomllib.loads((CAMPAIGNS / name / "campaign.toml").read_text(encoding="utf-8"))
    count = Counter(entry["role"] for entry in document["recording"])
    roles = [f"{count[role]} {role}" for role in ("calibration", "fit", "held-out") if count[role]]
    assert rows()[name][0] == ", ".join(roles)


@pytest.mark.parametrize("name", NAMES)
def test_the_verdict_is_the_expected_result(name: str) -> None:
    """tests/end_to_end compares the expected result with what processing finds."""
    assert rows()[name][1] == VERDICT[expected(name)["verdict"]]
