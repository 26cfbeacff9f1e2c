"""Trajectories of a case: those of a trial, with azimuth at rest throughout or with hours of sweeps in the second."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from engine.trajectories import Axis, Commands, commands
from proof.concealed import paths
from proof.concealed.ranges import Split
from proof.odd.cases import Case


def driven(case: Case, split: Split, drawing: np.random.Generator, calibrating: np.random.Generator) -> list[Commands]:
    """Return all trajectories, the calibration last: path -1 of a run."""
    made = [*paths.draw(drawing, split, case.trajectories), paths.calibration(calibrating)]
    if case.long_h:
        made[1] = _hours(case.long_h)
    if case.azimuth_rests:
        made = [_azimuth_at(made[0].position[0, 0], path) for path in made]
    return made


def _azimuth_at(angle: float, path: Commands) -> Commands:
    position, rate = path.position.copy(), path.rate.copy()
    position[:, 0], rate[:, 0] = angle, 0.0
    return replace(path, position=position, rate=rate)


def _hours(hours: float) -> Commands:
    """Sweeps of both axes end to end; they get out of step, so that no two are alike."""
    az = _sweeps(Axis(-20.0).rest(2.0), 3600 * hours, 13.0, (0.9, -0.7), rest=4.0)
    el = _sweeps(Axis(55.0).rest(5.0), 3600 * hours, 14.0, (0.6, -0.4), rest=2.0)
    return commands(az, el, 3600 * hours)


def _sweeps(axis: Axis, seconds: float, half: float, peaks: tuple[float, ...], rest: float) -> Axis:
    """Rates to a peak (deg/s), through zero to its negative, to zero, again and again."""
    while axis.duration() < seconds:
        for peak in peaks:
            a = peak / half
            stretches = (half, a), (2 * half, -a), (half, a), (rest, 0.0)
            axis = replace(axis, stretches=(*axis.stretches, *stretches))
    return axis
