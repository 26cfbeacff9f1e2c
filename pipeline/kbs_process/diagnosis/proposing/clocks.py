"""Clocks that are wrong by any time: what recordings would be by a right one, and the size of the error that says most.

To first order a clock that is late by more than a period of what rings seems to be late by little, or by nothing. So
sizes are tried: recordings are stamped anew by each, and what that leaves is looked at beside all known numbers.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.linalg import cho_solve
from scipy.ndimage import uniform_filter1d
from scipy.optimize import minimize_scalar

from kbs_process.diagnosis.experiments.stamps import SIZES, late_by, set_right
from kbs_process.diagnosis.nominal.known import Known
from kbs_process.diagnosis.screening.screen import Bench, Catalogued, Found, Suspect
from kbs_process.diagnosis.screening.shapes import bends, moved
from kbs_process.diagnosis.screening.signature import stamped
from kbs_process.estimation.bounded import bounded_minimum
from kbs_process.signals.records import Array

_LATEST = 0.25  # s, the greatest lateness of a recording that is tried
_NEARER = (0.5, 0.25, 0.25, 0.12)  # steps of a shape, up and down, from the best of its grid
_BETWEEN = 1.0  # s, on either side of a jump
_BESIDE = 11  # samples, over which what a prediction lacks beside that is a mean
_STEPS = 10  # of a search between two of them


def by_a_right_clock(suspect: Catalogued, known: Known, k: int, late: Array) -> tuple[Array, Array]:
    """A recording (n, c) stamped by a clock that is right, and what is left (rows,); `late` (n,) s is the clock's."""
    experiment, trial = known.experiment, known.experiment.trials[k]
    acted = stamped(suspect.candidate.site, experiment.channels, suspect.scene.hypothesis.rig)
    values, there = set_right(trial.measured[:, acted], trial.valid, experiment.dt, late)
    measured = trial.measured.copy()
    # Beside what is lost, and at the ends, by what is predicted.
    shown = known.shown[trial.drive].values[:, acted]
    instead = measured[:, acted] - late_by(shown, experiment.dt, late)
    measured[:, acted] = np.where(there[:, None], values, instead) * trial.valid[:, None]
    return measured, known.residual[k] + known.metric[k](measured - trial.measured)


def unread(suspect: Catalogued, known: Known, k: int, measured: Array) -> Array:
    """A recording (n, c) `measured`, where a clock is supposed to jump as it is predicted.

    What is read about a jump has a time between two, by whatever made the clock jump. What a prediction lacks before
    and after, as a bias, it lacks there. Of laws of clocks that do not jump, the recording as it is.
    """
    experiment, trial = known.experiment, known.experiment.trials[k]
    if not suspect.jumps:
        return measured
    t = experiment.dt * np.arange(len(measured))
    late = suspect.late(experiment.reference(trial.trajectory)).sum(axis=1)
    jumps = t[1:][np.diff(late) != 0.0]
    between = (np.abs(t[:, None] - jumps) < _BETWEEN).any(axis=1)
    there, shown = trial.valid & ~between, known.shown[trial.drive].values
    told = measured.copy()
    if not there.any():
        return told
    hidden = between & trial.valid
    for channel in stamped(suspect.candidate.site, experiment.channels, suspect.scene.hypothesis.rig):
        lacks = uniform_filter1d((measured - shown)[there, channel], _BESIDE, mode="nearest")
        told[hidden, channel] = shown[hidden, channel] + np.interp(t[hidden], t[there], lacks)
    return told


def timed(bench: Bench, found: Found, among: Sequence[Suspect]) -> Found:
    """A clock's law of one amplitude, at the shape `among` some and the size that leave least beside known numbers."""
    family = found.suspect.family
    grid = [one for one in among if isinstance(one, Catalogued) and one.family == family]
    nothing = height_of(bench, bench.background.z)
    suspect, late, height = min((_latest(bench, one) for one in grid), key=lambda one: one[2])
    ways = np.eye(len(bends(suspect.candidate, suspect.scene.hypothesis.rig)))
    for steps in _NEARER if len(ways) else ():
        near = [_latest(bench, moved(suspect, one * steps), late) for one in (*-ways, *ways)]
        suspect, late, height = min([(suspect, late, height), *near], key=lambda one: one[2])
    size = late / _greatest(_units(bench, suspect))
    gain = nothing - height
    if not gain > found.score.gain:
        return found
    score = replace(found.score, gain=gain, amplitude=np.array([size]), rank=1)
    return found.told_as(replace(suspect, size=size), score, bench.background.rows)


def _latest(bench: Bench, suspect: Catalogued, about: float | None = None) -> tuple[Catalogued, float, float]:
    """By how many s stamps are late at most where that leaves least, and the height that is.

    Near `about` as many; without that, all are tried.
    """
    references, units = _references(bench), _units(bench, suspect)
    most = _greatest(units)

    def height(late: float) -> float:
        left = {
            k: by_a_right_clock(suspect, bench.known, k, units[drive] * late / most)[1]
            for k, drive in references.items()
        }
        return height_of(bench, left)

    places = np.sort([0.0, *(size for size in SIZES if abs(size) <= _LATEST)])
    if about is not None:
        nearest = int(np.argmin(np.abs(places - about)))
        places = places[max(nearest - 1, 0) : nearest + 2]
    heights = [height(float(place)) for place in places]
    best = int(np.argmin(heights))
    low, high = places[max(best - 1, 0)], places[min(best + 1, len(places) - 1)]
    found = minimize_scalar(height, bounds=(low, high), method="bounded", options={"maxiter": _STEPS})
    late, least = min((float(found.x), float(found.fun)), (float(places[best]), heights[best]), key=lambda one: one[1])
    return suspect, late, least


def _references(bench: Bench) -> dict[int, int]:
    """Reference drive of each trial that is looked at."""
    experiment = bench.known.experiment
    return {k: experiment.reference(experiment.trials[k].trajectory) for k in bench.background.z}


def _units(bench: Bench, suspect: Catalogued) -> dict[int, Array]:
    """(n,) s by which stamps are late for a unit of a law's lone amplitude, by reference drive."""
    return {drive: suspect.late(drive)[:, 0] for drive in set(_references(bench).values())}


def _greatest(units: Mapping[int, Array]) -> float:
    return max(float(np.max(np.abs(unit))) for unit in units.values())


def height_of(bench: Bench, left: Mapping[int, Array]) -> float:
    """-2 log likelihood of residuals, all known numbers refitted to first order, beyond a constant."""
    background = bench.background
    pull = bench.known.precision * bench.known.offset
    for k, z in left.items():
        pull = pull + background.J[k].T @ z
    pull = background.scale * pull
    squares, bounded = float(sum(z @ z for z in left.values())), background.bounded
    if bounded is None:
        return squares - float(pull @ cho_solve(background.factor, pull))
    x = bounded_minimum(bounded.H, pull, bounded.low, bounded.high, bounded.at)
    return squares - float(2.0 * pull @ x - x @ bounded.H @ x)
