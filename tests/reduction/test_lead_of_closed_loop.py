"""A closed loop's command is compared with an encoder one latency old: the archive's antenna leads it by that much."""

from __future__ import annotations

import numpy as np
import pytest

from archived import campaign
from kbs_process.progress import SilentProgress
from kbs_process.reduction.preparing import prepare
from kbs_process.stages import decouple

CYCLE = 0.1  # s, which is DUMMY1's latency


@pytest.mark.slow
@pytest.mark.parametrize(
    ("repeat", "lead", "stated"),
    [
        pytest.param(0, 0.0, (11.9, 14.1), id="open"),
        pytest.param(1, 0.0, (36.1, 36.9), id="closed"),
        pytest.param(1, CYCLE, (13.4, 12.8), id="closed, lead taken off"),
    ],
)
def test_slow_tracking_is_alike_in_both_loops_but_for_the_lead(
    repeat: int, lead: float, stated: tuple[float, float]
) -> None:
    """Random error (2 sigma) of the encoder against the command `lead` s later, mdeg."""
    dummy = campaign("DUMMY1")
    entry = next(one for one in dummy.recordings if one.name == f"TRKL0000_{repeat + 1}")
    run = prepare(dummy, entry, decouple.fit(dummy.rig), SilentProgress()).run
    assert run.angle is not None and run.command is not None
    command = np.stack([np.interp(run.angle.t + lead, run.command.t, x) for x in run.command.values.T[:2]], axis=1)
    error = (run.angle.values - command)[50:-50]
    assert np.degrees(2e3 * error.std(axis=0)) == pytest.approx(stated, abs=0.06)
