"""What a verdict is made of: noise as measured, axes that are asked for, and what the campaign leaves out."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from kbs_process.campaign.load import load_campaign
from kbs_process.plant.rigid import loads
from kbs_process.progress import SilentProgress
from kbs_process.recordings.mcap.messages.encoding import OutStream
from kbs_process.recordings.mcap.writer import write_mcap
from kbs_process.stages.bandpass import Band, noise_bandwidth
from kbs_process.studies.correlate.run import process
from reduction.arm import described

pytestmark = pytest.mark.slow
RATE, SECONDS = 50, 60.0
TY = 4


def judged(
    folder: Path,
    *,
    noise: float = 1.0,
    shaken: dict[str, tuple[float, float]] | None = None,  # by recording: from when to when, s, at 0.1 N m
    dead: str = "",  # a recording in which the encoder stands still
    lost: str = "",  # "rows" or "numbers" that are missing, 2 % of all, and some in a row, at the same places
    text: tuple[str, str] = ("", ""),
) -> dict:
    """Results of the arm that is as described, `text` of its campaign.toml replaced."""
    rig, rng = described(folder).rig, np.random.default_rng(5)
    stamp = np.arange(int(SECONDS * RATE)) * 1_000_000_000 // RATE
    t, w = stamp * 1e-9, 2.0 * np.pi / 30.0
    moved = [0.6 - 0.6 * np.cos(w * t), 0.6 * w * np.sin(w * t), 0.6 * w**2 * np.cos(w * t)]
    for name in ("sweep", "test"):
        wrench = loads(rig, *(x[:, None] for x in moved))[:, :6]
        begin, end = (shaken or {}).get(name, (0.0, 0.0))
        wrench[:, TY] += 0.1 * np.sin(2.0 * np.pi * 0.5 * t) * ((begin <= t) & (t < end))
        wrench += noise * np.repeat([0.02, 0.002], 3) * rng.standard_normal(wrench.shape)
        angle = moved[0][:, None] * (name != dead)
        gone = np.random.default_rng(7).random(len(t)) < 0.02
        gone[1000:1002] = True
        wrench[gone & (lost == "numbers")] = np.nan
        kept = ~gone | (lost != "rows")
        streams = [
            OutStream("/transducer/wrench", "wrench", stamp[kept], stamp[kept], wrench[kept]),
            OutStream("/encoder", "joints", stamp, stamp, angle, ("arm",)),
        ]
        write_mcap(folder / f"{name}.mcap", streams)
    for file in (folder / "campaign.toml", folder / "rig.toml"):
        file.write_text(file.read_text().replace(*text) if text[0] else file.read_text())
    process(load_campaign(folder, checksums=False), folder / "out", progress=SilentProgress(), page=False)
    found: dict = json.loads((folder / "out" / "results.json").read_text())
    return found


def test_noise_that_is_more_than_stated_is_in_the_interval(tmp_path: Path) -> None:
    (row,) = [one for one in judged(tmp_path / "arm", noise=1.8)["budget"] if one["channel"] == "Ty"]
    (found,) = [one["sigma"] for one in row["contributions"] if one["source"].startswith("noise of")]
    stated = 0.002 * np.sqrt(2.0 * noise_bandwidth(Band("lt1Hz", 0.05, 1.0), 0.05) / RATE)
    assert found / stated == pytest.approx(1.8, rel=0.1)


@pytest.mark.parametrize(
    ("shaken", "text", "left_out"),
    [
        ({"test": (0.0, 15.0)}, ('role = "held-out"', 'role = "held-out"\nstart_s = 20'), "test before 20 s"),
        ({"sweep": (25.0, 40.0)}, ("", ""), "sweep (calibration)"),
    ],
)
def test_what_is_met_only_without_what_the_campaign_leaves_out_is_undecided(
    tmp_path: Path, shaken: dict[str, tuple[float, float]], text: tuple[str, str], left_out: str
) -> None:
    found = judged(tmp_path / "arm", shaken=shaken, text=text)
    assert found["verdict"]["status"] == "undecided"
    said = found["verdict"]["sentence"].split("The campaign leaves out ")[1]
    assert left_out in said and "By itself that is not met: peak 0.10" in said


def test_the_axes_that_are_judged_are_said_and_what_is_left_out_if_it_changes_the_verdict(tmp_path: Path) -> None:
    found = judged(tmp_path / "arm", text=('frame = "T"\n', 'frame = "T"\naxes = ["y"]\n'))
    assert found["verdict"]["sentence"].endswith("0.03 N m. Judged on y alone, as the requirement says.")
    (one,) = found["requirements"]
    assert [row["channel"] for row in one["channels"]] == ["Ty"]
    assert one["left_out"].startswith("The campaign leaves out sweep (calibration). By itself that is met: peak 0.00")


def test_a_fault_of_one_recording_says_nothing_of_another(tmp_path: Path) -> None:
    found = judged(tmp_path / "arm", dead="test", shaken={"sweep": (25.0, 40.0)})
    assert any("angle of arm is still in test" in one["what"] for one in found["warnings"])
    assert any("a calibration that is not at rest" in one["what"] for one in found["warnings"])


def test_what_a_dead_encoder_makes_is_told_once(tmp_path: Path) -> None:
    found = judged(tmp_path / "arm", dead="test")
    assert found["verdict"]["status"] == "undecided"
    told = [one["what"] for one in found["warnings"]]
    assert sum("the angle of arm is still in test" in one for one in told) == 1
    assert not any("unmodelled" in one for one in told)


@pytest.mark.parametrize("lost", ["rows", "numbers"])
def test_rows_that_a_logger_drops_leave_a_verdict(tmp_path: Path, lost: str) -> None:
    found = judged(tmp_path / "arm", shaken={"test": (0.0, 60.0)}, lost=lost)
    (one,) = found["requirements"]
    assert (one["verdict"], one["doubt"]) == ("fail", "")
    assert one["low"] < 0.1 < one["high"] and one["value"] == pytest.approx(0.1, rel=0.05)
    assert not any("in no figure" in notice["what"] for notice in found["warnings"])
