"""The words in which effects are concealed, found and compared."""

from __future__ import annotations

from typing import Literal

Port = Literal[
    "motor torque",
    "transmission",
    "joint torque",
    "external wrench",
    "mass properties",
    "base",
    "appendage",
    "controller",
    "transducer",
    "encoder",
    "clock",
]

# Physics, by the name that a test engineer would give it; "unnamed" is a law that no effect of a catalogue fits.
Family = Literal[
    "cogging",
    "motor order",
    "microstep",
    "friction",
    "viscous",
    "warm-up",
    "stiction",
    "transmission error",
    "backlash",
    "stiffness",
    "hysteresis",
    "harness",
    "cable",
    "bungee",
    "air drag",
    "local torque",
    "vibration",
    "tilt",
    "compliance",
    "appendage",
    "mass",
    "gyroscopic",
    "gain",
    "cross-coupling",
    "drift",
    "non-linearity",
    "product",
    "sensor hysteresis",
    "lag",
    "mains",
    "eccentricity",
    "converter",
    "quantisation",
    "offset",
    "skew",
    "drops",
    "wander",
    "latency",
    "jitter",
    "unnamed",
]

Verdict = Literal["none", "parameters off", "physics", "undecided"]
Kind = Literal["nothing", "within", "beyond", "concealed"]
Split = Literal["development", "validation"]

NULLS: tuple[Kind, ...] = ("nothing", "within", "beyond")

OURS = "kbs-process"
RIVALS = {
    "parameters": "known parameters alone, refitted: classical correlation",
    "sparse": "sparse regression on the residual: PySINDy's library, an ensemble of thresholded least squares",
    "gaussian process": "a Gaussian process for the discrepancy, relevance by its length scales",
    "boosting": "gradient boosting of the residual on the plant's signals, relevance by permutation",
    "grey box": "stepwise grey box: the term that gains most enters, F-tests, residual tests",
}
METHODS = (OURS, *RIVALS)
