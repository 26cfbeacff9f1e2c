"""What is needed of a hypothesis to try suspects on it, by trajectory: signals, linear plant, prediction."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np

from kbs_process.diagnosis.experiments.experiment import Experiment
from kbs_process.diagnosis.experiments.hypothesis import Hypothesis, Prediction, Tapped, acting, tapped
from kbs_process.diagnosis.screening.inlets import Inlet
from kbs_process.diagnosis.screening.transfer import Path, follow
from kbs_process.diagnosis.side_by_side import side_by_side
from kbs_process.plant.laws import select
from kbs_process.plant.rigid import poses
from kbs_process.rig.model import TRANSDUCER, Rig
from kbs_process.signals.frames import rotate
from kbs_process.signals.records import Array

_STEPS_HZ = 100.0  # of the linear plant, at least: what passes below the working rate is right to 1 % there


@dataclass(frozen=True, slots=True, eq=False)
class Course:
    """A link's way, from T's origin, in the undeflected T's axes."""

    R: Array  # (m, 3, 3)
    r: Array  # (m, 3) of its origin, m

    def of(self, point: Array) -> Array:
        """Position (m, 3) of a point (3,) that is given in the link's axes, m."""
        return np.asarray(self.r + self.R @ point, dtype=np.float64)


def courses(rig: Rig, tapped: Tapped) -> dict[str, Course]:
    """Those of the links that joints move."""
    columns = {name: k for k, name in enumerate(tapped.columns)}
    links = poses(rig, tapped.values[:, [columns[f"joint_angle.{name}"] for name in rig.joint_names]])
    T = links[TRANSDUCER]
    back = np.swapaxes(T.R, 1, 2)
    return {
        name: Course(back @ link.R, rotate(back, link.r - T.r))
        for name, link in links.items()
        if name in rig.joint_names
    }


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """A hypothesis along the reference drive of each trajectory; a rig that its motion drives has no linear plant."""

    experiment: Experiment
    hypothesis: Hypothesis
    predicted: Mapping[int, Prediction]  # by drive, of all drives
    signals: Mapping[int, Tapped]  # by drive, of references
    courses: Mapping[int, Mapping[str, Course]]  # of links, likewise
    paths: Mapping[int, Path]  # likewise

    @classmethod
    def of(
        cls, experiment: Experiment, hypothesis: Hypothesis, predicted: Mapping[int, Prediction], *, linear: bool = True
    ) -> Scene:
        """Tap the plant of a hypothesis; linearise it, if asked to, for what goes through. `predicted` by drive."""
        drives = [experiment.reference(trajectory) for trajectory in range(len(experiment.repeats))]
        every = side_by_side(partial(tapped, hypothesis, experiment), drives)
        signals = dict(zip(drives, every, strict=True))
        driven = [drive for drive in drives if linear and experiment.drives[drive].schedule is not None]
        paths = side_by_side(lambda drive: _path(experiment, hypothesis, signals[drive], drive), driven)
        ways = {drive: courses(hypothesis.rig, one) for drive, one in signals.items()}
        return cls(experiment, hypothesis, predicted, signals, ways, dict(zip(driven, paths, strict=True)))

    def stepped(self, drive: int, column: Mapping[Inlet, Array]) -> dict[Inlet, Array]:
        """Inputs at the taps' rate as means over the linear plant's steps; over samples, where there is no plant."""
        if drive not in self.paths:
            return dict(column)
        path, rate = self.paths[drive], self.signals[drive].rate
        count = self.experiment.drives[drive].n * round(path.rate * self.experiment.dt)
        return {inlet: rebinned(series, rate, path.rate, count) for inlet, series in column.items()}


def _path(experiment: Experiment, hypothesis: Hypothesis, signals: Tapped, drive: int) -> Path:
    working = 1.0 / experiment.dt
    decimation = max(1, int(np.ceil(_STEPS_HZ / working - 1e-9)))
    rate = working * decimation
    t = np.arange(experiment.drives[drive].n * decimation) / rate
    own = np.arange(len(signals.values)) / signals.rate
    taps = {name: np.interp(t, own, column) for name, column in zip(signals.columns, signals.values.T, strict=True)}
    return follow(hypothesis.rig, select(acting(hypothesis, experiment.drives[drive])), taps, rate)


def rebinned(means: Array, rate: float, target: float, count: int) -> Array:
    """Means over `count` intervals at `target` Hz of a series whose values are means over intervals at `rate` Hz.

    Exact: the integral of what is constant over an interval is linear between its ends; beyond the end it is held.
    """
    if rate == target and len(means) >= count:
        return means[:count]
    total = np.concatenate([[0.0], np.cumsum(means)]) / rate
    edges = np.arange(count + 1) / target
    last = len(means) / rate
    integral = np.interp(edges, np.arange(len(total)) / rate, total)
    integral += np.maximum(edges - last, 0.0) * means[-1]
    return np.asarray(np.diff(integral) * target, dtype=np.float64)
