"""Sound campaigns get a verdict: arms, rates, noise and disturbances drawn, each within what its description says."""

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
from kbs_process.rig.model import Rig
from kbs_process.studies.correlate.run import process
from reduction.arm import described
from stages.gravity.synthetic import perturbed

SECOND = 1_000_000_000


def record(path: Path, rig: Rig, rng: np.random.Generator, seconds: float, disturbance: float) -> None:
    """Write the wrench of a swing, with a ripple of up to `disturbance` N m; now and then a sample is lost."""
    wrench_rate, encoder_rate = rng.choice([100, 250, 500, 1000]), rng.choice([50, 100, 200])
    period, offset = rng.uniform(20.0, 50.0), rng.uniform(-0.2, 0.2)
    frequency, phase = rng.uniform(0.1, 0.8), rng.uniform(0.0, 2.0 * np.pi)
    bias = rig.transducer.bias.sigma * rng.standard_normal(6)

    def motion(t: np.ndarray) -> tuple[np.ndarray, ...]:
        w = 2.0 * np.pi / period
        angle = offset + 0.6 - 0.6 * np.cos(w * t)
        return angle[:, None], 0.6 * w * np.sin(w * t)[:, None], 0.6 * w**2 * np.cos(w * t)[:, None]

    stamp = np.arange(int(seconds * wrench_rate)) * SECOND // wrench_rate
    t = stamp * 1e-9
    wrench = loads(rig, *motion(t))[:, :6]
    wrench[:, 4] += disturbance * np.sin(2.0 * np.pi * frequency * t + phase)
    wrench = wrench @ (np.eye(6) + rig.transducer.cross_coupling.value).T + bias
    wrench += np.repeat([0.02, 0.002], 3) * rng.standard_normal(wrench.shape)
    kept = rng.random(len(t)) > 1.0 / (60.0 * wrench_rate)
    turned = np.arange(int(seconds * encoder_rate)) * SECOND // encoder_rate
    angle = 2e-6 * np.round(motion(turned * 1e-9)[0] / 2e-6)
    write_mcap(
        path,
        [
            OutStream("/transducer/wrench", "wrench", stamp[kept], stamp[kept], wrench[kept]),
            OutStream("/encoder", "joints", turned, turned, angle, ("arm",)),
        ],
    )


def doubts(folder: Path, seed: int) -> str:
    """Why a sound campaign gets no verdict wherever its limit lies; empty if it gets one."""
    campaign, rng = described(folder), np.random.default_rng([45, seed])
    uncertain = (".mass", ".cog", ".tilt", ".misalignment", ".inertia", ".origin", ".cross_coupling")
    rig = perturbed(campaign.rig, rng, names=uncertain)
    for name, disturbance in (("sweep", 0.0), ("test", rng.uniform(0.0, 0.06))):
        record(folder / f"{name}.mcap", rig, rng, rng.uniform(90.0, 180.0), disturbance)
    process(load_campaign(folder, checksums=False), folder / "out", progress=SilentProgress(), page=False)
    found = json.loads((folder / "out" / "results.json").read_text())
    return "; ".join(one["doubt"] for one in found["requirements"] if one["doubt"])


@pytest.mark.slow
def test_a_sound_campaign_gets_a_verdict(tmp_path: Path) -> None:
    assert doubts(tmp_path / "arm", 1000) == ""


@pytest.mark.validation
def test_at_least_95_percent_of_sound_campaigns_get_a_verdict(tmp_path: Path) -> None:
    told = [doubts(tmp_path / str(seed), seed) for seed in range(100)]
    assert sum(why == "" for why in told) >= 95, [why for why in told if why]
