"""A number whose unit is another: told where place or limit cannot be so, and else it stands beside the verdict."""

from __future__ import annotations

import pytest

import archived
from kbs_process.results.judged import Requirement
from kbs_process.studies.correlate.notices import implausible


def told(*, lever_m: float | None, limit: float, high: float = 0.034) -> list[str]:
    """What is told of EL089_FM's rig: 275 N, which reaches 0.3 m."""
    judged = Requirement(
        name="torque",
        quantity="torque",
        frame="T" if lever_m is None else "S",
        statistic="peak",
        band="lt1Hz",
        band_Hz=(0.01, 1.0),
        limit=limit,
        unit="N m",
        value=0.022,
        sigma=0.006,
        margin=limit - 0.022,
        verdict="pass",
        high=high,
        lever_m=lever_m,
    )
    return [" ".join(notice.what.split()) for notice in implausible(archived.campaign("EL089_FM"), [judged])]


def test_what_is_plausible_is_not_told():
    assert told(lever_m=2.14, limit=0.06) == told(lever_m=None, limit=0.06) == told(lever_m=12.0, limit=3.0) == []


@pytest.mark.parametrize(
    ("lever_m", "words"), [(0.00214, "within the article"), (2140.0, "than any spacecraft is long")]
)
def test_a_centre_of_mass_in_another_unit_is_told(lever_m: float, words: str):
    (what,) = told(lever_m=lever_m, limit=0.06)
    assert words in what and f"{lever_m:.3g} m" in what


@pytest.mark.parametrize("lever_m", [None, 2.14])
def test_a_limit_in_another_unit_is_told(lever_m: float | None):
    (what,) = told(lever_m=lever_m, limit=60.0)
    assert "the limit of 60 N m" in what
    assert "over 100 times all that was measured" in what


def test_a_limit_beyond_the_weight_is_told():
    (what,) = told(lever_m=None, limit=150.0, high=5.0)
    assert "all the weight can make there, " in what
