"""A hypothesis about the rig, and what it predicts of a trial: reduced exactly as the recording was."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TypedDict

import numpy as np

from kbs_process.diagnosis.experiments.experiment import Drive, Experiment
from kbs_process.errors import ConfigError, DivergenceError
from kbs_process.identification.output_error import Scalar, rig_at, values_of
from kbs_process.plant.compiled.simulation import Simulation
from kbs_process.plant.laws import select
from kbs_process.plant.moved import added_loads
from kbs_process.plant.predict import predict as simulate_plant
from kbs_process.plant.predict import predict_together as simulate_together
from kbs_process.plant.predict import simulation_of, step_for, tap_columns
from kbs_process.plant.rigid import loads as rigid_loads
from kbs_process.plant.structure import Structure
from kbs_process.rig.model import Rig
from kbs_process.signals.records import WRENCH_CHANNELS, Array
from kbs_process.stages.align.resample import resample
from kbs_process.stages.motion import Motion

# Hz: what a recording faster than this holds beyond its working rate, its amplifier's band and the mean over a step
# of the plant leave out of the working band.
FASTEST = 500.0
_STEPPED = 125.0  # Hz, for which the plant's step is made: the working band needs no finer one
SLOWEST_TAP = 100.0  # Hz; cogging at 0.3 deg/s of output is 17 Hz


@dataclass(frozen=True, slots=True, eq=False)
class Hypothesis:
    """The rig's numbers and the effects that act in it."""

    rig: Rig
    effects: tuple[str, ...]

    def at(self, free: Sequence[Scalar], values: Array) -> Hypothesis:
        """The same with some numbers at `values` (p,)."""
        return replace(self, rig=rig_at(self.rig, free, values))

    def values(self, free: Sequence[Scalar]) -> Array:
        """(p,) numbers as they are."""
        return values_of(self.rig, free)


@dataclass(frozen=True, slots=True, eq=False)
class Prediction:
    """What a hypothesis says of a drive, on its grid."""

    values: Array  # (n, c) the experiment's channels
    wrench: Array  # (n, 6) on the transducer, without cross-coupling


@dataclass(frozen=True, slots=True, eq=False)
class Tapped:
    """Signals inside the plant, on the drive's time axis from zero, faster than the working rate."""

    rate: float  # Hz
    columns: tuple[str, ...]  # as `plant.predict.tap_columns`
    values: Array  # (m, k)
    # (m, c) what the experiment's channels show of it, in the amplifier's whole band
    readings: Array | None = None


class _Rates(TypedDict):
    rate_Hz: float
    angle_rate_Hz: float
    duration_s: float
    step_s: float


Task = tuple[int, Hypothesis]  # drive
Simulate = Callable[[Sequence[Task]], list[Prediction]]  # in the order of the tasks, however they are shared out


def predict(hypothesis: Hypothesis, experiment: Experiment, drive: int) -> Prediction:
    """Predict what the experiment's channels show of a drive.

    Commands drive the plant, whose wrench and angles are sampled at the recorder's rates and brought to the working
    rate by the same filters as the recording. Measured motion drives the rigid bodies alone. A hypothesis whose
    plant diverges, or is none, predicts nan.
    """
    driven = experiment.drives[drive]
    if driven.schedule is None:
        wrench, rest = _moved(hypothesis, experiment, driven)
    else:
        try:
            wrench, angle = _driven(hypothesis, experiment, driven)
        except (DivergenceError, ConfigError):
            wrench, angle = _nowhere(experiment, driven)
        rest = angle[:, list(experiment.angle_joints)]
    return _shown(hypothesis, experiment, wrench, rest)


