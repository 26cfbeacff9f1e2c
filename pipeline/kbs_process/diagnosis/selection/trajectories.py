"""A small family of trajectories that a rig can run, for the test that comes next: scans, reversals, sweeps."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from kbs_process.diagnosis.experiments.experiment import Drive
from kbs_process.plant.predict import Schedule
from kbs_process.signals.records import Array

_RESTS = 1e-6  # of an angle or rate: less is no motion
_SCANS = (1.0, 0.3, 0.1)  # of the greatest rate
_SLOWER = 0.62  # times the rate of the joint in question: both never turn back together for long
_SHORT = 0.1  # of the range, over which a joint is turned back and forth
_SWEEP_HZ = (0.02, 1.0)
_REST_S = 2.0  # at either end


@dataclass(frozen=True, slots=True, eq=False)
class Limits:
    """What a rig is known to bear: what its recordings went through. One entry a joint, SI."""

    low: Array
    high: Array
    rate: Array
    acceleration: Array
    seconds: float  # of the longest recording
    cycle: float  # s, of the commands


@dataclass(frozen=True, slots=True, eq=False)
class Trajectory:
    """Commands from rest to rest."""

    words: str
    schedule: Schedule

    @property
    def seconds(self) -> float:
        return float(self.schedule.t[-1])


def limits_of(drives: Sequence[Drive], dt: float) -> Limits:
    """Return the angles, rates and accelerations that commands went through; rates are means over half a second."""
    schedules = [one.schedule for one in drives if one.schedule is not None]
    position = np.concatenate([one.position for one in schedules])
    rates, accelerations = [], []
    for one in schedules:
        t = np.arange(one.t[0], one.t[-1], 0.5)
        way = np.stack([np.interp(t, one.t, column) for column in one.position.T], axis=1)
        rates.append(np.abs(np.diff(way, axis=0)).max(axis=0) / 0.5)
        accelerations.append(np.abs(np.diff(way, 2, axis=0)).max(axis=0) / 0.25)
    return Limits(
        position.min(axis=0),
        position.max(axis=0),
        np.max(rates, axis=0),
        np.max(accelerations, axis=0),
        max(one.n for one in drives) * dt,
        float(np.median(np.diff(schedules[0].t))),
    )


def family(limits: Limits, joints: Sequence[str], seconds: float, axis: str = "") -> tuple[Trajectory, ...]:
    """Return trajectories of `seconds`: of `axis`, or of each joint that moved, alone, and of all of them together."""
    moving = [k for k in range(len(joints)) if limits.rate[k] > _RESTS and limits.high[k] - limits.low[k] > _RESTS]
    alone = [k for k in moving if joints[k] == axis] or moving
    # The axis in question goes first: the others run slower.
    together = [*alone, *(k for k in moving if k not in alone)]
    groups = [(k,) for k in alone] + ([tuple(together)] if len(together) > 1 else [])
    return tuple(one for group in groups for one in _of(limits, joints, group, seconds))


def _of(limits: Limits, joints: Sequence[str], group: Sequence[int], seconds: float) -> Iterator[Trajectory]:
    t = np.arange(0.0, seconds + 0.5 * limits.cycle, limits.cycle)
    who = " and ".join(joints[k] for k in group)
    middle = 0.5 * (limits.low + limits.high)

    def made(words: str, ways: Sequence[Array]) -> Trajectory:
        position = np.tile(middle, (len(t), 1))
        for place, (k, way) in enumerate(zip(group, ways, strict=True)):
            # The second joint runs slower, or begins the other way.
            position[:, k] = middle[k] + (way if place % 2 == 0 else -way)
        rate = np.gradient(position, t, axis=0)
        return Trajectory(f"{who}: {words}", Schedule(t, position, rate))

    for share in _SCANS:
        ways = [_back_and_forth(t, limits, k, share * _SLOWER**place, 1.0) for place, k in enumerate(group)]
        rates = ", ".join(f"{np.degrees(share * _SLOWER**p * limits.rate[k]):.3g}" for p, k in enumerate(group))
        yield made(f"scans of the whole range at {rates} deg/s", ways)
    for share in (_SCANS[0], _SCANS[-1]):
        ways = [_back_and_forth(t, limits, k, share * _SLOWER**place, _SHORT) for place, k in enumerate(group)]
        yield made(f"reversals over a tenth of the range at {share:.0%} of the greatest rate", ways)
    low, high = _SWEEP_HZ
    yield made(
        f"a sine from {low:g} to {high:g} Hz within rate and acceleration", [_sweep(t, limits, k) for k in group]
    )


def _back_and_forth(t: Array, limits: Limits, k: int, share: float, part: float) -> Array:
    """Way from the middle at a constant rate between both ends of a part of the range, turning back within limits."""
    step = float(t[1] - t[0])
    half = 0.5 * part * float(limits.high[k] - limits.low[k])
    fastest = share * float(limits.rate[k])
    most = max(float(limits.acceleration[k]), fastest / (0.25 * float(t[-1])))
    way, rate, sense = np.zeros(len(t)), 0.0, 1.0
    for i in range(1, len(t)):
        left = float(t[-1] - t[i]) - _REST_S
        # To rest where the time ends, and at an end of the range in time to turn back.
        target = 0.0 if t[i] < _REST_S or left < abs(rate) / most else sense * fastest
        if sense * way[i - 1] + rate * rate / (2.0 * most) + abs(rate) * step > half and sense * rate > 0.0:
            sense = -sense
            target = sense * fastest
        rate += float(np.clip(target - rate, -most * step, most * step))
        way[i] = way[i - 1] + rate * step
    return way


def _sweep(t: Array, limits: Limits, k: int) -> Array:
    """Way of a sine whose frequency rises by equal shares in equal times, as wide as the limits let it."""
    low, high = _SWEEP_HZ
    span = float(t[-1]) - 2.0 * _REST_S
    since = np.clip(t - _REST_S, 0.0, span)
    growth = np.log(high / low)
    omega = 2.0 * np.pi * low * np.exp(growth * since / span)
    phase = 2.0 * np.pi * low * span / growth * np.expm1(growth * since / span)
    half = 0.5 * float(limits.high[k] - limits.low[k])
    # Half of the bounds each: amplitude and frequency change while the sine runs.
    width = np.minimum(half, np.minimum(0.5 * limits.rate[k] / omega, 0.5 * limits.acceleration[k] / omega**2))
    fade = np.minimum(1.0, np.minimum(since, span - since) / 5.0)
    way = width * fade**2 * (3.0 - 2.0 * fade) * np.sin(phase)
    rate = np.gradient(way, t)
    over = np.abs(rate).max() / limits.rate[k], np.abs(np.gradient(rate, t)).max() / limits.acceleration[k]
    return np.asarray(way / max(1.0, *over), dtype=np.float64)
