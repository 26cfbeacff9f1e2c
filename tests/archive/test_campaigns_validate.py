"""Every archived campaign, with recordings or with a mission alone, is one in which `validate` finds no fault."""

from __future__ import annotations

import pytest

from archived import CAMPAIGNS, each
from kbs_process.cli import main

NAMES = sorted(path.parent.name for path in CAMPAIGNS.glob("*/campaign.toml"))


@pytest.mark.parametrize("name", each(NAMES))
def test_validates(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    main(["validate", str(CAMPAIGNS / name)])  # exits where there is one
    told = capsys.readouterr().out
    assert told.startswith(f"{name}: ")
    assert " 0 refused" in told