def predict_together(hypotheses: Sequence[Hypothesis], experiment: Experiment, drive: int) -> list[Prediction]:
    """As `predict` of each, to rounding: plants of one structure side by side, several times faster."""
    driven = experiment.drives[drive]
    if driven.schedule is None:
        return [predict(hypothesis, experiment, drive) for hypothesis in hypotheses]
    rate, angle_rate = _simulated(driven.wrench_rate), _simulated(driven.angle_rate)
    found: dict[int, tuple[Array, Array]] = {}
    alike: dict[Structure, list[tuple[int, Simulation]]] = {}
    for k, hypothesis in enumerate(hypotheses):
        try:
            simulation = simulation_of(
                hypothesis.rig,
                acting(hypothesis, driven),
                driven.schedule,
                **_rates(experiment, driven, rate, angle_rate),
            )
        except (DivergenceError, ConfigError):
            found[k] = _nowhere(experiment, driven)
            continue
        alike.setdefault(simulation.structure, []).append((k, simulation))
    for group in alike.values():
        shown = simulate_together([one for _, one in group], rate, _seconds(experiment, driven, rate, angle_rate))
        for (k, _), (wrench, angle) in zip(group, shown, strict=True):
            whole = np.isfinite(wrench).all() and np.isfinite(angle).all()
            found[k] = (
                _working(experiment, driven, wrench, rate, angle, angle_rate) if whole else _nowhere(experiment, driven)
            )
    joints = list(experiment.angle_joints)
    return [
        _shown(hypothesis, experiment, found[k][0], found[k][1][:, joints]) for k, hypothesis in enumerate(hypotheses)
    ]


def _shown(hypothesis: Hypothesis, experiment: Experiment, wrench: Array, rest: Array) -> Prediction:
    return Prediction(np.hstack([coupled(hypothesis.rig, experiment, wrench), rest]), wrench)


def _nowhere(experiment: Experiment, driven: Drive) -> tuple[Array, Array]:
    """What a plant shows that diverges, or is none."""
    return np.full((driven.n, 6), np.nan), np.full((driven.n, len(experiment.rig.joints)), np.nan)


def coupled(rig: Rig, experiment: Experiment, wrench: Array) -> Array:
    """(n, c) of a wrench (n, 6): read through the rig's cross-coupling X, decoupled by that of the files, X0.

    (I + X0)^-1 (I + X), the inverse over the recorded channels.
    """
    index = [WRENCH_CHANNELS.index(channel) for channel in rig.transducer.channels]
    read = (np.eye(6) + rig.transducer.cross_coupling.value)[index]
    read_values: Array = wrench @ (decoupling(experiment) @ read).T
    return read_values


def decoupling(experiment: Experiment) -> Array:
    """(c, c) (I + X0)^-1 over the recorded channels."""
    index = [WRENCH_CHANNELS.index(channel) for channel in experiment.rig.transducer.channels]
    X = experiment.rig.transducer.cross_coupling.value[np.ix_(index, index)]
    return np.asarray(np.linalg.inv(np.eye(len(index)) + X), dtype=np.float64)


def tapped(hypothesis: Hypothesis, experiment: Experiment, drive: int) -> Tapped:
    """Signals inside the plant along a drive, at the recorder's rate or at `SLOWEST_TAP`; a measured motion itself."""
    driven = experiment.drives[drive]
    if driven.motion is not None:
        return _motion_tapped(hypothesis.rig, driven.motion)
    rate = max(_simulated(driven.wrench_rate), SLOWEST_TAP)
    streams = _streams(hypothesis, experiment, driven, rate, rate, taps=True)
    wrench, angle, state = (np.concatenate(streams[name]) for name in ("wrench", "angle", "state"))
    m = min(len(wrench), len(angle))
    rest = angle[:m, list(experiment.angle_joints)]
    readings = np.hstack([coupled(hypothesis.rig, experiment, wrench[:m]), rest])
    return Tapped(rate, tap_columns(hypothesis.rig), state, readings)


