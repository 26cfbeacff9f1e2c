"""Self-test of signs and frames: gravity's sign, the encoders' sense and tared readings, found on the data."""

from __future__ import annotations

import numpy as np

from kbs_process.plant.rigid import static_wrench
from kbs_process.results.records import Record
from kbs_process.rig.model import LAB, Rig
from kbs_process.signals.records import Array, Signal

# A slope is called right within this much of +1: the nominal CoG need not be good, only its sign.
SLOPE_TOLERANCE = 0.5
# Channels on which the computed static wrench varies less than this many times its error say nothing.
MIN_VARIATION = 10.0
# A plate that is inclined by less than this (rad) is called level.
LEVEL = 0.1


class SignCheck(Record, frozen=True):
    """What was expected, what was found."""

    check: str
    expected: str
    found: str
    ok: bool


def check_weight(rig: Rig) -> tuple[SignCheck, ...]:
    """At rest on a level plate the unit pushes the transducer down by its weight.

    Says nothing about a transducer that turns with a joint, stands upright, is not under gravity, or is not there.
    """
    level = bool(np.all(np.abs(rig.transducer.tilt.value) < LEVEL))
    if not rig.transducer.channels or rig.transducer.on != LAB or not level or float(rig.gravity) == 0.0:
        return ()
    force = static_wrench(rig, np.zeros((1, len(rig.joints))))[0, :3]
    return (
        SignCheck(
            "computed force at rest, all joints at zero",
            "Fz < 0: the wrench is what the unit exerts on the transducer, z up",
            f"F = ({force[0]:.2f}, {force[1]:.2f}, {force[2]:.2f}) N",
            bool(force[2] < 0.0 and abs(force[2]) > np.hypot(force[0], force[1])),
        ),
    )


def check_gravity_sign(measured: Signal, static: Signal, noise: Array) -> tuple[SignCheck, ...]:
    """Slope of the measured against the computed static wrench, channel by channel: +1 where signs agree.

    `static` comes from nominal parameters, `noise` (c,) is the channels' rms noise. A channel that reads the
    reaction, or is swapped with another, shows a slope of -1 or near 0. Taring moves only the offset.
    """
    tests = []
    for index, channel in enumerate(measured.channels):
        x = static.values[measured.valid, index]
        y = measured.values[measured.valid, index]
        x, y = x - x.mean(), y - y.mean()
        if np.std(x) <= MIN_VARIATION * noise[index]:
            continue
        slope = float(x @ y / (x @ x))
        tests.append(
            SignCheck(
                f"slope of measured {channel} against computed gravity",
                "+1",
                f"{slope:+.3f}",
                abs(slope - 1.0) < SLOPE_TOLERANCE,
            )
        )
    return tuple(tests)


def check_encoder_sense(encoder: Signal, command: Signal) -> tuple[SignCheck, ...]:
    """Slope of the encoder's angle against the command, joint by joint: +1 where both count the same way."""
    tests = []
    for joint in encoder.channels:
        x, y = command.column(joint), encoder.column(joint)
        x, y = x - x.mean(), y - y.mean()
        if np.ptp(x) < np.radians(0.5):
            continue
        slope = float(x @ y / (x @ x))
        tests.append(
            SignCheck(f"slope of encoder {joint} against its command", "+1", f"{slope:+.4f}", abs(slope - 1.0) < 0.1)
        )
    return tuple(tests)
