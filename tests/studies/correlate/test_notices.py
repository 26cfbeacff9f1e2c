"""What acts or drifts in a calibration is told, and so are readings that may be a knock."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import archived
from kbs_process.progress import SilentProgress
from kbs_process.reduction.analysis import analyse
from kbs_process.reduction.preparing import fit_gravity
from kbs_process.report.prose import Prose
from kbs_process.signals.records import Stretch
from kbs_process.studies.correlate.notices import calibration, unclear
from reduction.arm import described, drawn, recorded


@pytest.mark.slow
@pytest.mark.parametrize(("size", "channels"), [(0.0, []), (0.002, []), (0.004, ["Ty"]), (0.05, ["Ty"])])
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


def test_readings_that_may_be_a_knock_are_named() -> None:
    campaign = archived.campaign("EL089", recordings=False)
    requirement = SimpleNamespace(band_Hz=(0.01, 1.0))

    def told(*stretches: Stretch) -> str:
        run = SimpleNamespace(stretches=stretches, losses=(), load_rates=[100.0])
        prepared = [SimpleNamespace(entry=SimpleNamespace(name="test", trajectory="a"), run=run)]
        return unclear(campaign, prepared, requirement)

    assert told(Stretch("spike", 20.0, 0.03, likely=False), Stretch("gap", 30.0, 0.05, likely=True)) == ""
    assert told(Stretch("spike", 20.0, 0.03, likely=True)).endswith("may be bad ones: test at 20.0000 s")


@pytest.mark.parametrize(("driven", "said"), [(True, True), (False, False)])
def test_phases_of_drives_are_no_matter_where_none_is_modelled(driven: bool, said: bool) -> None:
    remedy = Prose("kbs_process.studies.correlate", "notices")("weak_prediction_remedy", driven=driven)
    assert remedy.startswith("see figures of merit") and ("cogging" in remedy) is said
