"""A clock that is late at first and settles on the right time is one find, and the corrected model reads by it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import kbs_process
from end_to_end.test_order_of_a_motor_alone import CAMPAIGN, RIG
from kbs_process.recordings.mcap.messages.encoding import OutStream
from kbs_process.recordings.mcap.writer import write_mcap
from kbs_process.signals.records import Array

LATE, SETTLING, NOISE = 0.05, 7.0, 0.3  # s, s, N m
INERTIA, VISCOUS = 2.0, 12.0  # kg m^2, N m s/rad
KNOWN = {
    '0.0, 0.0, 0.01, 0.0, 0.0, 0.0], unit = "kg m^2", sigma = 0.0': (
        f'0.0, 0.0, {INERTIA}, 0.0, 0.0, 0.0], unit = "kg m^2", sigma = [0.0, 0.0, 1.0, 0.0, 0.0, 0.0]'
    ),
    "value = 0.02": f"value = {NOISE}",
    "[joint.m.encoder]": (
        f'viscous = {{ value = {VISCOUS}, unit = "N m s/rad", sigma = 4.0, source = "estimate" }}\n[joint.m.encoder]'
    ),
}


def angle(t: Array, phase: float) -> Array:
    """(n,) rad."""
    return np.asarray(1.2 * np.sin(1.3 * t + phase) + 0.2 * np.sin(4.6 * t))


@pytest.mark.slow
def test_a_clock_that_settles_is_one_find(tmp_path: Path) -> None:
    folder, rng = tmp_path / "motor", np.random.default_rng(5)
    folder.mkdir()
    rig = RIG
    for stated, own in KNOWN.items():
        assert stated in rig
        rig = rig.replace(stated, own)
    bands = CAMPAIGN.replace("[1.0]", "[10.0]").replace("working_rate_Hz = 10.0", "working_rate_Hz = 100.0")
    (folder / "campaign.toml").write_text(bands, encoding="utf-8")
    (folder / "rig.toml").write_text(rig, encoding="utf-8")
    stamp = np.arange(2500) * 10_000_000
    t = 1e-9 * stamp
    for role, phase in (("fit", 0.0), ("held-out", 0.7)):
        rate = np.gradient(angle(t, phase), t)
        effort = INERTIA * np.gradient(rate, t) + VISCOUS * rate + NOISE * rng.standard_normal(len(t))
        read = angle(t - LATE * np.exp(-t / SETTLING), phase)
        values = np.column_stack([read, np.zeros(len(t)), effort])
        write_mcap(folder / f"{role}.mcap", [OutStream("/motor", "joints", stamp, stamp, values, ("m",))])
    found = kbs_process.diagnose(kbs_process.load_campaign(folder, checksums=False), tmp_path / "out")
    (law,) = found.finds
    assert law.name == "clock_warmup"
    late = {one.name: one.value for one in law.parameters}
    scale = late["cold_skew"] * late["cold_time"]
    told = scale * (np.exp(-late["right_at"] / late["cold_time"]) - np.exp(-t / late["cold_time"]))
    # The effort's clock by the angle's: as early as this is late.
    np.testing.assert_allclose(told, -LATE * np.exp(-t / SETTLING), atol=0.1 * LATE)
    assert all(trial.corrected < 1.1 for trial in found.trials)
