"""All that is drawn, and where from: one table a kind, one rule for both splits.

Development draws from the middle of a range, validation from its two outer parts, so that it has to extrapolate from
development. Validation trials that were spent have been developed on, too, and the next ones come from their ranges.
Choices are stated for each split. Phases are unknown in both.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

Split = Literal["development", "validation"]

MIDDLE = (0.3, 0.7)  # of a range: development; what is outside of it: validation


def share(rng: np.random.Generator, split: Split) -> float:
    """Where in a range, 0 to 1."""
    low, high = MIDDLE
    u = float(rng.uniform())
    if split == "development":
        return low + (high - low) * u
    outside = low + 1.0 - high
    return outside * u if outside * u < low else outside * u + high - low


@dataclass(frozen=True, slots=True)
class Range:
    """From `low` to `high`, uniform, or uniform in the logarithm."""

    low: float
    high: float
    log: bool = True

    def draw(self, rng: np.random.Generator, split: Split) -> float:
        """Draw a number."""
        u = share(rng, split)
        if self.log:
            return float(self.low * (self.high / self.low) ** u)
        return self.low + (self.high - self.low) * u


@dataclass(frozen=True, slots=True)
class Choice:
    """One of some, which differ between the splits."""

    development: tuple[float, ...]
    validation: tuple[float, ...]

    def draw(self, rng: np.random.Generator, split: Split) -> float:
        """Draw one."""
        return float(rng.choice(self.development if split == "development" else self.validation))


@dataclass(frozen=True, slots=True)
class Phase:
    """Anywhere on the circle, rad."""

    def draw(self, rng: np.random.Generator, split: Split) -> float:
        """Draw an angle."""
        return float(rng.uniform(-np.pi, np.pi))


Drawn = Range | Choice | Phase

# Nominals, as factors on those of campaigns/EL089 where nothing else is said; drives are drawn for each axis.
ARTICLE: dict[str, Drawn] = {
    "body.base.mass": Range(0.6, 1.6),
    "body.azimuth.mass": Range(0.6, 1.6),
    "body.antenna.mass": Range(0.6, 1.6),
    "body.antenna.size": Range(0.8, 1.25),  # of lengths; inertia goes with its square
    "transducer.stiffness": Range(0.5, 1.5),
    "transducer.damping": Range(0.6, 1.8),
    "transducer.noise": Range(0.5, 2.0),
    "transducer.resolution": Choice((1.0, 0.5), (2.0, 0.25)),
    "transducer.rate": Choice((100.0,), (100.0, 200.0)),  # Hz, not a factor
    "transducer.corner": Range(0.17, 0.25),  # of the rate
    "encoder.bits": Choice((14.0, 15.0), (14.0, 16.0)),
    "encoder.rate": Choice((50.0,), (50.0, 100.0)),  # Hz
    "drive.ratio": Choice((100.0, 80.0), (100.0, 120.0)),
    "drive.rotor_inertia": Range(0.7, 1.5),
    "drive.Tmax": Range(0.75, 1.4),
    "drive.tcog": Range(0.5, 1.8),
    "drive.b_m": Range(0.5, 2.0),
    "drive.d0": Range(0.5, 1.8),
    "drive.d1": Range(0.5, 1.5),
    "drive.w_dyn": Range(0.6, 1.7),
    "drive.Ts0": Range(0.5, 1.8),
    "drive.delta": Range(0.6, 1.6),
    "drive.fsv": Range(0.6, 1.8),
    "drive.Ka": Range(0.6, 1.8),
}

# From run to run, one sigma: shares of the value where no unit is given.
RUN_TO_RUN: dict[str, float] = {
    "friction": 0.0115,  # of b_m, d0, d1, Ts0, each alone: as far as the engine's own spread
    "temperature": 0.01,  # of b_m and d0 of both axes together
    "tilt": 3e-6,  # rad: the floor settles
}
STAMP_JITTER = 20e-6  # s, one sigma

# A laboratory: see engine.laboratory. From the quietest class of floors, and quieter, to an ordinary building.
LABORATORY: dict[str, Drawn] = {
    "floor": Range(2e-5, 1e-3),
    "tilt": Range(1e-6, 8e-6),
    "joints": Range(3e-4, 5e-3),
    "motors": Range(1e-5, 1e-4),
    "mains": Range(0.03, 0.3),
}
SILENT = 0.1  # share of the trials in which nothing acts at random

LEVELS = (40.0, 100.0, 300.0, 1000.0)  # rho_eff
BEYOND_SIGMAS = Range(4.5, 8.5, log=False)  # of parameters that are off beyond their uncertainty

# Motions, deg and s.
PATHS: dict[str, Drawn] = {
    "duration": Range(60.0, 84.0, log=False),
    "az.start": Range(-60.0, 60.0, log=False),
    "el.low": Range(35.0, 66.0, log=False),
    "el.high": Range(68.0, 84.0, log=False),
    "rate.quick": Range(0.45, 1.8),
    "rate.slow": Range(0.06, 0.45),
    "acceleration": Range(0.015, 0.06),
}
