"""The mission file: what is refused, and how; every key is documented."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kbs_process.campaign.load import load_campaign
from kbs_process.campaign.mission import Day, load_day
from kbs_process.errors import ConfigError
from mission import reference

ROOT = Path(__file__).parents[2]


@pytest.fixture
def changed(tmp_path: Path) -> Callable[[str, str], Day]:
    """Load a copy of the campaign in whose mission file a text is replaced."""

    def load(old: str, new: str) -> Day:
        folder = tmp_path / "REFDAY"
        shutil.copytree(reference.FOLDER, folder)
        path = folder / "mission.toml"
        text = path.read_text()
        assert old in text
        path.write_text(text.replace(old, new, 1))
        return load_day(load_campaign(folder, recordings=False))

    return load


def test_units_are_converted() -> None:
    assert np.degrees(reference.mission().limits.low) == pytest.approx([-165.0, -30.0])
    assert np.degrees(reference.mission().limits.acceleration) == pytest.approx(0.015)
    assert reference.mission().orbit.ascending_node_time == pytest.approx(22 * 3600.0)
    assert np.degrees(reference.day().requirements[0].limit) == pytest.approx(0.054)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("repeat_orbits = 501", "repeat_orbit = 501", "did you mean 'repeat_orbits'"),
        ("1999-12-01T15:30:00Z", '"noon"', "orbit.epoch: is no date and time"),
        ("1999-12-01T15:30:00Z", "1999-12-01T15:30:00", "orbit.epoch: is no date and time"),
        ("value = [-165, 165]", "value = [165, -165]", "limits.azimuth: is empty"),
        ('unit = "deg/s"', 'unit = "deg"', "limits.rate.unit: unit 'deg' is a unit of angle"),
        ('until = "loss"', 'until = "los"', "did you mean 'loss'"),
        ('limit = { value = 0.054, unit = "deg" }', 'limit = { value = 0.054, unit = "m" }', "unit of length"),
        ("rate = { value = 2.0", "rate = { value = 0.0", "limits.rate.value"),
    ],
)
def test_faults_are_told_with_their_place(changed: Callable[[str, str], Day], old: str, new: str, message: str) -> None:
    with pytest.raises(ConfigError) as caught:
        changed(old, new)
    assert message in str(caught.value) and "mission.toml:" in str(caught.value)


HAND_OVER = (
    '[[hand_over]]\nbegin = { value = 4400, unit = "s", sigma = 0.0, source = "planned" }\n\n[[section]]\nname = "1"'
)


def test_planned_hand_overs_are_read(changed: Callable[[str, str], Day]) -> None:
    assert changed('[[section]]\nname = "1"', HAND_OVER).mission.hand_overs == (4400.0,)


def test_a_hand_over_without_a_time_is_told_with_its_place(changed: Callable[[str, str], Day]) -> None:
    with pytest.raises(ConfigError) as caught:
        changed('[[section]]\nname = "1"', HAND_OVER.replace('"s"', '"m"'))
    assert "mission.toml:" in str(caught.value) and "hand_over[1].begin.unit: unit 'm'" in str(caught.value)


def test_a_campaign_without_a_mission_says_how_to_give_one() -> None:
    campaign = load_campaign(ROOT / "campaigns" / "EL089", checksums=False)
    with pytest.raises(ConfigError, match="has no mission"):
        load_day(campaign)


def test_a_campaign_without_recordings_is_for_its_mission_only() -> None:
    with pytest.raises(ConfigError, match="there is nothing to read"):
        load_campaign(reference.FOLDER)


def keys(node: Any) -> Iterator[str]:
    if isinstance(node, dict):
        properties = node.get("properties", {})
        yield from properties
        for child in node.values():
            yield from keys(child)


def test_every_key_is_documented() -> None:
    schema = json.loads((ROOT / "schemas" / "mission.schema.json").read_text())
    document = (ROOT / "docs" / "reference-day.md").read_text(encoding="utf-8")
    prose = re.sub(r"```.*?```", "", document, flags=re.DOTALL)
    words = set(re.findall(r"[A-Za-z_0-9]+", " ".join(re.findall(r"`([^`]+)`", prose))))
    assert set(keys(schema)) <= words
