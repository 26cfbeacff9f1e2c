"""What units differ by over a short day, and what makes its torque above the bands."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from kbs_process.campaign.config import Campaign
from kbs_process.campaign.mission import load_day
from kbs_process.mission.planner import plan
from kbs_process.progress import SilentProgress
from kbs_process.results.records import load
from kbs_process.rig.model import substitute
from kbs_process.studies.reference_day.causes import without_each
from kbs_process.studies.reference_day.flying import fly
from kbs_process.studies.reference_day.results import ReferenceDayResults
from kbs_process.studies.reference_day.run import simulate_day
from kbs_process.studies.reference_day.units import draw_units, fly_days, spread, units_of
from studies.reference_day.test_reference_day import WHOLE, short_campaign, slewing

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def half_minute(tmp_path_factory: pytest.TempPathFactory) -> Campaign:
    return short_campaign(tmp_path_factory.mktemp("day") / "SHORT", 30.0, WHOLE)


def test_units_are_the_same_on_any_number_of_processes(half_minute: Campaign) -> None:
    day = load_day(half_minute)
    planned = plan(day.mission, day.lead)
    stiff = substitute(half_minute.rig, {"joint.el.drive.Ka": 1.2e4})
    rigs = [half_minute.rig, stiff]
    one, two = (fly_days(half_minute, day, planned, rigs, lambda _: None, count) for count in (1, 2))
    assert [found and found.sections for found in one] == [found and found.sections for found in two]
    assert one[0] is not None and one[1] is not None
    assert one[0].sections != one[1].sections


def test_what_diverges_is_left_out_and_counted(half_minute: Campaign) -> None:
    """A spring of 1e12 N m/rad has no finite solution at any step."""
    day = load_day(half_minute)
    wild = substitute(half_minute.rig, {"joint.el.drive.Ka": 1e12})
    reached = fly_days(half_minute, day, plan(day.mission, day.lead), [half_minute.rig, wild], lambda _: None, 1)
    found = units_of((), np.zeros((2, 0)), reached)
    assert (len(found.reached), found.failed) == (1, 1)


def test_the_draw_is_of_its_seed_and_leaves_the_alignment_alone(half_minute: Campaign) -> None:
    numbers, drawn = draw_units(half_minute, 5, 3)
    assert len(drawn) == 5 and not [one.name for one in numbers if "encoder" in one.name]
    assert np.array_equal(drawn, draw_units(half_minute, 5, 3)[1])
    assert not np.array_equal(drawn, draw_units(half_minute, 5, 4)[1])
    assert draw_units(half_minute, 1, 3)[1].shape == (0, len(numbers))


def test_a_spread_is_of_two_at_least() -> None:
    assert spread([1.0]) is None
    found = spread([1.0, 3.0])
    assert found is not None
    assert (found.mean, found.least, found.greatest) == (2.0, 1.0, 3.0)
    assert found.sigma == pytest.approx(2.0**0.5)


def test_every_figure_has_its_spread_and_its_cause(half_minute: Campaign, tmp_path: Path) -> None:
    outcome = simulate_day(
        half_minute, tmp_path / "out", samples=3, seed=1, progress=SilentProgress(), pdf=False, processes=1
    )
    found = load(tmp_path / "out", ReferenceDayResults)
    (section,) = found.sections
    assert (found.samples, found.failed, found.seed) == (3, 0, 1)
    assert section.azimuth_units is not None and section.elevation_units is not None
    for one in (section.azimuth_units, section.elevation_units, *(torque.units for torque in section.torques)):
        assert one is not None and one.least <= one.mean <= one.greatest and one.sigma > 0.0
    widest = section.torques[-1]
    assert widest.label == "up to 50 Hz" and widest.cause is not None
    assert widest.value > section.torques[-2].value > section.torques[0].value
    assert widest.cause.mode_Hz == pytest.approx(16.4, abs=0.6)
    assert widest.cause.frequency_Hz == pytest.approx(widest.cause.mode_Hz, rel=0.1)
    left = [one.value for one in widest.cause.without]
    assert len(left) == 6 and left == sorted(left) and 0.0 < left[0] < widest.rms < widest.value
    (peak,) = [one for one in found.requirements if one.unit == "N m"]
    assert peak.sigma > 0.0
    rows = pq.read_table(tmp_path / "out" / "tables" / "day" / "units.parquet")
    assert rows.num_rows == 3 and "joint.el.drive.Ka" in rows.column_names and "all.torque.lt1Hz" in rows.column_names
    page = outcome.report.read_text(encoding="utf-8")
    assert "What units differ by" in page and "Torque above the bands" in page


def test_cogging_rings_the_gear_where_its_line_meets_the_mode(half_minute: Campaign) -> None:
    """200 periods in a motor turn are 16.4 Hz, the gear's mode, at 0.295 deg/s of the output."""
    planned = slewing(60.0, np.radians(0.295))
    rms = {
        name: float(np.std(fly(replace(half_minute, rig=rig), planned, 60.0).torque.values[8000:]))
        for name, rig in {"nothing": half_minute.rig, **without_each(half_minute)}.items()
    }
    assert min(rms, key=lambda name: rms[name]) == "cogging"
    assert rms["cogging"] < 0.5 * rms["nothing"]
    assert rms["microsteps"] > 0.8 * rms["nothing"]


def test_what_is_left_out_is_all_that_can_be(half_minute: Campaign) -> None:
    changed = without_each(half_minute)
    assert [*changed] == [
        "microsteps", "codes of the encoders", "cogging", "motor viscous", "dynamic friction", "tooth stiction",
    ]  # fmt: skip
    assert float(changed["cogging"].quantities()["joint.az.drive.tcog"]) == 0.0
    assert float(changed["codes of the encoders"].joint("el").encoder.step) == 0.0  # type: ignore[union-attr]
    gone = replace(half_minute, effects=("synchronous_motor", "flexspline"))
    assert [*without_each(gone)] == ["microsteps", "codes of the encoders"]
