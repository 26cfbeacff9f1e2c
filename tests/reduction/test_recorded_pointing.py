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

import archived
from kbs_process.campaign.config import Campaign, PointingRequirement, PointingStatistic
from kbs_process.campaign.load import load_campaign
from kbs_process.reduction.analysis import Analysis
from kbs_process.reduction.pointing import judged_pointing, recorded_pointing
from kbs_process.results.pointing import JudgedPointing
from kbs_process.signals.records import WRENCH_CHANNELS, Array, Block, Run
from kbs_process.stages.align.condense import CondenseSettings, condense
from kbs_process.studies.correlate.summary import conclusion

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


def analysis(run: Run, role: str = "fit", predicted: Run | None = None) -> Analysis:
    entry = SimpleNamespace(role=role, name="R1", clock_sigma=0.0)
    assert run.angle is not None
    motion = SimpleNamespace(qd=np.tile([0.005, -0.002], (len(run.angle), 1)))
    return cast(Analysis, SimpleNamespace(entry=entry, run=run, predicted=predicted, motion=motion))


def judged(statistic: PointingStatistic, limit: float, *, external: bool = True, doubt: str = "") -> JudgedPointing:
    """A limit in rad, judged on one recording."""
    run = recorded()
    asked = PointingRequirement("random", statistic, limit, "")
    stated = cast(Campaign, SimpleNamespace(pointing=(asked,), rig=archived.rig()))
    (one,) = judged_pointing(stated, [analysis(run if external else replace(run, pointing=None))], doubt)
    return one


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


def test_the_prediction_is_held_against_the_same_command() -> None:
    run = recorded()
    rows = list(recorded_pointing([analysis(replace(run, pointing=None), predicted=run)]))
    assert [row.instrument for row in rows] == ["encoder", "encoder", "predicted", "predicted"]
    assert rows[2].estimate == rows[0].estimate


@pytest.mark.parametrize(
    ("statistic", "limit", "verdict"),
    [
        ("bias", 2.0 * MISREAD, "pass"),
        ("bias", 0.5 * MISREAD, "fail"),
        ("random", 1e-4, "pass"),
        ("percentile", 0.9 * MISREAD, "fail"),
        ("orbit", 1e-2, "undecided"),  # the recording is no orbit
        ("orbit", 1e-9, "undecided"),  # and what it varies by is noise
    ],
)
def test_limits_are_judged_by_the_instrument(statistic: PointingStatistic, limit: float, verdict: str) -> None:
    one = judged(statistic, limit)
    assert one.verdict == verdict
    assert one.where.endswith("in R1, by external")


def test_an_encoder_is_believed_as_far_as_its_offset_and_rounding_are_known() -> None:
    """EL089's: 0.2 mrad of offset, one sigma, and a code of 0.38 mrad."""
    sigma = np.hypot(2e-4, 3.834951969714103e-4 / np.sqrt(12.0))
    near = judged("bias", OFFSET + 2.5e-4, external=False)
    assert (near.verdict, near.where[2:]) == ("undecided", " in R1, by encoder")
    assert near.value == pytest.approx(OFFSET, rel=1e-3)
    assert near.sigma == pytest.approx(sigma, rel=0.02)
    assert judged("bias", 1e-3, external=False).verdict == "pass"


def test_nothing_is_met_by_an_instrument_that_lacks_readings() -> None:
    run = recorded()
    assert run.pointing is not None
    lacking = run.pointing.valid.copy()
    lacking[len(lacking) // 2] = False
    holed = replace(run, pointing=replace(run.pointing, valid=lacking))
    asked = PointingRequirement("bias", "bias", 2.0 * MISREAD, "")
    stated = cast(Campaign, SimpleNamespace(pointing=(asked,), rig=archived.rig()))
    (one,) = judged_pointing(stated, [analysis(holed)], "")
    assert (one.verdict, one.where[2:]) == ("undecided", " in R1, by external, which lacks readings")


def test_nothing_is_met_where_the_rig_is_in_doubt_or_nothing_was_recorded() -> None:
    doubted = judged("bias", 2.0 * MISREAD, doubt="the model of this rig is wrong")
    assert (doubted.verdict, doubted.doubt) == ("undecided", "the model of this rig is wrong")
    assert judged("bias", 0.5 * MISREAD, doubt="the model of this rig is wrong").verdict == "fail"
    asked = PointingRequirement("random", "bias", 1.0, "")
    (one,) = judged_pointing(cast(Campaign, SimpleNamespace(pointing=(asked,), rig=archived.rig())), [], "")
    assert (one.verdict, one.value) == ("undecided", None)


def test_the_verdict_is_the_worst_of_disturbance_and_pointing() -> None:
    broken = judged("bias", 0.5 * MISREAD)
    said = conclusion((), [judged("random", 1e-4), broken])
    assert said.status == "fail"
    assert said.sentence.startswith("random: not met. ")
    assert ", by external: 0.0286 +- " in said.sentence
    assert said.sentence.endswith(" deg; limit 0.01432 deg.")
    assert conclusion((), [judged("random", 1e-4)]).status == "pass"


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
