"""A short reference day, all the way: planned, flown, judged, reported."""

from __future__ import annotations

import re
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest

from kbs_process.campaign.config import Campaign
from kbs_process.campaign.load import load_campaign
from kbs_process.campaign.mission import load_day
from kbs_process.errors import ConfigError
from kbs_process.mission.planner import Phase, Plan, plan
from kbs_process.progress import SilentProgress
from kbs_process.results.pointing import PointingEstimate
from kbs_process.results.records import load
from kbs_process.rig.model import substitute
from kbs_process.signals.records import Array
from kbs_process.stages import pointing
from kbs_process.studies.documents import render as build
from kbs_process.studies.reference_day.discussion import discussion
from kbs_process.studies.reference_day.flying import commands, fly
from kbs_process.studies.reference_day.results import PublishedSection, ReferenceDayResults, Section, Torque
from kbs_process.studies.reference_day.run import simulate_day
from mission.reference import FOLDER

pytestmark = pytest.mark.slow


def short_campaign(folder: Path, duration: float, sections: str) -> Campaign:
    """Return a copy of the reference day that ends early."""
    shutil.copytree(FOLDER, folder)
    path = folder / "mission.toml"
    text = path.read_text()
    text = text[: text.index("# Each section begins")] + sections
    text = re.sub(r"duration = \{ value = \d+", f"duration = {{ value = {duration:g}", text)
    path.write_text(re.sub(r"lead = \{ value = \d+", "lead = { value = 20", text))
    return load_campaign(folder, recordings=False)


WHOLE = '[[section]]\nname = "all"\nuntil = "end"\nnear_s = 60\n'


@pytest.fixture(scope="module")
def minute(tmp_path_factory: pytest.TempPathFactory) -> Campaign:
    return short_campaign(tmp_path_factory.mktemp("day") / "SHORT", 60.0, WHOLE)


def test_a_day_is_planned_flown_judged_and_reported_the_same_twice(minute: Campaign, tmp_path: Path) -> None:
    outcomes = [
        simulate_day(minute, tmp_path / name, samples=0, seed=0, progress=SilentProgress(), pdf=False) for name in "ab"
    ]
    assert (tmp_path / "a" / "results.json").read_bytes() == (tmp_path / "b" / "results.json").read_bytes()
    page = outcomes[0].report.read_bytes()
    assert page == outcomes[1].report.read_bytes()
    found = load(tmp_path / "a", ReferenceDayResults)
    assert [(s.name, s.start_s, s.end_s) for s in found.sections] == [("all", 0.0, 60.0)]
    assert {one.statistic for one in found.requirements} == {
        "random", "bias", "orbit", "percentile", "peak, up to 1 Hz",
    }  # fmt: skip
    assert outcomes[0].requirement_met is True
    (tmp_path / "a" / "index.html").unlink()
    assert build(tmp_path / "a", pdf=False).read_bytes() == page


def test_the_loop_holds_the_antenna_within_a_code_of_its_encoder(minute: Campaign) -> None:
    day = load_day(minute)
    planned = plan(day.mission, day.lead)
    flown = fly(minute, planned, 60.0)
    error = pointing.error(flown.angle, planned.t, planned.q)
    code = float(minute.rig.joint("az").encoder.step)  # type: ignore[union-attr]
    assert 0.05 * code < np.abs(error.values).max() < 1.5 * code
    # No gravity: at rest the interface carries nothing, and tracking moves it by little.
    assert np.abs(flown.wrench.values).max() < 0.5


def slewing(duration: float, rate: float) -> Plan:
    """A plan that turns azimuth at a constant rate, after a smooth start."""
    t = 0.1 * np.arange(round(duration / 0.1) + 1)
    ramp = np.radians(0.015)
    start = rate / ramp
    az = np.where(t < start, 0.5 * ramp * t**2, rate * (t - 0.5 * start))
    q: Array = np.stack([az, np.full_like(az, 0.5)], axis=1)
    return Plan(t, q, np.zeros(len(t)), (Phase("tracking", "X", 0, len(t)),), ())


