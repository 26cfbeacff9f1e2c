"""What motor and gear give for a field: a motor's spring and a gear's, and the rotor's own torques along the field.

The rotor is at rest on these two springs at any instant (its own mode is far above the band). Its torques are linear
in numbers: what repeats with its turn is sine and cosine, the edges of a tooth's contact the first terms of their
Fourier series, so that no phase is searched for.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import make_interp_spline

from kbs_process.diagnosis.smoothing.basis import in_band
from kbs_process.plant.schedule import Schedule, covering
from kbs_process.rig.model import Drive, Rig
from kbs_process.signals.records import Array
from kbs_process.stages.align.resample import resample

FINE = 1000.0  # Hz, at which torques along the field are taken
_PARTS = 8  # of a fine step, over which whole microsteps are averaged
_REVERSAL = 2e-3  # rad/s of the motor over which friction changes its sign
WRITTEN = frozenset(
    {"synchronous_motor", "cogging", "motor_viscous", "dynamic_friction", "tooth_stiction", "flexspline"}
)
NUMBERS = ("b_m", "d0", "cog s", "cog c", "dyn s", "dyn c", "stat s", "stat c", "stat 2s", "stat 2c", "stat")
NEEDED = frozenset({"Tmax", "Kangle", "Ka", "fsv", "b_m", "d0", "d1", "w_dyn", "tcog", "Ts0", "delta"})


@dataclass(frozen=True, slots=True, eq=False)
class Field:
    """The fields of a recording."""

    t: Array  # (m,) s, fine
    smooth: Array  # (m, joints) motor rad, as commanded
    whole: Array  # (m, joints) in whole microsteps, mean over each fine step
    first: int  # samples of the working rate before the recording's first
    n: int
    dt: float
    angle: Array  # (n, joints) motor rad, at the working rate, and
    rate: Array  # its slopes
    acceleration: Array

    @property
    def rotors(self) -> tuple[Array, Array]:
        """Rates and accelerations of the rotors, which follow it at once."""
        return self.rate, self.acceleration

    @classmethod
    def of(cls, rig: Rig, schedule: Schedule, first: int, n: int, dt: float) -> Field:
        """Along a schedule, for n samples from the `first` on."""
        end = (first + n) * dt + 1.0
        given = covering(schedule, len(rig.joints), None, end)
        drives = [joint.drive for joint in rig.joints]
        ratio = np.array([float(drive.ratio) for drive in drives if drive is not None])
        step = np.array([2 * np.pi / float(drive.steps_per_turn) for drive in drives if drive is not None])
        field = given.position * ratio if given.field is None else given.field
        t = np.arange(round(end * FINE)) / FINE
        parts = (np.arange(len(t) * _PARTS) + 0.5) / FINE / _PARTS
        dense = np.stack([np.interp(parts, given.t, column) for column in field.T], axis=1)
        whole = (np.round(dense / step) * step).reshape(len(t), _PARTS, -1).mean(axis=1)
        smooth = np.stack([np.interp(t, given.t, column) for column in field.T], axis=1)
        angle = in_band(resample(whole, FINE, 1 / dt)[first : first + n], dt)
        spline = make_interp_spline(dt * np.arange(n), angle, k=5)
        own = dt * np.arange(n)
        return cls(t, smooth, whole, first, n, dt, angle, spline.derivative()(own), spline.derivative(2)(own))

    def torques(self, rig: Rig, behind: Array) -> Array:
        """Torque on each rotor of a unit of each of NUMBERS, (n, joints, numbers); `behind` (n, joints) the field."""
        out = np.zeros((self.n, len(rig.joints), len(NUMBERS)))
        own = self.dt * (self.first + np.arange(self.n))
        for j, joint in enumerate(rig.joints):
            assert joint.drive is not None
            angle = self.smooth[:, j] - np.interp(self.t, own, behind[:, j])
            rate = np.gradient(self.smooth[:, j]) * FINE
            sliding = np.clip(rate / float(joint.drive.parameters["w_dyn"]), -1.0, 1.0)
            sign, s, c = np.tanh(rate / _REVERSAL), np.sin(200 * angle), np.cos(200 * angle)
            s2, c2 = 2 * s * c, c * c - s * s
            turned = [-np.sin(2 * angle) * sliding, -np.cos(2 * angle) * sliding]
            stiction = [-sign * s, -sign * c, -sign * s2, -sign * c2, -sign]
            columns = np.stack([-rate, -sliding, s, c, *turned, *stiction], axis=1)
            out[:, j] = in_band(resample(columns, FINE, 1 / self.dt)[self.first : self.first + self.n], self.dt)
        return out


def priors(drive: Drive) -> tuple[Array, Array]:
    """Value and sigma of NUMBERS: what has an unknown phase is nothing, within its size."""
    given = {name: (float(entry), float(entry.sigma)) for name, entry in drive.parameters.items()}
    tooth = given["Ts0"][0]
    mean = tooth * given["delta"][0] / np.pi
    waves = [given["tcog"][0]] * 2 + [given["d1"][0]] * 2 + [0.35 * tooth] * 4
    value = np.array([given["b_m"][0], given["d0"][0], *np.zeros(8), mean])
    return value, np.array([given["b_m"][1], given["d0"][1], *waves, 0.35 * mean])


def spring(drive: Drive) -> float:
    """Stiffness of the motor's field, N m/rad of the rotor."""
    return float(drive.parameters["Tmax"]) * float(drive.parameters["Kangle"])
