"""The flight prediction as a user runs it, and physics that it must respect."""

import json
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from click.testing import CliRunner

from kbs_process.campaign.load import load_campaign
from kbs_process.cli import cli
from kbs_process.errors import ConfigError
from kbs_process.results.parallel import ordered_map
from kbs_process.rig.model import substitute
from kbs_process.studies.flight.unit import Job, Judged, fly, in_orbit

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[3]
SLEW = "t,az,el\n" + "\n".join(
    f"{t:.1f},0.0,{1.2 + 0.1 * (1 - np.cos(np.pi * min(t, 30.0) / 30.0)):.9f}" for t in np.arange(0.0, 130.0, 0.1)
)


def fly_slew(folder: Path, *options: str) -> str:
    table = folder / "slew.csv"
    table.write_text(SLEW)
    words = ["flight", str(ROOT / "campaigns" / "EL089"), "--command", str(table), "--no-pdf", "-q", *options]
    done = CliRunner().invoke(cli, words, catch_exceptions=False)
    assert done.exit_code == 0, done.output
    return done.output


def test_results_of_one_seed_are_the_same_bytes_and_complete(tmp_path):
    for name in ("a", "b"):
        said = fly_slew(tmp_path, "--samples", "6", "--seed", "3", "--output", str(tmp_path / name))
        assert "with a probability of" in said
    assert (tmp_path / "a" / "results.json").read_bytes() == (tmp_path / "b" / "results.json").read_bytes()
    results = json.loads((tmp_path / "a" / "results.json").read_text())
    assert results["kind"] == "flight"
    assert results["samples"] == 6
    assert results["verdict"]["status"] == "undecided"  # six units bound nothing
    units = pq.read_table(tmp_path / "a" / "tables" / "flight" / "units.parquet")
    assert units.num_rows == 6
    peaks = np.max([units[f"0.{channel}.peak"].to_numpy() for channel in ("Tx", "Ty", "Tz")], axis=0)
    worst = results["requirements"][0]["worst"]
    assert worst["greatest"] == pytest.approx(peaks.max())
    assert 0.0 < worst["q05"] < worst["q95"]
    pointing = {one["statistic"]: one for one in results["requirements"] if one["quantity"] == "pointing"}
    assert pointing["bias"]["limit"] == pytest.approx(0.066)
    assert pointing["bias"]["unit"] == "deg"
    # Wind-up of the gear by friction and its own acceleration: far below a limit, far above nothing.
    assert 1e-6 < pointing["percentile"]["worst"]["median"] < 0.044
    html = (tmp_path / "a" / "index.html").read_text()
    assert "Probability of meeting" in html
    assert "flight motor-gear and antenna" in html


def test_the_number_of_processes_changes_nothing():
    assert list(ordered_map(abs, [-3, 2, -1], lambda _: None, processes=2)) == [3, 2, 1]
    assert list(ordered_map(abs, [-3, 2, -1], lambda _: None, processes=1)) == [3, 2, 1]


def test_a_slow_slew_in_orbit_costs_what_the_inertia_does():
    """T_y = -I d2(elevation)/dt2 at T, to which friction adds nothing: it is internal."""
    from kbs_process.campaign.config import Requirement
    from kbs_process.plant.predict import Schedule
    from kbs_process.reduction.analysis import bands_of

    campaign = load_campaign(ROOT / "campaigns" / "EL089", checksums=False, flight=True)
    balanced = {"body.antenna.cog": np.zeros(3), "body.antenna.inertia": np.array([0.7, 0.9, 0.8, 0, 0, 0])}
    rig = in_orbit(substitute(campaign.rig, balanced))
    t = np.arange(0.0, 140.0, 0.1)
    omega = 2 * np.pi / 40.0
    elevation = 1.2 + 0.1 * np.cos(omega * t)
    schedule = Schedule(t, np.stack([0 * t, elevation], axis=1), np.stack([0 * t, -0.1 * omega * np.sin(omega * t)], 1))
    requirement = Requirement("torque", "torque", "T", "rms", 1.0, "N m", (0.01, 1.0), "test")
    band = next(band for band in bands_of(campaign.bands) if band.name == "lt1Hz")
    job = Job(rig, campaign.effects, schedule, 140.0, 20.0, (Judged(requirement, band, ("Tx", "Ty", "Tz")),))
    flown = fly(job)
    assert flown is not None
    Tx, Ty, Tz = flown.statistics[0]
    reaction = (0.9 + 2e-5 * 101) * 0.1 * omega**2 / np.sqrt(2)  # the rotor turns a hundred times, one way
    assert Ty == pytest.approx(reaction, rel=0.05)
    assert max(Tx, Tz) < 0.02 * Ty


def test_a_campaign_without_a_flight_model_says_what_to_add():
    with pytest.raises(ConfigError, match=r"\[flight\]"):
        load_campaign(ROOT / "campaigns" / "AESING00", checksums=False, flight=True)
