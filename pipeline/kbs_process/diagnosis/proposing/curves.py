"""Laws beyond the catalogue: any smooth function of one regressor at a port, or a friction of such a size.

Cubic B-splines over what the regressor sweeps, those of `plant.laws.position.measured_law`, so that the plant can
contain what was found. A curve has no name; where it passes and no law of the catalogue does, it is the measured law,
which it shows with a band.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from kbs_process.diagnosis.screening.inlets import Inlet
from kbs_process.diagnosis.screening.scene import Scene
from kbs_process.diagnosis.screening.suspects import felt_from_the_ground
from kbs_process.plant.effect import CROSSED, Port
from kbs_process.plant.laws.position.measured_law import COEFFICIENTS, DENSE, INTERVALS, MEASURED, SLIDES, Measured
from kbs_process.plant.structure import other_joint
from kbs_process.signals.records import Array

_RESTS = 1e-9


@dataclass(frozen=True, slots=True, eq=False)
class CurveSuspect:
    """A spline of one regressor of a joint, at one of its ports."""

    scene: Scene
    law: Measured
    joint: str
    ends: tuple[float, float]  # of what the regressor sweeps

    @property
    def port(self) -> str:
        """That of its inlet."""
        return self.law.effect.port.name.lower()

    @property
    def family(self) -> tuple[str, str]:
        return self.law.effect.name, self.joint

    @property
    def amplitudes(self) -> tuple[str, ...]:
        return tuple(f"c{k}" for k in range(COEFFICIENTS))

    @property
    def each_trial(self) -> bool:
        return False

    @property
    def places(self) -> int:
        return 1

    def inputs(self, drive: int) -> Sequence[Mapping[Inlet, Array]]:
        """Splines along the taps, of a friction against the rate: the mean over each interval."""
        means = self.basis(series(self.scene, drive, self.joint, self.law.regressor))
        if not self.law.of_rate:  # a rate is a mean itself
            means = 0.5 * (means + np.vstack([means[1:], means[-1:]]))
        if opposed := self.law.opposed:
            rate = _slope(self.scene, drive, opposed.replace("rate", "angle"), self.joint)
            means *= -np.tanh(rate / SLIDES[opposed])[:, None]
        inlet = Inlet(self.port, self.joint)
        return [self.scene.stepped(drive, {inlet: column}) for column in means.T]

    def outputs(self, drive: int) -> Array:
        """Of the plant; nothing acts on the readings."""
        raise NotImplementedError(f"a law at {self.port} goes through the plant")

    def basis(self, x: Array) -> Array:
        """(m, coefficients) splines at x (m,), held beyond what was swept."""
        return basis(self.law, x, *self.ends)


def basis(law: Measured, x: Array, low: float, high: float) -> Array:
    """(m, COEFFICIENTS) what a unit of each coefficient of a measured law, its friction aside, is at x (m,)."""
    if law.of_rate:
        x, (low, high) = bent(x, low, high), bent(np.array([low, high]), low, high)
    u = INTERVALS * np.clip((x - low) / (high - low), 0.0, 1.0)
    away = np.abs(u[:, None] - np.arange(-1.0, COEFFICIENTS - 1.0))
    weights: Array = (np.maximum(2.0 - away, 0.0) ** 3 - 4.0 * np.maximum(1.0 - away, 0.0) ** 3) / 6.0
    return weights


def along(law: Measured, low: float, high: float) -> Array:
    """(101,) values of a measured law's regressor, from end to end and as dense as its nodes."""
    if not law.of_rate:
        return np.linspace(low, high, 101)
    first, last = bent(np.array([low, high]), low, high)
    u = np.linspace(first, last, 101)[1:-1]
    return np.concatenate([[low], DENSE * (high - low) * u / (1.0 - np.abs(u)), [high]])


def bent(rate: Array, low: float, high: float) -> Array:
    """`measured_law.bent` of many rates."""
    return rate / (np.abs(rate) + DENSE * (high - low))


def series(scene: Scene, drive: int, joint: str, regressor: str) -> Array:
    """A regressor along the taps of a drive."""
    if regressor in CROSSED:
        joint, regressor = other_joint(scene.hypothesis.rig, joint), regressor.replace("other", "joint")
    if regressor.endswith("rate"):
        return _slope(scene, drive, regressor.replace("rate", "angle"), joint)
    return _tap(scene, drive, regressor, joint)


def _tap(scene: Scene, drive: int, signal: str, joint: str) -> Array:
    signals = scene.signals[drive]
    column = signals.values[:, signals.columns.index(f"{signal}.{joint}")]
    return np.asarray(column, dtype=np.float64)


def _slope(scene: Scene, drive: int, signal: str, joint: str) -> Array:
    """Mean rate of a signal from tap to tap; the last repeats the one before."""
    apart = np.diff(_tap(scene, drive, signal, joint)) * scene.signals[drive].rate
    return np.append(apart, apart[-1:])


def curves(scene: Scene) -> tuple[CurveSuspect, ...]:
    """Every measured law at every joint whose drive is described, where its regressor moves."""
    found = []
    rig = scene.experiment.rig
    reached = felt_from_the_ground(rig)
    for joint in rig.joints:
        if joint.drive is None:
            continue  # a curve would take the place of the friction that a direct drive has
        for law in MEASURED:
            if law.effect.port is Port.GROUND_TORQUE and joint.name not in reached:
                continue
            if law.effect.port is Port.MOTOR_TORQUE and not scene.paths:
                continue  # along a measured motion it is a torque of the joint
            if law.effect.crossed and other_joint(rig, joint.name) == joint.name:
                continue
            swept = [series(scene, drive, joint.name, law.regressor) for drive in scene.signals]
            low, high = min(x.min() for x in swept), max(x.max() for x in swept)
            if high - low > _RESTS:
                found.append(CurveSuspect(scene, law, joint.name, (float(low), float(high))))
    return tuple(found)
