"""A laboratory at work: a floor that moves, joints and motors that are noisy, mains in the electronics.

Densities are one-sided, per root hertz. A realisation belongs to one run.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from engine.hardware import Array
from engine.ports import BY_FLOOR, BY_JOINTS, BY_ROTORS, DISTURBANCE_STEP

GRAVITY = 9.80665
FLOOR_LOW, FLOOR_AT, FLOOR_HIGH = 1.0, 6.0, 30.0  # Hz: constant velocity between the outer two, as the VC classes
TORQUE_BAND = 50.0  # Hz
TILT_LOW, TILT_HIGH = 0.005, 1.0  # Hz: between them is all of the tilt
MAINS_HZ = 50.013  # a grid is never at its nominal frequency
HARMONICS = (1.0, 0.4, 0.5)  # of the mains' amplitude, at 1, 2 and 3 times its frequency


@dataclass(frozen=True, slots=True)
class Laboratory:
    """How much acts at random. The default is none."""

    floor: float = 0.0  # m/s^2/sqrt(Hz) at 6 Hz, each axis
    tilt: float = 0.0  # rad rms, about each horizontal axis, 1/f
    joints: float = 0.0  # N m/sqrt(Hz) between carrier and output, of the az and el joint, while they move
    motors: float = 0.0  # N m/sqrt(Hz) on the rotors
    mains: float = 0.0  # amplitude on the transducer's channels, as a share of their noise

    @property
    def quiet(self) -> bool:
        """Whether nothing acts on the mechanism."""
        return not (self.floor or self.tilt or self.joints or self.motors)

    def disturbance(self, duration: float, rng: np.random.Generator) -> Array:
        """Realise what acts on the mechanism for `duration` s: (rows, 7), see engine.ports; no rows if quiet."""
        if self.quiet:
            return np.zeros((0, 7))
        rows = int(np.ceil(duration / DISTURBANCE_STEP)) + 2
        f = np.fft.rfftfreq(2 ** int(np.ceil(np.log2(rows))), DISTURBANCE_STEP)
        out = np.zeros((rows, 7))
        out[:, BY_FLOOR] = _realised(self.floor * floor_shape(f), 3, rng)[:rows]
        tilts = _realised(self.tilt * tilt_shape(f), 2, rng)[:rows]
        out[:, 0] += GRAVITY * tilts[:, 1]
        out[:, 1] -= GRAVITY * tilts[:, 0]
        white = 1.0 / np.sqrt(1.0 + (f / TORQUE_BAND) ** 8)
        out[:, BY_JOINTS] = _realised(self.joints * white, 2, rng)[:rows]
        out[:, BY_ROTORS] = _realised(self.motors * white, 2, rng)[:rows]
        return out

    def hum(self, t: Array, noise: Array, rng: np.random.Generator) -> Array:
        """What mains do to the channels (n, 6) at t (s); `noise` (6,) is the channels' own."""
        out = np.zeros((len(t), 6))
        for k, share in enumerate(HARMONICS):
            phases = rng.uniform(-np.pi, np.pi, 6)
            out += share * np.sin(2 * np.pi * MAINS_HZ * (k + 1) * t[:, None] + phases)
        return self.mains * noise * out


QUIET = Laboratory()


def floor_shape(f: Array) -> Array:
    """Acceleration over that at 6 Hz: flat, in proportion to f, and falling with its square."""
    inner = np.clip(f, FLOOR_LOW, FLOOR_HIGH) / FLOOR_AT
    return np.asarray(inner * np.minimum(1.0, (FLOOR_HIGH / np.maximum(f, FLOOR_LOW)) ** 2))


def tilt_shape(f: Array) -> Array:
    """Angle per root hertz, of 1 rad rms in all, with a density of 1/f."""
    inside = (f >= TILT_LOW) & (f <= TILT_HIGH)
    shape = np.where(inside, 1.0 / np.sqrt(np.maximum(f, TILT_LOW)), 0.0)
    return np.asarray(shape / np.sqrt(max(float(np.sum(shape**2)) * f[1], 1e-300)))


def _realised(density: Array, columns: int, rng: np.random.Generator) -> Array:
    """Gaussian noise (rows, columns) whose one-sided density is `density`^2 at the rfft's frequencies."""
    n = 2 * (len(density) - 1)
    normal = rng.standard_normal((2, len(density), columns))
    spectrum = (normal[0] + 1j * normal[1]) * density[:, None] * np.sqrt(n / DISTURBANCE_STEP) / 2.0
    spectrum[0] = 0.0
    return np.asarray(np.fft.irfft(spectrum, n, axis=0))
