"""What tests of both makers of campaigns share."""

from __future__ import annotations

import pytest

from proof.concealed import paths, sensitivity


@pytest.fixture
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    """Trajectories of a few seconds, from the first instant on the move, and fewer parameters."""
    monkeypatch.setattr(sensitivity, "DRIVE", sensitivity.RUN_FRICTION)
    whole, calibration = paths.draw, paths.calibration

    def cut(*arguments: object) -> list[paths.Commands]:
        made = []
        for path in whole(*arguments):  # type: ignore[arg-type]
            late = path.t >= 20.0
            made.append(paths.Commands(path.t[late] - path.t[late][0], path.position[late], path.rate[late]).until(3.0))
        return made

    monkeypatch.setattr(paths, "draw", cut)
    monkeypatch.setattr(paths, "calibration", lambda rng: calibration(rng).until(3.0))
