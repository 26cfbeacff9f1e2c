"""Numbers of a rig that the smoother fits hold the truth to their sigmas, in noisy laboratories and a silent one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from kbs_process.campaign.load import load_campaign
from kbs_process.diagnosis.smoothing.problem import Problem
from kbs_process.diagnosis.smoothing.search import Fitted, settled
from kbs_process.progress import SilentProgress
from kbs_process.studies.diagnose.reading import experiment_of
from proof import coverage, record
from proof.concealed import trials
from proof.rivals.smoother import moved


@pytest.mark.validation
@pytest.mark.parametrize("index", [1, 2, 3])  # the first of them silent
def test_numbers_of_a_null_hold_the_truth_in_their_intervals(index: int, tmp_path: Path) -> None:
    spec = record.nulls()[index]
    trials.make(spec, tmp_path / "T")
    experiment = experiment_of(load_campaign(tmp_path / "T", checksums=False), SilentProgress())
    problem = Problem(experiment, list(experiment.fit))
    told = list(coverage.answered(moved(Fitted(problem, settled(problem))), *coverage.hardware(spec)))
    off = np.array([one.error / one.sigma for one in told])
    assert len(off) > 50
    assert np.sqrt(np.mean(off**2)) < 1.2
    assert np.mean(np.abs(off) < 1.96) >= 0.9
