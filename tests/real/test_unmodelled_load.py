"""A bungee that no parameter file describes, in an archived campaign: told at the top of the report, by its factor."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from end_to_end.archive_run import Processed

pytestmark = pytest.mark.slow


def _warnings(campaign: Processed) -> list[dict[str, Any]]:
    return [notice for notice in campaign.results["warnings"] if "unmodelled static load" in notice["what"]]


def test_recordings_with_a_bungee_are_named_with_channels_and_a_remedy(archived: Callable[[str], Processed]) -> None:
    told = _warnings(archived("AL012M00"))
    assert [notice["where"] for notice in told] == ["AL012M00_1", "AL012M00_2"]
    assert {notice["severity"] for notice in told} == {"warning"}
    for notice in told:
        assert "Tx" in notice["what"]
        assert "Ty" in notice["what"]
        assert "The verdict contains that load as well as the article's own disturbance" in " ".join(
            notice["what"].split()
        )
        assert "take it off, describe it, or judge a recording without it" in notice["remedy"]


def test_recordings_that_gravity_describes_are_not(archived: Callable[[str], Processed]) -> None:
    assert _warnings(archived("EL089")) == []