def _motion_tapped(rig: Rig, motion: Motion) -> Tapped:
    """A measured motion as signals of a plant whose transmissions do not give."""
    ratio = np.array([1.0 if joint.drive is None else float(joint.drive.ratio) for joint in rig.joints])
    signals = {
        "rotor_angle": ratio * motion.q,
        "rotor_rate": ratio * motion.qd,
        "joint_angle": motion.q,
        "joint_rate": motion.qd,
    }
    columns = tuple(f"{signal}.{name}" for signal in signals for name in rig.joint_names)
    return Tapped(1.0 / motion.dt, columns, np.hstack(list(signals.values())))


def _simulated(rate: float) -> float:
    """The rate at which a stream is simulated: its own, or a whole part of it."""
    return rate / max(1.0, math.ceil(rate / FASTEST))


def _driven(hypothesis: Hypothesis, experiment: Experiment, drive: Drive) -> tuple[Array, Array]:
    rate, angle_rate = _simulated(drive.wrench_rate), _simulated(drive.angle_rate)
    streams = _streams(hypothesis, experiment, drive, rate, angle_rate, taps=False)
    wrench, angle = np.concatenate(streams["wrench"]), np.concatenate(streams["angle"])
    return _working(experiment, drive, wrench, rate, angle, angle_rate)


def _working(
    experiment: Experiment, driven: Drive, wrench: Array, rate: float, angle: Array, angle_rate: float
) -> tuple[Array, Array]:
    """Wrench and angles at the working rate."""
    working = 1.0 / experiment.dt
    return resample(wrench, rate, working)[: driven.n], resample(angle, angle_rate, working)[: driven.n]


def acting(hypothesis: Hypothesis, driven: Drive) -> list[str]:
    """Return the effects that act in a recording."""
    return [effect for effect in hypothesis.effects if effect not in driven.absent]


def _seconds(experiment: Experiment, driven: Drive, rate: float, angle_rate: float) -> float:
    return driven.n * experiment.dt + 1.0 / min(rate, angle_rate)


def _rates(experiment: Experiment, driven: Drive, rate: float, angle_rate: float) -> _Rates:
    """How a drive is simulated."""
    assert driven.schedule is not None
    start = tuple(driven.schedule.position[0])
    return {
        "rate_Hz": rate,
        "angle_rate_Hz": angle_rate,
        "duration_s": _seconds(experiment, driven, rate, angle_rate),
        "step_s": _step(experiment.rig, experiment.effects, start, min(rate, _STEPPED)),
    }


def _streams(
    hypothesis: Hypothesis, experiment: Experiment, drive: Drive, rate: float, angle_rate: float, *, taps: bool
) -> dict[str, list[Array]]:
    assert drive.schedule is not None
    streams: dict[str, list[Array]] = {"wrench": [], "angle": [], "field": [], "state": []}
    for key, block in simulate_plant(
        hypothesis.rig,
        acting(hypothesis, drive),
        drive.schedule,
        **_rates(experiment, drive, rate, angle_rate),
        quantise=False,
        taps=taps,
    ):
        streams[key].append(block.values)
    return streams


@lru_cache(maxsize=64)
def _step(rig: Rig, effects: tuple[str, ...], q: tuple[float, ...], rate: float) -> float:
    """The plant's step, s, for the files' rig: one that depends on what is fitted would make outputs jump."""
    return step_for(rig, select(effects), np.array(q), rate)


def _moved(hypothesis: Hypothesis, experiment: Experiment, driven: Drive) -> tuple[Array, Array]:
    """Wrench (n, 6) and the recorded efforts."""
    assert driven.motion is not None
    motion, rig = driven.motion, experiment.rig
    values = rigid_loads(hypothesis.rig, motion.q, motion.qd, motion.qdd)
    effects = select(acting(hypothesis, driven))
    values = values + added_loads(hypothesis.rig, effects, motion.q, motion.qd, motion.dt)
    efforts = rig.loads.index(rig.channels[experiment.wrench_channels :])
    return values[:, :6], values[:, efforts]
