"""A hypothesis about the rig, and what it predicts of a trial: reduced exactly as the recording was."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from kbs_process.diagnosis.experiment import Drive, Experiment
from kbs_process.errors import ConfigError, DivergenceError
from kbs_process.plant.effects import select
from kbs_process.plant.moved import added_loads
from kbs_process.plant.predict import predict as simulate_plant
from kbs_process.plant.predict import step_for, tap_columns
from kbs_process.plant.rigid import loads as rigid_loads
from kbs_process.rig.model import Rig, substitute
from kbs_process.signals.records import WRENCH_CHANNELS, Array
from kbs_process.stages.motion import Motion
from kbs_process.stages.output_error import Scalar
from kbs_process.stages.resample import resample

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
        quantities = self.rig.quantities()
        new: dict[str, Array | float] = {}
        for scalar, value in zip(free, values, strict=True):
            whole = np.array(new.get(scalar.quantity, quantities[scalar.quantity].value))
            whole[scalar.element] = value
            new[scalar.quantity] = whole
        return replace(self, rig=substitute(self.rig, new))

    def values(self, free: Sequence[Scalar]) -> Array:
        """(p,) numbers as they are."""
        quantities = self.rig.quantities()
        return np.array([float(quantities[s.quantity].value[s.element]) for s in free])


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


Task = tuple[int, Hypothesis]  # drive
Simulate = Callable[
    [Sequence[Task]], list[Prediction]
]  # in the order of the tasks, however they are shared out


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
            wrench, angle = (
                np.full((driven.n, 6), np.nan),
                np.full((driven.n, len(experiment.rig.joints)), np.nan),
            )
        rest = angle[:, list(experiment.angle_joints)]
    return Prediction(np.hstack([coupled(hypothesis.rig, experiment, wrench), rest]), wrench)


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
    blocks = _streams(hypothesis, experiment, driven, rate, rate, taps=True)["state"]
    return Tapped(rate, tap_columns(hypothesis.rig), np.concatenate(blocks))


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
    working = 1.0 / experiment.dt
    wrench = resample(np.concatenate(streams["wrench"]), rate, working)[: drive.n]
    angle = resample(np.concatenate(streams["angle"]), angle_rate, working)[: drive.n]
    return wrench, angle


def _streams(
    hypothesis: Hypothesis,
    experiment: Experiment,
    drive: Drive,
    rate: float,
    angle_rate: float,
    *,
    taps: bool,
) -> dict[str, list[Array]]:
    assert drive.schedule is not None
    step = _step(experiment.rig, experiment.effects, tuple(drive.schedule.position[0]), min(rate, _STEPPED))
    streams: dict[str, list[Array]] = {"wrench": [], "angle": [], "field": [], "state": []}
    for key, block in simulate_plant(
        hypothesis.rig,
        [effect for effect in hypothesis.effects if effect not in drive.absent],
        drive.schedule,
        rate_Hz=rate,
        angle_rate_Hz=angle_rate,
        duration_s=drive.n * experiment.dt + 1.0 / min(rate, angle_rate),
        step_s=step,
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
    acting = select([effect for effect in hypothesis.effects if effect not in driven.absent])
    values = values + added_loads(hypothesis.rig, acting, motion.q, motion.qd, motion.dt)
    efforts = rig.loads.index(rig.channels[experiment.wrench_channels :])
    return values[:, :6], values[:, efforts]
