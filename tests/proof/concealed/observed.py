"""What a trajectory shows at the working rate, by the engine at a coarser step, with and without what is concealed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import decimate

from engine.hardware import Array, Hardware
from engine.ports import NONE, Extra
from engine.rigid import AZ, EL
from engine.simulation import Dense, amplify, at, integrate
from engine.trajectories import Commands

COARSE = 5e-4  # s; strengths within a few per cent of those at the recordings' step (test_concealed_strength.py)
FINE_HZ, WORKING_HZ = 100.0, 20.0
_EVERY = round(FINE_HZ / WORKING_HZ)
_RATE_SPAN = 5e-3  # s


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """One trajectory without what is concealed; its field is what any other simulation of it follows."""

    hardware: Hardware
    path: Commands
    field: Array  # (m, 2) motor rad
    dense: Dense
    step: float

    @classmethod
    def of(cls, hardware: Hardware, path: Commands, step: float = COARSE) -> Motion:
        """Simulate a trajectory."""
        dense = integrate(hardware, path, time_step=step)
        return cls(hardware, path, dense.field, dense, step)

    def simulated(self, hardware: Hardware | None = None, extra: Extra = NONE) -> Dense:
        """Simulate it again along the same field, with other hardware or more physics."""
        return integrate(hardware or self.hardware, self.path, time_step=self.step, extra=extra, field=self.field)

    def observed(self, hardware: Hardware | None = None, extra: Extra = NONE) -> Array:
        """Readings (n, 8) at the working rate: coupled wrench and angles shown, neither noise nor rounding."""
        again = hardware is not None or extra.acts or extra.drive is not None
        dense = self.simulated(hardware, extra) if again else self.dense
        return read(hardware or self.hardware, dense, extra)


def read(hardware: Hardware, dense: Dense, extra: Extra = NONE) -> Array:
    """Readings (n, 8) at the working rate of a simulation."""
    t = np.arange(0.0, dense.field_t[-1] + 1e-9, 1.0 / FINE_HZ)
    wrench_t, angle_t = (t - extra.clocks[key](t) if key in extra.clocks else t for key in ("wrench", "encoder"))
    coupled = at(dense.t, amplify(hardware, dense), wrench_t)
    coupled = coupled @ (np.eye(6) + hardware["transducer.cross_coupling"]).T
    if extra.transducer is not None:
        coupled = coupled + extra.transducer(t, coupled)
    joints = dense.q[:, [AZ, EL]]
    angles = at(dense.t, joints, angle_t)
    if extra.encoder is not None:
        ends = (at(dense.t, joints, angle_t + sign * _RATE_SPAN) for sign in (-1.0, 1.0))
        before, after = ends
        angles = angles + extra.encoder(angle_t, angles, (after - before) / (2 * _RATE_SPAN))
    offset = [hardware.scalar(f"joint.{axis}.encoder.offset") for axis in ("az", "el")]
    return to_working_rate(np.hstack([coupled, angles + offset]))


def to_working_rate(values: Array) -> Array:
    """Low-pass with zero phase and thin out, columns apart."""
    return np.asarray(decimate(values - values[0], _EVERY, ftype="fir", axis=0) + values[0])
