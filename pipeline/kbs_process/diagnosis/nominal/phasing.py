"""Where to begin: resonances where they were measured, and the phases of cogging, friction and tooth contact.

Phases have no prior, and the likelihood has a minimum in every turn of each. The search of the identification is used
as it is, on the diagnosis's own metric above the frequencies at which masses and centres of gravity show.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kbs_process.diagnosis.experiments.experiment import Experiment
from kbs_process.diagnosis.experiments.floor import Floor
from kbs_process.diagnosis.experiments.hypothesis import Hypothesis, Simulate
from kbs_process.identification import output_error
from kbs_process.identification.output_error import Measured, Output, sensor_spectra
from kbs_process.identification.screening import Task, match_resonances, phases, starts
from kbs_process.identification.unknowns import gearbox
from kbs_process.signals.records import Array, Mask

LOWEST_HZ = 0.5
_TURN = 2.0 * np.pi  # rad of the motor: joints that turn less show no phases


def begin(experiment: Experiment, hypothesis: Hypothesis, floor: Floor, simulate: Simulate) -> Hypothesis:
    """Return the hypothesis to begin a refit at."""
    if experiment.drives[0].schedule is None or hypothesis.rig.transducer.stiffness is None:
        return hypothesis
    for used, joints in stages(experiment):
        hypothesis = _Stage(experiment, floor, simulate, used, joints).search(hypothesis)
    return hypothesis


def stages(experiment: Experiment) -> list[tuple[tuple[int, ...], tuple[str, ...]]]:
    """Trials, one a trajectory, and the joints that they turn; calibrations for joints that nothing else turns.

    None where a measured motion takes the place of motors.
    """
    if experiment.drives[0].schedule is None:
        return []
    left = np.array([joint.drive is not None for joint in experiment.rig.joints])
    stages = []
    for calibration in (False, True):
        used: dict[int, int] = {}
        turned = np.zeros(len(left), dtype=np.bool_)
        for k in experiment.fit:
            trial = experiment.trials[k]
            turns = _turns(experiment, trial.drive) & left
            if (trial.role == "calibration") == calibration and turns.any():
                used.setdefault(trial.trajectory, k)
                turned |= turns
        left &= ~turned
        if used:
            names = np.array(experiment.rig.joint_names)[turned]
            stages.append((tuple(used.values()), tuple(str(name) for name in names)))
    return stages


def _turns(experiment: Experiment, drive: int) -> Mask:
    """(joints,) whose motors turn."""
    schedule = experiment.drives[drive].schedule
    assert schedule is not None
    return np.asarray(np.ptp(schedule.position, axis=0) * _ratios(experiment) > _TURN, dtype=np.bool_)


class _Stage:
    """The search of some joints' phases in some trials."""

    def __init__(
        self, experiment: Experiment, floor: Floor, simulate: Simulate, used: tuple[int, ...], joints: tuple[str, ...]
    ) -> None:
        self.experiment, self.floor, self.simulate, self.used = experiment, floor, simulate, used
        self.prefixes = tuple(f"joint.{name}.drive." for name in joints)
        self.recordings = tuple(_measured(experiment, k) for k in used)
        self.calibrations = all(experiment.trials[k].role == "calibration" for k in used)

    def search(self, hypothesis: Hypothesis) -> Hypothesis:
        experiment = self.experiment
        gears = gearbox(hypothesis.rig, hypothesis.effects)
        own = self.prefixes if self.calibrations else (*self.prefixes, "transducer.")
        free = tuple(scalar for scalar in gears if scalar.name.startswith(own))
        coarse = output_error.Experiment(hypothesis.rig, hypothesis.effects, free, self.recordings, LOWEST_HZ)
        if not phases(hypothesis.rig, hypothesis.effects, free):
            return hypothesis
        spectra = [sensor_spectra(coarse, recording) for recording in self.recordings]
        place = {recording.name: k for recording, k in zip(self.recordings, self.used, strict=True)}

        def run(_: output_error.Experiment, recording: Measured, values: Array) -> Output:
            drive = experiment.trials[place[recording.name]].drive
            found = self.simulate([(drive, hypothesis.at(free, values))])[0]
            return Output(found.wrench, found.values[:, experiment.wrench_channels :])

        drives = [experiment.trials[k].drive for k in self.used]
        paths = self.simulate([(drive, hypothesis) for drive in drives])
        whiteners = [
            self.floor.whitener(experiment.trials[k], path.values, LOWEST_HZ)
            for k, path in zip(self.used, paths, strict=True)
        ]

        def evaluate(tasks: Sequence[Task]) -> list[Array]:
            found = self.simulate([(drives[index], hypothesis.at(free, values)) for index, values, _ in tasks])
            return [
                whiteners[index](experiment.trials[self.used[index]].measured - prediction.values)
                for (index, _, _), prediction in zip(tasks, found, strict=True)
            ]

        values = hypothesis.values(free)
        if not self.calibrations:
            values = match_resonances(coarse, values, spectra, run)
        (start,) = starts(coarse, values, spectra, evaluate, 1)
        return hypothesis.at(free, start.values)


def _ratios(experiment: Experiment) -> Array:
    return np.array([float(joint.drive.ratio) if joint.drive else 0.0 for joint in experiment.rig.joints])


def _measured(experiment: Experiment, k: int) -> Measured:
    trial = experiment.trials[k]
    drive = experiment.drives[trial.drive]
    assert drive.schedule is not None
    wrench = experiment.wrench_channels
    return Measured(
        name=trial.name,
        dt=experiment.dt,
        wrench=trial.measured[:, :wrench],
        angle=np.interp(np.arange(drive.n) * experiment.dt, drive.schedule.t, drive.schedule.position[:, 0])[:, None]
        if wrench == trial.measured.shape[1]
        else trial.measured[:, wrench:],
        valid=trial.valid,
        schedule=drive.schedule,
        wrench_rate=trial.wrench_rate,
        angle_rate=trial.angle_rate,
        clock_sigma=trial.wrench_clock_sigma,
        angle_clock_sigma=trial.angle_clock_sigma,
    )
