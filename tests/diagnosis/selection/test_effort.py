"""What a search may cost is counted alike on every machine, and ends it."""

from __future__ import annotations

from dataclasses import replace

import pytest

from diagnosis import bench
from kbs_process.diagnosis.selection import effort
from kbs_process.diagnosis.selection.effort import Effort
from kbs_process.identification.output_error import Scalar

pytestmark = pytest.mark.slow


def test_a_pass_is_every_motion_with_every_number_moved(monkeypatch: pytest.MonkeyPatch) -> None:
    made = bench.experiment(bench.rig(), ("fit", "held-out"), 3, seconds=20.0)
    known = bench.standing(made, (Scalar("joint.el.drive.Ka"), Scalar("joint.az.drive.Ka"))).known
    simulated = Effort(bench.serial(made), known)
    shown = simulated([(0, known.hypothesis)] * len(known.free))
    assert len(shown) == len(known.free)
    # There is one motion, and as many as four count.
    assert simulated.passes == pytest.approx(1.0 / 4.0)
    # A law more costs more.
    more = replace(known.hypothesis, effects=(*known.hypothesis.effects, known.hypothesis.effects[0]))
    simulated([(0, more)])
    own = len(known.hypothesis.effects)
    assert simulated.passes == pytest.approx((1.0 + (own + 1) / own / len(known.free)) / 4.0)
    monkeypatch.setattr(effort, "EFFORT", 0.5)
    assert simulated.goes_on() and not simulated.ended
    monkeypatch.setattr(effort, "EFFORT", 0.3)
    assert not simulated.goes_on() and simulated.ended
