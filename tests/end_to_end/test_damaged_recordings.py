"""EL089 with damaged recordings: processed, and the top of its report says what is lost, where, when and how much."""

from __future__ import annotations

import json
import re
import shutil
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from end_to_end import damage
from end_to_end.archive_run import Processed
from engine.campaigns import CAMPAIGNS_FOLDER
from kbs_process.campaign.load import load_campaign
from kbs_process.progress import SilentProgress
from kbs_process.recordings.mcap.source import open_recording
from kbs_process.studies.correlate.run import process

pytestmark = pytest.mark.slow

KEPT = 0.6  # share of the file that the recorder wrote
NOT_NUMBERS = (60.0, 60.5)  # s, in which Tz is NaN, then infinite
BACK = (120.0, 120.3)  # s, in which the transducer's clock is 2 s back
CHUNK = 5  # in which a bit is flipped


@dataclass(frozen=True)
class Damaged:
    """The processed campaign, and what was done to it."""

    campaign: Processed
    flipped: tuple[float, float]  # s after the recording's first message
    set_back: int  # messages whose stamp was
    page: str

    def warning(self, recording: str) -> str:
        """The notice of a recording's losses."""
        (what,) = [
            notice["what"]
            for notice in self.campaign.results["warnings"]
            if notice["where"] == recording and "lists each with its time" in notice["remedy"]
        ]
        return str(what)

    def losses(self, recording: str) -> list[dict[str, Any]]:
        (found,) = [entry["losses"] for entry in self.campaign.results["recordings"] if entry["name"] == recording]
        return list(found)


@pytest.fixture(scope="module")
def damaged(tmp_path_factory: pytest.TempPathFactory) -> Damaged:
    """The calibration whole, the fit recording cut short, and the held-out ones damaged within."""
    root = tmp_path_factory.mktemp("damaged")
    folder = root / "EL089"
    shutil.copytree(CAMPAIGNS_FOLDER / "EL089", folder)
    text = (folder / "campaign.toml").read_text()
    (folder / "campaign.toml").write_text(re.sub(r"^sha256.*\n", "", text, flags=re.MULTILINE))
    recordings = folder / "recordings"
    damage.cut_short(recordings / "EL089P00_1.mcap", KEPT)
    epoch = open_recording(recordings / "EL089P00_2.mcap").start_ns
    assert epoch is not None
    start, end = damage.flip_a_bit(recordings / "EL089P00_2.mcap", CHUNK)

    set_back = 0

    def spoil(t: float, payload: bytes) -> bytes:
        nonlocal set_back
        if NOT_NUMBERS[0] <= t < NOT_NUMBERS[1]:
            return damage.with_last_number(payload, np.nan if t < sum(NOT_NUMBERS) / 2 else -np.inf)
        if BACK[0] <= t < BACK[1]:
            set_back += 1
            return damage.with_earlier_stamp(payload, 2)
        return payload

    damage.alter(recordings / "EL089P00_3.mcap", "/transducer/wrench", spoil)
    outcome = process(load_campaign(folder), root / "results", progress=SilentProgress(), pdf=False)
    assert outcome.failed and "3 recordings with losses" in outcome.lines  # as --check says, whatever the verdict
    return Damaged(
        Processed("EL089", root / "results"),
        ((start - epoch) * 1e-9, (end - epoch) * 1e-9),
        set_back,
        outcome.report.read_text(encoding="utf-8"),
    )


def times(text: str) -> list[float]:
    """The times in a notice, s."""
    return [float(t) for t in re.findall(r"([\d.]+) s\b", text)]


def test_what_is_whole_has_no_warning(damaged: Damaged) -> None:
    assert damaged.losses("AZPS_ATA") == []


def test_a_recorder_that_lost_power(damaged: Damaged) -> None:
    """What is readable is used: the duration says how much that is, and the warning where the file ends."""
    what = damaged.warning("EL089P00_1")
    assert "truncated: 1, from" in what
    assert " s on" in what  # not: to where its last, broken chunk would have ended
    (entry,) = [one for one in damaged.campaign.results["recordings"] if one["name"] == "EL089P00_1"]
    assert 80.0 < entry["duration_s"] < 180.0
    assert times(what)[0] == pytest.approx(entry["duration_s"], abs=1.0)


def test_a_flipped_bit_costs_its_chunk_and_is_located(damaged: Damaged) -> None:
    what = damaged.warning("EL089P00_2")
    (loss,) = [one for one in damaged.losses("EL089P00_2") if one["kind"] in ("crc", "undecodable")]
    assert loss["start_s"] == pytest.approx(damaged.flipped[0], abs=0.05)
    assert loss["end_s"] == pytest.approx(damaged.flipped[1], abs=0.05)
    assert f"{loss['kind']}: 1, between {loss['start_s']:.1f} s and {loss['end_s']:.1f} s" in what
    valid = damaged.campaign.table("aligned/EL089P00_2")["valid"]
    length = damaged.flipped[1] - damaged.flipped[0]
    assert 0.9 * length < 0.05 * np.count_nonzero(~valid) < 2.0 * length + 2.0


def test_samples_that_are_no_numbers(damaged: Damaged) -> None:
    """Counted one by one, and no infinity spreads: everything that is valid is finite."""
    what = damaged.warning("EL089P00_3")
    assert "non-finite: 50" in what
    loss = next(one for one in damaged.losses("EL089P00_3") if one["kind"] == "non-finite")
    assert loss["start_s"] == pytest.approx(NOT_NUMBERS[0], abs=0.1)
    assert loss["end_s"] == pytest.approx(NOT_NUMBERS[1], abs=0.1)
    for name in ("aligned/EL089P00_3", "bands/EL089P00_3.lt1Hz"):
        table = damaged.campaign.table(name)
        for column, values in table.items():
            assert np.isfinite(values[table["valid"]]).all(), f"{name} {column}"


def test_a_clock_that_jumps_back(damaged: Damaged) -> None:
    """What is stamped with a time that was before is left out, and is a gap, with its time."""
    count = damaged.set_back
    assert count > 25
    what = damaged.warning("EL089P00_3")
    assert f"odd stamp: {count} of wrench, at {BACK[0]:.1f} s" in what
    assert f"gap: {count} of wrench, between {BACK[0]:.1f} s and {BACK[1]:.1f} s" in what


def test_every_warning_stands_at_the_top_of_the_report(damaged: Damaged) -> None:
    """Above everything but the verdict: before the first figure."""
    top = damaged.page[: damaged.page.index("<figure")]
    for recording in ("EL089P00_1", "EL089P00_2", "EL089P00_3"):
        assert damaged.warning(recording) in top
        assert recording in top


def test_results_are_numbers_all_the_same(damaged: Damaged) -> None:
    document = json.dumps(damaged.campaign.results, allow_nan=False)
    assert damaged.campaign.results["verdict"]["status"] in ("pass", "undecided")
    assert "Infinity" not in document
