"""Laws beyond the catalogue: any smooth function of one regressor at a port, its coefficients linear.

Cubic B-splines over what the regressor sweeps, those of `plant.effects.measured_law`, so that the plant can contain
what was found. A curve has no name; where it passes and no law of the catalogue does, it is the measured law, which it
shows with a band.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from kbs_process.diagnosis.inlets import GROUND_PORT, Inlet
from kbs_process.diagnosis.scene import Scene
from kbs_process.diagnosis.suspects import felt_from_the_ground
from kbs_process.plant.effects.measured_law import COEFFICIENTS, INTERVALS
from kbs_process.signals.records import Array

_RESTS = 1e-9
# Regressor -> unit. A rate is the slope of the angle; both are the output's.
REGRESSORS = {"joint_angle": "rad", "joint_rate": "rad/s"}
PORTS = ("joint_torque", GROUND_PORT)


@dataclass(frozen=True, slots=True, eq=False)
class CurveSuspect:
    """A spline of one regressor of a joint, at one of its ports."""

    scene: Scene
    port: str
    joint: str
    regressor: str
    knots: Array  # (INTERVALS + 1,) equally apart

    @property
    def family(self) -> tuple[str, str]:
        return f"{self.port} of {self.regressor}", self.joint

    @property
    def amplitudes(self) -> tuple[str, ...]:
        return tuple(f"c{k}" for k in range(COEFFICIENTS))

    @property
    def each_trial(self) -> bool:
        return False

    def inputs(self, drive: int) -> Sequence[Mapping[Inlet, Array]]:
        """Splines along the taps: the mean of both ends of each interval."""
        x = series(self.scene, drive, self.joint, self.regressor)
        basis = self.basis(x)
        means = 0.5 * (basis + np.vstack([basis[1:], basis[-1:]]))
        inlet = Inlet(self.port, self.joint)
        return [self.scene.stepped(drive, {inlet: column}) for column in means.T]

    def outputs(self, drive: int) -> Array:
        """Of the plant; nothing acts on the readings."""
        raise NotImplementedError(f"a law at {self.port} goes through the plant")

    def basis(self, x: Array) -> Array:
        """(m, coefficients) splines at x (m,), held beyond what was swept."""
        return basis(x, float(self.knots[0]), float(self.knots[-1]))


def basis(x: Array, low: float, high: float) -> Array:
    """(m, COEFFICIENTS) cardinal cubic B-splines at x (m,): `measured_law.spline`, coefficient by coefficient."""
    u = INTERVALS * np.clip((x - low) / (high - low), 0.0, 1.0)
    away = np.abs(u[:, None] - np.arange(-1.0, COEFFICIENTS - 1.0))
    weights: Array = (np.maximum(2.0 - away, 0.0) ** 3 - 4.0 * np.maximum(1.0 - away, 0.0) ** 3) / 6.0
    return weights


def series(scene: Scene, drive: int, joint: str, regressor: str) -> Array:
    """A regressor along the taps of a drive."""
    signals = scene.signals[drive]
    angle = signals.values[:, signals.columns.index(f"joint_angle.{joint}")]
    if regressor == "joint_angle":
        return np.asarray(angle, dtype=np.float64)
    # Over a real-time cycle: faster, it is the microsteps' ripple.
    width = max(1, round(0.1 * signals.rate))
    smooth = np.convolve(np.pad(angle, width, mode="edge"), np.ones(width) / width, mode="same")
    return np.asarray(np.gradient(smooth)[width:-width] * signals.rate, dtype=np.float64)


def curves(scene: Scene) -> tuple[CurveSuspect, ...]:
    """Every regressor that moves, at every port of every driven joint."""
    found = []
    reached = felt_from_the_ground(scene.experiment.rig)
    for joint in scene.experiment.rig.joints:
        if joint.drive is None:
            continue
        for regressor in REGRESSORS:
            swept = [series(scene, drive, joint.name, regressor) for drive in scene.signals]
            low, high = min(x.min() for x in swept), max(x.max() for x in swept)
            if high - low < _RESTS:
                continue
            knots = np.linspace(low, high, INTERVALS + 1)
            found += [
                CurveSuspect(scene, port, joint.name, regressor, knots)
                for port in PORTS
                if port != GROUND_PORT or joint.name in reached
            ]
    return tuple(found)
