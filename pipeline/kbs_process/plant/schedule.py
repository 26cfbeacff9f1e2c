"""What drives a plant: the commands of every real-time cycle, and what was recorded of the drive."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from kbs_process.errors import SimulationError
from kbs_process.rig.model import Controller
from kbs_process.signals.records import Array


@dataclass(frozen=True, slots=True, eq=False)
class Schedule:
    """Commands at the start of each cycle, on the recording's time axis; columns are the rig's joints.

    With `field` the motors follow the recorded field position, whatever the controller; otherwise, with
    `encoder`, a closed loop is fed these readings instead of its own.
    """

    t: Array  # (n,) s, increasing
    position: Array  # (n, joints) rad, desired
    rate: Array  # (n, joints) rad/s, desired
    field: Array | None = None  # (n, joints) motor rad
    encoder: Array | None = None  # (n, joints) rad, readings at the cycles' starts


def stopped(schedule: Schedule, controller: Controller | None, request: float) -> Schedule:
    """Return commands in which every joint ramps to rest once a stop is requested (s), or where its range would end.

    A joint stops as fast as the controller's `acceleration` allows: from the request on, or from the last cycle from
    which that is within its range. Raises SimulationError for a request without a stated acceleration.
    """
    if controller is None or controller.acceleration is None:
        if request != np.inf:
            raise SimulationError("nothing says how fast the controller stops", remedy="state controller.acceleration")
        return schedule
    most, t, position, rate = controller.acceleration.value, schedule.t, schedule.position.copy(), schedule.rate.copy()
    low = -np.inf if controller.lowest is None else controller.lowest.value
    high = np.inf if controller.highest is None else controller.highest.value
    rest = position + rate * np.abs(rate) / (2.0 * most)  # where it would come to
    out = (rest < low) | (rest > high)
    stops = np.vstack([out[1:], out[-1:]]) | ~(t < request)[:, None]
    for joint in np.flatnonzero(stops.any(axis=0)):
        first = int(np.argmax(stops[:, joint]))
        speed, brake = rate[first, joint], np.copysign(most[joint], rate[first, joint])
        since = np.minimum(t[first:] - t[first], speed / brake)
        position[first:, joint] = position[first, joint] + speed * since - 0.5 * brake * since**2
        rate[first:, joint] = speed - brake * since
    return replace(schedule, position=position, rate=rate)


def covering(schedule: Schedule, joints: int, cycle: float | None, end: float) -> Schedule:
    """Return `schedule` without gaps, from time 0 or earlier to beyond `end`.

    Cycles that a recording lost are interpolated linearly: the field moved on while nobody recorded, and
    holding it would end every gap with a jump. Before the first and after the last cycle the command is held.
    `cycle` is the controller's real-time cycle, s; without it, it is the median of the recorded ones.
    """
    given = _checked(schedule, joints)
    gaps = np.diff(given.t)
    if cycle is None:
        if not len(gaps):
            raise SimulationError("one command and no controller", remedy="give the rig's [controller] cycle")
        cycle = float(np.median(gaps))
    counts = np.maximum(np.rint(gaps / cycle).astype(np.int64), 1)  # cycles from one command to the next
    start = np.repeat(np.arange(len(gaps)), counts)
    since = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    within = given.t[start] + since * (gaps / counts)[start]
    before = max(0, int(np.ceil(given.t[0] / cycle)))
    after = max(0, int(np.ceil((end - given.t[-1]) / cycle))) + 2
    lead = given.t[0] - cycle * np.arange(before, 0, -1)
    t = np.concatenate([lead, within, given.t[-1] + cycle * np.arange(after + 1)])
    whole = _at(given, t)
    whole.rate[(t < given.t[0]) | (t > given.t[-1])] = 0.0
    return whole


def _checked(schedule: Schedule, joints: int) -> Schedule:
    """Return the schedule with missing values interpolated, or say why it cannot drive the plant."""
    t = schedule.t
    if not len(t) or not np.isfinite(t).all() or not (np.diff(t) > 0.0).all():
        raise SimulationError(
            "command times are empty, not finite or not increasing", remedy="look at the recording with 'inspect'"
        )
    for entry in fields(schedule):
        values = getattr(schedule, entry.name)
        if entry.name == "t" or values is None:
            continue
        if values.shape != (len(t), joints):
            raise SimulationError(
                f"{entry.name} has shape {values.shape}, not {(len(t), joints)}: cycles by joints of the rig"
            )
        if not np.isfinite(values).any(axis=0).all():
            raise SimulationError(f"{entry.name} of a joint holds no number", remedy="check the recording's topic")
    return _at(schedule, t)


def _at(schedule: Schedule, t: Array) -> Schedule:
    """Return the schedule interpolated at `t`, held outside."""

    def interpolated(values: Array) -> Array:
        finite = [np.isfinite(column) for column in values.T]
        columns = [np.interp(t, schedule.t[good], c[good]) for c, good in zip(values.T, finite, strict=True)]
        return np.ascontiguousarray(np.stack(columns, axis=1))

    return Schedule(
        t,
        interpolated(schedule.position),
        interpolated(schedule.rate),
        None if schedule.field is None else interpolated(schedule.field),
        None if schedule.encoder is None else interpolated(schedule.encoder),
    )
