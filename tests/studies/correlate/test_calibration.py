"""What acts or drifts in a calibration is told, as others are held against what it leaves."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from kbs_process.progress import SilentProgress
from kbs_process.reduction.analysis import analyse
from kbs_process.reduction.preparing import fit_gravity
from kbs_process.studies.correlate.notices import calibration
from reduction.arm import described, drawn, recorded


@pytest.mark.parametrize(("size", "channels"), [(0.0, []), (0.05, ["Ty"])])
def test_a_disturbance_in_a_calibration_is_told(tmp_path: Path, size: float, channels: list[str]) -> None:
    campaign = described(tmp_path / "arm")
    recordings = recorded(campaign, drawn(campaign, 1), 1)
    sweep = recordings[0]
    assert sweep.run.wrench is not None
    values = sweep.run.wrench.values.copy()
    values[:, 4] += size * np.sin(2.0 * np.pi * 0.3 * sweep.run.wrench.t)
    recordings[0] = sweep = replace(sweep, run=replace(sweep.run, wrench=sweep.run.wrench.derive(values, "disturbed")))
    model = fit_gravity(campaign, recordings, SilentProgress())
    analysis = analyse(campaign, sweep.entry, sweep.raw, sweep.run, sweep.motion, model, lambda _: None)
    found = list(calibration([analysis], model))
    assert [one.what.split(" it leaves ")[1][:2] for one in found] == channels
    assert all(one.severity == "info" and one.where == "sweep" for one in found)
