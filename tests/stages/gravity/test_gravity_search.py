"""The search of the gravity fit ends in a few steps, at the edge of what bodies have and along valleys that bend."""

from __future__ import annotations

from pathlib import Path

import pytest

from kbs_process.progress import SilentProgress
from kbs_process.reduction.preparing import fit_gravity
from reduction.arm import described, drawn, recorded


@pytest.mark.parametrize("seed", [2, 3])
def test_an_arm_without_inertia_is_found_in_a_few_steps(tmp_path: Path, seed: int) -> None:
    """Moments are held at zero; the mass and its centre are known better together than either is."""
    campaign = described(tmp_path)
    model = fit_gravity(campaign, recorded(campaign, drawn(campaign, seed), seed), SilentProgress())
    converged = model.fit.checks[0]
    assert converged.passed
    assert int(converged.detail.split()[0]) < 8
