"""Pointing errors of recordings: the encoder's and an external instrument's, each against the command."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from kbs_process.campaign.load import load_campaign
from kbs_process.reduction.analysis import Analysis
from kbs_process.reduction.pointing import recorded_pointing
from kbs_process.signals.records import WRENCH_CHANNELS, Array, Block, Run
from kbs_process.stages.align.condense import CondenseSettings, condense

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
DURATION, OFFSET, MISREAD = 120.0, 2e-4, 5e-4


def block(t: Array, values: Array) -> Block:
    stamp = np.rint(t * 1e9).astype(np.int64)
    return Block(stamp, stamp, np.ascontiguousarray(values))


def recorded() -> Run:
    """A slow turn; the encoder reads OFFSET more than commanded, the external instrument MISREAD less."""
    rng = np.random.default_rng(2)

    def streams() -> Iterator[tuple[str, Block]]:
        t = np.arange(0.0, DURATION, 0.01)
        course = np.stack([0.3 + 0.005 * t, 0.8 - 0.002 * t], axis=1)
        yield "wrench", block(t, np.zeros((len(t), 6)))
        yield "angle", block(t, course + OFFSET)
        yield "pointing", block(t, course - MISREAD + 1e-5 * rng.standard_normal(course.shape))
        cycle = t[::10]
        yield "command", block(cycle, course[::10])

    axes = ("az", "el")
    channels = {"wrench": WRENCH_CHANNELS, "angle": axes, "pointing": axes, "command": axes}
    return condense("R1", streams(), channels, CondenseSettings())


def analysis(run: Run, role: str = "fit") -> Analysis:
    return cast(Analysis, SimpleNamespace(entry=SimpleNamespace(role=role), run=run))


def test_each_instrument_is_held_against_the_command() -> None:
    found = {(one.instrument, one.estimate.axis): one.estimate for one in recorded_pointing([analysis(recorded())])}
    assert set(found) == {(name, axis) for name in ("encoder", "external") for axis in ("az", "el")}
    for axis in ("az", "el"):
        assert found["encoder", axis].bias == pytest.approx(OFFSET, abs=1e-7)
        assert found["external", axis].bias == pytest.approx(-MISREAD, abs=1e-6)
        assert found["external", axis].percentile == pytest.approx(MISREAD, rel=0.05)


def test_without_an_instrument_or_a_command_there_is_nothing_to_say() -> None:
    run = recorded()
    only = [one.instrument for one in recorded_pointing([analysis(replace(run, pointing=None))])]
    assert only == ["encoder", "encoder"]
    assert not list(recorded_pointing([analysis(replace(run, command=None))]))
    assert not list(recorded_pointing([analysis(run, "calibration")]))


def test_a_campaign_names_the_topic_of_the_instrument(tmp_path: Path) -> None:
    folder = tmp_path / "EL089"
    folder.mkdir()
    shutil.copytree(ROOT / "campaigns" / "EL089" / "parameters", folder / "parameters")
    text = (ROOT / "campaigns" / "EL089" / "campaign.toml").read_text()
    (folder / "campaign.toml").write_text(text.replace("[topics]\n", '[topics]\npointing = "/tracker"\n'))
    topic = load_campaign(folder, recordings=False).topics.pointing
    assert topic is not None
    assert (topic.topic, topic.channels) == ("/tracker", ("az", "el"))
    assert topic.fields == ("position[az]", "position[el]")
