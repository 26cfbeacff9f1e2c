"""The page on the paper names tests and campaigns that there are, and figures that the archive has."""

from __future__ import annotations

import json
import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "1996.md").read_text(encoding="utf-8")


def test_tests_and_campaigns_exist() -> None:
    named = set(re.findall(r"`(test_\w+)`", PAGE))
    assert named and named <= {path.stem for path in (ROOT / "tests").rglob("test_*.py")}
    campaigns = set(re.findall(r"campaign/(\w+)", PAGE))
    assert campaigns and campaigns <= {path.name for path in (ROOT / "campaigns").iterdir()}


def test_peaks_are_those_of_the_archive() -> None:
    for name, shown in (("EL089", "met, 0.0031 N m"), ("AL012M00", "3.9 N m, not met"), ("AL012_CORD", "0.052 N m")):
        results = json.loads((ROOT / "tests" / "archive" / "expected" / f"{name}.json").read_text())
        (requirement,) = results["requirements"].values()
        number = re.search(r"[\d.]+", shown)
        assert number and shown in PAGE
        decimals = len(number[0].partition(".")[2])
        assert f"{requirement['value']:.{decimals}f}" == number[0]
