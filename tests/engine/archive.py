"""Make the archive: recordings, their checksums, and the truth behind them.

Campaign folders hold everything that a user of the pipeline has: descriptions, nominal parameters
with their sigmas, recordings. What was drawn goes to tests/archive/truth, out of the pipeline's sight.
"""

from __future__ import annotations

import hashlib
import json
import re
from pathlib import Path
from typing import Any

import numpy as np

from engine.campaigns import CAMPAIGNS, Campaign
from engine.mcap_file import write
from engine.sensors import Recording, record
from engine.trajectories import TRAJECTORIES, Commands

TRUTH_FOLDER = Path(__file__).resolve().parents[1] / "archive" / "truth"

DAY_NS = 86_400_000_000_000
FIRST_DAY_NS = 803_206_800_000_000_000  # 1995-06-15 09:00 UTC
RUN_NS = 1_800_000_000_000  # half an hour from run to run


def make(campaign: Campaign, index: int, commands: Commands | None = None) -> Recording:
    """Simulate and record one run; `commands` other than its trajectory's make a shorter one."""
    run = campaign.runs[index]
    hardware = campaign.hardware()
    cord = hardware.cord() if run.hung else run.bungee
    recording = record(
        hardware.with_values({"bungee": cord, "loop": run.loop or hardware.loop}),
        TRAJECTORIES[run.trajectory]() if commands is None else commands,
        seed=1000 * campaign.seed + index,
        epoch_ns=FIRST_DAY_NS + campaign.day * DAY_NS + index * RUN_NS,
        wrench_hz=run.wrench_hz,
        encoder_hz=run.encoder_hz,
        laboratory=campaign.laboratory,
        encoders=campaign.encoders,
        over_a_turn=campaign.over_a_turn(),
    )
    for stream, start, end in run.gaps:
        recording = recording.with_gap(stream, start, end)
    return recording


def archive(name: str, index: int) -> dict[str, Any]:
    """Make one run, write its file, and return what is true of it."""
    campaign = CAMPAIGNS[name]
    run = campaign.runs[index]
    recording = make(campaign, index)
    path = campaign.folder / "recordings" / run.file
    path.parent.mkdir(parents=True, exist_ok=True)
    write(path, recording, run.form)
    article = campaign.hardware()
    differing = {
        key: value.tolist()
        for key, value in recording.hardware.values.items()
        if not np.array_equal(value, article[key])
    }
    return {
        "file": run.file,
        "hardware_in_this_run": differing,
        "drift": recording.drift.tolist(),
        "wrench_clock": recording.wrench_clock._asdict(),
        "encoder_clock": recording.encoder_clock._asdict(),
        "bungee": None if (cord := recording.hardware.bungee) is None else cord.as_dict(),
    }


def finish(campaign: Campaign, runs: list[dict[str, Any]]) -> None:
    """Write the campaign's truth, and its recordings' checksums into campaign.toml."""
    article = campaign.hardware()
    truth = {
        "campaign": campaign.name,
        "seed": campaign.seed,
        "hardware": {key: value.tolist() for key, value in article.values.items()},
        "recordings": runs,
    }
    if (drawn := campaign.over_a_turn()) is not None:
        truth["encoders over a turn"] = drawn.tolist()
    TRUTH_FOLDER.mkdir(parents=True, exist_ok=True)
    text = json.dumps(truth, indent=1)
    text = re.sub(r"\[[\s\d.,eE+-]+\]", lambda numbers: " ".join(numbers[0].split()), text)
    (TRUTH_FOLDER / f"{campaign.name}.json").write_text(text + "\n")
    description = campaign.folder / "campaign.toml"
    text = description.read_text()
    for run in campaign.runs:
        digest = checksum(campaign.folder / "recordings" / run.file)
        entry = rf'(file = "recordings/{re.escape(run.file)}"\n)(sha256 = "\w*"\n)?'
        text, count = re.subn(entry, rf'\1sha256 = "{digest}"\n', text)
        if count != 1:
            raise ValueError(f"{description} lists {run.file} {count} times")
    description.write_text(text)


def checksum(path: Path) -> str:
    """SHA-256 of a file."""
    return hashlib.sha256(path.read_bytes()).hexdigest()
