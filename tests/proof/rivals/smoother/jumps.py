"""When the clock of a stream seems to jump along each trajectory, by what its recordings show together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from kbs_process.diagnosis.experiments.hypothesis import Prediction
from kbs_process.diagnosis.experiments.jumps import jump
from kbs_process.plant.sensing import STREAMS
from proof.rivals.smoother.course import Course
from proof.rivals.smoother.problem import Problem


def place_jumps(problem: Problem, courses: Sequence[Course]) -> None:
    """Tell each recording the likeliest time, if no effect is known yet that rests on it."""
    if any(one.effect.jumps for one in problem.found):
        return
    trials = tuple(problem.experiment.trials[recording.trial] for recording in problem.recordings)
    own, shown = replace(problem.experiment, trials=trials), {}
    for trial, course in zip(trials, courses, strict=True):
        after = len(trial.valid) - len(course.shown)
        values = np.pad(course.shown, ((0, after), (0, 0)), mode="edge")
        shown[trial.drive] = Prediction(values, values[:, problem.wrench])
    for trial, recording in zip(trials, problem.recordings, strict=True):
        recording.jumps = {stream: jump(own, shown, trial.trajectory, stream) for stream in STREAMS}