def test_commands_make_up_for_the_encoder_s_latency(minute: Campaign) -> None:
    """With an encoder that does not round, only what the commands get wrong is left."""
    rig = substitute(minute.rig, {"joint.az.encoder.step": 0.0, "joint.el.encoder.step": 0.0})
    smooth = replace(minute, rig=rig)
    rate, planned = np.radians(0.5), slewing(90.0, np.radians(0.5))
    flown = fly(smooth, planned, 90.0)
    late = pointing.error(flown.angle, planned.t, planned.q).values[flown.angle.t > 60.0, 0]
    assert abs(late.mean()) < 2e-6
    assert rate * 0.1 > 100.0 * abs(late.mean())  # the lead that one cycle's latency would give

    assert rig.controller is not None
    told = commands(planned, rig)
    assert told.position[1:] == pytest.approx(planned.q[:-1])
    assert told.rate[:-1] * 0.1 == pytest.approx(np.diff(planned.q, axis=0))
    opened = replace(rig, controller=replace(rig.controller, loop="open"))
    assert commands(planned, opened).position == pytest.approx(planned.q)


def test_a_section_without_its_event_is_refused(tmp_path: Path) -> None:
    section = '[[section]]\nname = "1"\nuntil = "loss"\nnear_s = 50\n'
    campaign = short_campaign(tmp_path / "SHORT", 60.0, section)
    with pytest.raises(ConfigError, match="section 1 ends with 'loss'"):
        simulate_day(campaign, tmp_path / "out", samples=0, seed=0, progress=SilentProgress(), pdf=False)
    assert not (tmp_path / "out").exists()


def made_up(section: dict[str, Any], errors: tuple[float, float], torque: float) -> Section:
    """Return a section with 95 % errors, rad, and a torque in both bands, N m."""

    def one(axis: str, value: float) -> PointingEstimate:
        return PointingEstimate(
            axis=axis, bias=0.0, bias_sigma=0.0, random=value, random_sigma=0.0,
            percentile=value, percentile_sigma=0.0, orbit=0.0, greatest=value,
        )  # fmt: skip

    def greatest(label: str) -> Torque:
        return Torque(band="lt1Hz", label=label, value=torque, axis="Tx", time_s=0.0)

    return Section(
        **section,
        azimuth=one("az", errors[0]),
        elevation=one("el", errors[1]),
        torques=(greatest("up to 1 Hz"), greatest("up to 8 Hz")),
    )


def test_the_discussion_says_what_the_numbers_say() -> None:
    campaign = load_campaign(FOLDER, recordings=False)
    spans = ((0.0, 1500.0, ("tracking DRS59",), 1e-3), (1500.0, 1650.0, ("hand-over DRS44",), 2e-2))
    bare = [
        {"name": entry.name, "start_s": start, "end_s": end, "ends_with": entry.until, "modes": modes,
         "greatest_rate": rate, "published": PublishedSection(**entry.published.model_dump(), end_s=entry.near)}
        for entry, (start, end, modes, rate) in zip(load_day(campaign).sections, spans, strict=False)
        if entry.published is not None
    ]  # fmt: skip
    quiet = [made_up(one, (1e-4, 1e-4 / (1 + place)), 0.002) for place, one in enumerate(bare)]
    text = " ".join(discussion(campaign.rig, quiet))
    assert "They end -150 to +0 s" in text
    assert "takes 150 s; the table has 300 s" in text
    assert "ours reach 0.002 N m" in text and "ours are no bound for a flexible mast" in text
    loud = [made_up(one, (1e-4, 1e-4), 0.08) for one in bare]
    assert "no bound" not in " ".join(discussion(campaign.rig, loud))
    assert [*discussion(campaign.rig, [msgspec.structs.replace(one, published=None) for one in quiet])] == []
