"""The torque at the spacecraft from six channels at once, against the engine's own; and a cord that no file knows."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from archived import campaign
from end_to_end.archive_run import Processed
from end_to_end.truth import Truth
from kbs_process.signals.records import WRENCH_CHANNELS, WRENCH_UNITS, Array, Signal
from kbs_process.stages import bandpass
from kbs_process.stages.bandpass import Band
from kbs_process.stages.six_channels import together
from kbs_process.stages.to_cog import to_spacecraft

pytestmark = pytest.mark.slow

TORQUES = slice(3, 6)


def test_error_is_small_and_stated(archived: Callable[[str], Processed]) -> None:
    done = archived("EL089")
    run = list(Truth("EL089").runs())[1]
    table, motion = done.table(f"bands/{run.recording}.lt1Hz"), done.table(f"aligned/{run.recording}")
    t, rig = table["t"], campaign("EL089").rig
    assert rig.spacecraft is not None

    def signal(values: Array) -> Signal:
        dt = (t[-1] - t[0]) / (len(t) - 1)
        return Signal(t[0], dt, values, WRENCH_CHANNELS, WRENCH_UNITS, "T", table["valid"])

    totals = {
        b["channel"]: b["total"]
        for b in done.results["budget"]
        if (b["recording"], b["frame"], b["band"]) == (run.recording, "T", "lt1Hz")
    }
    measured = signal(np.stack([table[f"{channel}.measured"] for channel in WRENCH_CHANNELS], axis=1))
    q = np.stack([np.interp(t, motion["t"], motion[f"angle.{joint}"]) for joint in rig.joint_names], axis=1)
    sigma = np.array([totals[channel] for channel in WRENCH_CHANNELS])
    found = together(measured, q, sigma, rig, rig.spacecraft)
    true = to_spacecraft(bandpass.apply(signal(run.disturbance(t)), Band("lt1Hz", 0.01, 1.0)), rig.spacecraft)
    valid = measured.valid & true.valid
    error = (found.wrench.values - true.values)[valid][:, TORQUES]
    moved = (to_spacecraft(measured, rig.spacecraft).values - true.values)[valid][:, TORQUES]
    rms, before = (np.sqrt(np.mean(one**2, axis=0)) for one in (error, moved))
    inside = np.mean(np.abs(error) < 1.96 * found.sigma[TORQUES], axis=0)
    print(f"error {rms} N m rms, by moving alone {before}; inside {inside}")
    assert np.all(rms < 0.0015)
    assert np.all(before > 5.0 * rms)
    assert np.all((inside > 0.90) & (inside < 0.98))


def test_only_a_cord_that_no_file_knows_is_noticed(archived: Callable[[str], Processed]) -> None:
    for name, explained in (("EL089", True), ("AL012M00", False)):
        assert {one["explained"] for one in archived(name).results["six_channels"]} == {explained}
    assert archived("AL012_CORD").results.get("six_channels", []) == []


def test_the_verdict_is_by_six_channels_but_where_a_cord_pulls(archived: Callable[[str], Processed]) -> None:
    for name, counts in (("EL089", True), ("AL012M00", False), ("AL012_CORD", False)):
        assert archived(name).results["requirements"][0].get("together", False) is counts
