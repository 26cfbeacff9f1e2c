"""Laws at their size, where what one does is another thing at every size: springs in the way of torque or wrench.

Where the plate slips or stiffens, it rings elsewhere, and longer or shorter than without; bristles hold a joint, and a
gear winds up otherwise. Along the motion of a plant that has none of it such a law promises little, and a search that
begins with little creeps. So sizes are tried in the plant, and what each leaves is looked at beside all known numbers.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from kbs_process.diagnosis.experiments.hypothesis import Hypothesis, Simulate
from kbs_process.diagnosis.proposing.clocks import height_of
from kbs_process.diagnosis.proposing.tryout import inserted
from kbs_process.diagnosis.proposing.view import View
from kbs_process.diagnosis.screening.screen import Bench, Catalogued, Found, Suspect
from kbs_process.plant.effect import Effect, Port
from kbs_process.signals.records import Array

# What the law makes of the present motion, rms over rms: of what the moment about an axis varies by, the weight's along
# the pose included, and of what a gear's torque does, where nothing sticks.
_OF_MOMENT = (0.01, 0.03, 0.1, 0.3, 1.0)
_OF_GEAR = (0.03, 0.1, 0.3, 1.0, 3.0)


def of_mounting(found: Found) -> bool:
    """Whether it acts on the plate by how the plate itself turns."""
    return isinstance(found.suspect, Catalogued) and found.suspect.candidate.port is Port.BASE_TORQUE


def in_the_way(suspect: Suspect) -> bool:
    """Whether it is a spring between a rotor and what it turns: bristles where they stick, a gear as it winds up."""
    if not (isinstance(suspect, Catalogued) and len(suspect.amplitudes) == 1):
        return False
    law, port = suspect.candidate.effect, suspect.candidate.port
    if not isinstance(law, Effect) or port not in (Port.TRANSMISSION, Port.JOINT_TORQUE):
        return False
    return bool(law.states) or (port is Port.TRANSMISSION and "joint_angle" in law.arguments)


def springs(view: View, simulate: Simulate, among: Callable[[Found], bool]) -> list[Found]:
    """Springs in the way at the size that does most, in the plant or to first order, the best first."""
    every = [found for found in view.screening.candidates if in_the_way(found.suspect)]
    tried = [sized(view.bench, found, view.suspects, simulate) for found in every]
    return sorted((found for found in tried if among(found)), key=lambda found: -found.score.gain)


def sized(bench: Bench, found: Found, among: Sequence[Suspect], simulate: Simulate) -> Found:
    """A law at one place, at the shape `among` some and the size that leave least, if less than it.

    Beside known numbers that are refitted to first order.
    """
    family = found.suspect.family
    grid = [one for one in among if isinstance(one, Catalogued) and one.family == family]
    tried = [(one, amplitudes) for one in grid for amplitudes in _amplitudes(bench, one)]
    if not tried:
        return found
    present = bench.scene.hypothesis
    models = [
        inserted(one.candidate, dict(zip(one.amplitudes, map(float, a), strict=True)), present) for one, a in tried
    ]
    heights = _heights(bench, models, simulate)
    nothing = height_of(bench, bench.background.z)
    best = int(np.argmin(heights))
    gain = nothing - heights[best]
    if not gain > found.score.gain:
        return found
    suspect, amplitude = tried[best]
    score = replace(found.score, gain=gain, amplitude=amplitude, rank=1)
    return found.told_as(suspect, score, bench.background.rows)


def _heights(bench: Bench, models: list[Hypothesis], simulate: Simulate) -> list[float]:
    """What each model leaves; infinite for a plant that diverged."""
    experiment, known = bench.known.experiment, bench.known
    references = {k: experiment.reference(experiment.trials[k].trajectory) for k in bench.background.z}
    drives = sorted(set(references.values()))
    shown = iter(simulate([(drive, model) for model in models for drive in drives]))
    heights = []
    for _ in models:
        changes = {drive: next(shown).values - bench.scene.predicted[drive].values for drive in drives}
        left = {k: bench.background.z[k] - known.metric[k](changes[drive]) for k, drive in references.items()}
        height = height_of(bench, left) if all(np.isfinite(one).all() for one in changes.values()) else np.inf
        heights.append(float(np.nan_to_num(height, nan=np.inf)))
    return heights


def _amplitudes(bench: Bench, suspect: Catalogued) -> Iterator[Array]:
    """(m,) one amplitude after the other at all sizes; either way, where it may have both signs."""
    mounted = suspect.candidate.port is Port.BASE_TORQUE
    columns = [column for drive in bench.scene.paths for column in [suspect.inputs(drive)] if column is not None]
    for index, entry in enumerate(suspect.candidate.amplitudes):
        units: dict[str, float] = {}
        for column in columns:
            for inlet, values in column[index].items():
                units[inlet.axis] = float(np.hypot(units.get(inlet.axis, 0.0), np.std(values)))
        if not units:
            continue  # motion that is given, or has been measured, goes through no plant
        axis = max(units, key=lambda one: units[one])
        whole = _moment(bench, f"T{axis}") if mounted else _through(bench, suspect.candidate.site)
        if not (units[axis] > 0.0 and whole > 0.0):
            continue
        for share in _OF_MOMENT if mounted else _OF_GEAR:
            for sign in (1.0,) if entry.dry or entry.bounds[0] >= 0.0 else (1.0, -1.0):
                amplitude = np.zeros(len(suspect.amplitudes))
                amplitude[index] = sign * share * whole / units[axis]
                yield amplitude


def _moment(bench: Bench, channel: str) -> float:
    """What varies of a channel in all references together, rms; 0 where it is none."""
    experiment = bench.known.experiment
    if channel not in experiment.channels:
        return 0.0
    place = experiment.channels.index(channel)
    values = [bench.scene.predicted[drive].values[:, place] for drive in bench.scene.paths]
    return float(np.sqrt(np.sum([np.var(one) for one in values])))


def _through(bench: Bench, joint: str) -> float:
    """What varies of the torque through a joint's gear in all references, rms, N m; 0 where none is elastic."""
    drive = bench.scene.hypothesis.rig.joint(joint).drive
    if drive is None or "Ka" not in drive.parameters:
        return 0.0
    square = 0.0
    for signals in bench.scene.signals.values():
        column = dict(zip(signals.columns, signals.values.T, strict=True))
        square += float(np.var(column[f"rotor_angle.{joint}"] / float(drive.ratio) - column[f"joint_angle.{joint}"]))
    return float(drive.parameters["Ka"]) * float(np.sqrt(square))
