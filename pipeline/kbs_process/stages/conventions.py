"""Self-test of signs and frames: gravity's sign, the encoders' sense and tared readings, found on the data."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kbs_process.estimation.longrun import longrun_covariance
from kbs_process.plant.rigid import static_wrench
from kbs_process.results.records import Record
from kbs_process.rig.model import LAB, Rig
from kbs_process.signals.records import Array, Signal

# A slope is called right within this many of its own standard deviations.
BEYOND = 4.0
# No calibration promises less; and whatever disturbs it, a channel that is off by more does not follow gravity.
_EXACT, _HALF = 1e-3, 0.5
OF_ENCODER = "slope of encoder"  # how its checks begin
# A plate that is inclined by less than this (rad) is called level.
LEVEL = 0.1


class SignCheck(Record, frozen=True, kw_only=True):
    """What was expected, what was found."""

    check: str
    channel: str = ""  # whose slope against its computed load is tested; of no other check
    expected: str
    found: str
    ok: bool
    testable: bool = True  # whether these data could show that it is wrong
    slope: float | None = None
    sigma: float | None = None  # of the slope: by what the files do not know exactly, and by what else varies
    followed: float = (
        0.0  # share of what a slope of one leaves, by power, that follows the computed load as a gain has it
    )


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
            check="computed force at rest, all joints at zero",
            expected="Fz < 0: the wrench is what the unit exerts on the transducer, z up",
            found=f"F = ({force[0]:.2f}, {force[1]:.2f}, {force[2]:.2f}) N",
            ok=bool(force[2] < 0.0 and abs(force[2]) > np.hypot(force[0], force[1])),
        ),
    )


def check_gravity_sign(
    channels: Sequence[str], measured: Array, computed: Array, noise: Array, errors: Array | None = None
) -> tuple[SignCheck, ...]:
    """Slope of measured against computed static loads (n, c): +1 where signs, gains and axes agree.

    `computed` comes from nominal parameters; `errors` (n, c, k) are its independent one-sigma errors by what the files
    state: masses, CoGs, the calibration. `noise` (c,) is the channels' rms noise. A channel that reads the reaction, or
    is swapped with another, shows a slope of -1 or near 0. Taring moves only the offset. The slope's sigma holds the
    errors, and what does not follow the computed loads, of any colour. A slope that noise and files leave unknown by
    half is not testable.
    """
    tests = []
    for index, channel in enumerate(channels):
        x, y = (values[:, index] - values[:, index].mean() for values in (computed, measured))
        power = float(x @ x)
        if power == 0.0:
            continue
        slope = float(x @ y) / power
        seen = float(longrun_covariance(((y - slope * x) * x)[:, None])[0, 0])
        noisy = power * float(noise[index]) ** 2
        stated = 0.0 if errors is None else float(np.sum((x @ errors[:, index]) ** 2))
        sigma = float(np.sqrt(max(seen, noisy) + stated)) / power
        testable = BEYOND * np.sqrt(noisy + stated) / power < _HALF
        tests.append(
            SignCheck(
                check=f"slope of measured {channel} against its computed load",
                channel=channel,
                expected="+1",
                found=f"{slope:+.3f} ± {sigma:.2g}" if testable else "this load hardly changes here",
                ok=bool(not testable or abs(slope - 1.0) < np.clip(BEYOND * sigma, _EXACT, _HALF)),
                testable=bool(testable),
                slope=slope,
                sigma=sigma,
                followed=(slope - 1.0) ** 2 * power / max(float((y - x) @ (y - x)), 1e-300),
            )
        )
    return tuple(tests)


def check_response(
    channels: Sequence[str], read: Array, due: Array, error: Array, noise: Array, alone: Sequence[bool]
) -> tuple[SignCheck, ...]:
    """Channels that show nothing but noise where they ought to show more.

    `read` (n, c) is low-passed, as recorded; `due` (n, c) what the fitted rig makes of it, with an `error` (c,), rms;
    `noise` (c,) the channels' stated rms; `alone` (c,) those whose zero has moved while that of no other has.
    """
    tests = []
    for index, channel in enumerate(channels):
        shown, expected = float(read[:, index].std()), float(due[:, index].std())
        lost = alone[index] and abs(float(read[:, index].mean())) < noise[index]
        if shown < noise[index] and (lost or expected > BEYOND * np.hypot(shown, error[index])):
            tests.append(
                SignCheck(
                    check=f"reading of {channel}, rms about its mean",
                    expected="its zero of before" if lost else f"{expected:.2g}",
                    found=f"{shown:.2g}{' about nothing' if lost else ''}: {channel} does not respond",
                    ok=False,
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
            SignCheck(
                check=f"{OF_ENCODER} {joint} against its command",
                expected="+1",
                found=f"{slope:+.4f}",
                ok=abs(slope - 1.0) < 0.1,
                slope=slope,
            )
        )
    return tuple(tests)
