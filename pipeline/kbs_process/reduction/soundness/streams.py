"""Streams that cannot be what they are said to be: stuck, repeated, copied, or at times of another scale."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np

from kbs_process.campaign.config import Campaign, Requirement
from kbs_process.plant.rigid import static_wrench
from kbs_process.reduction import measurable
from kbs_process.reduction.held import noisy
from kbs_process.reduction.preparing import Prepared
from kbs_process.reduction.soundness.noise import measured_noise
from kbs_process.results.judged import Doubt
from kbs_process.rig.model import Rig
from kbs_process.signals.records import WRENCH_CHANNELS, Array, Run
from kbs_process.stages.align.prints import Prints, again
from kbs_process.stages.conventions import BEYOND
from kbs_process.stages.gravity import model as gravity
from kbs_process.stages.gravity.equation import Prepared as Instants
from kbs_process.stages.gravity.equation import encoder_offsets
from kbs_process.stages.gravity.model import GravityModel
from kbs_process.stages.gravity.tension import TAKEN
from kbs_process.stages.repeats import commanded, copies, motion_of

RATED = 1.1  # times: angles that change by more, or by less than its inverse, do not follow their rates
LEAST_S = 5.0  # for which an angle has to stand still to be called stuck
_CREEP = 0.05  # of how far a still angle may change, from one instant to the next
_PART = 0.1  # of the load that a turn would change: less is something else
_TOLD = 1e-3  # rad: a joint that commands move by less rests
_TURN = 72  # angles of a turn
_UNCHANGED = 1e-3  # of the largest load that a turn changes: less is none
_SAME = 1e-12  # relative: what rounding makes of the same reading


def copied(requirement: Requirement, rig: Rig, recordings: Sequence[Prepared]) -> Iterator[Doubt]:
    """Runs of readings that come twice, rounded anew or not, of channels whose noise is more than rounding moves them.

    Recordings that are the same throughout, motion and all, are one: `told_copies` tells of that.
    """
    own, stated = rig.transducer.channels, noisy(rig)
    noise = np.stack([measured_noise(rig, one)[1] for one in recordings])
    found: dict[tuple[int, int], dict[str, tuple[int, int]]] = {}
    for place, channel in enumerate(own):
        if channel in stated and channel in measurable.needed_channels(requirement, rig):
            prints = [one.prints[place] if one.prints else Prints() for one in recordings]
            for pair, span in again(prints, np.minimum(noise[:, place], stated[channel])).items():
                found.setdefault(pair, {})[channel] = span
    for (first, second), spans in sorted(found.items()):
        one, other = recordings[first], recordings[second]
        if {one.entry.role, other.entry.role} == {"calibration"} or (one is not other and _same(one, other)):
            continue
        begin, end = (
            (at(stamps) - other.run.epoch_ns) * 1e-9
            for at, stamps in zip((min, max), zip(*spans.values(), strict=True), strict=True)
        )
        where = "at another time of it" if one is other else f"in {one.entry.name}"
        yield Doubt(
            f"readings of {', '.join(spans)} in {other.entry.name}, from {begin:.1f} s to {end:.1f} s, come "
            f"{where} as well: noise does not repeat, so they were copied"
        )


def _same(one: Prepared, other: Prepared) -> bool:
    """Whether two recordings read the same and move the same, from beginning to end."""
    a, b = motion_of(one.run), motion_of(other.run)
    return bool(copies([one.run, other.run])) and (a is None or b is None or np.array_equal(a.values, b.values))


def stuck(recordings: Sequence[Prepared], instants: Sequence[Instants], model: GravityModel) -> Iterator[str]:
    """Turning joints whose angle stands still for a time, while the load changes as it would if they turned.

    What gravity leaves then (n, c), over the noise, is far more than in another recording, is such as a turn of the
    joint changes, and a good part of that: a blow is less, and what pulls or pushes has a force. A joint that was told
    to rest does.
    """
    equation, rig = model.equation, model.rig
    channels = rig.transducer.channels
    index = [WRENCH_CHANNELS.index(channel) for channel in channels]
    noise = np.maximum(rig.transducer.noise.value[index], 1e-12)
    elsewhere = {name: _power(rms[None, : len(channels)] / noise) for name, rms in model.residual_rms.items()}
    for one, data in zip(recordings, instants, strict=True):
        whole = (data.wrench - equation.predict(model.fit.value[: equation.size], data))[:, : len(channels)] / noise
        least = BEYOND**2 * min((x for name, x in elsewhere.items() if name != one.entry.name), default=0.0)
        for j, joint in enumerate(rig.joints):
            rows = _still(data.q[:, j], gravity.STILL * max(float(data.sigma_q[:, j].max()), 1e-6))
            if joint.type != "revolute" or np.ptp(data.t[rows]) < LEAST_S:
                continue
            left = whole[rows] - whole[rows].mean(axis=0)
            power = _power(left)
            if power <= least or _rests(joint.name, one.run, *data.t[rows][[0, -1]].tolist()):
                continue
            poses = np.tile(data.q[rows].mean(axis=0) - encoder_offsets(rig), (_TURN, 1))
            poses[:, j] += 2.0 * np.pi * np.arange(_TURN) / _TURN
            turned = static_wrench(rig, poses)[:, index] / noise
            turned -= turned.mean(axis=0)
            size, along = np.linalg.svd(turned, full_matrices=False)[1:]
            along = along[size > _UNCHANGED * size[0]]
            within = _PART**2 * _power(turned) < power <= float(np.max(np.sum(turned**2, axis=1)))
            if within and _power(left - left @ along.T @ along) < TAKEN * power:
                whole_run = len(left) == len(data.t)
                span = "" if whole_run else f" from {data.t[rows][0]:.0f} s to {data.t[rows][-1]:.0f} s"
                where = f"{joint.name} is still in {one.entry.name}{span}"
                yield f"the angle of {where}, and the load changes as if it turned"


def _still(q: Array, apart: float) -> slice:
    """The longest stretch of angles (n,) that do not change, and are no more than `apart`."""
    same = np.concatenate([[False], np.abs(np.diff(q)) <= _CREEP * apart, [False]])
    edges = np.flatnonzero(same[1:] != same[:-1]).reshape(-1, 2)
    still = [slice(start, end + 1) for start, end in edges if np.ptp(q[start : end + 1]) <= apart]
    return max(still, key=lambda rows: int(rows.stop - rows.start), default=slice(0, 1))


def _rests(joint: str, run: Run, begin: float, end: float) -> bool:
    """Whether commands say that a joint does not turn from `begin` to `end`, s."""
    told = commanded(run)
    if told is None or joint not in told.channels:
        return False
    then = told.column(joint)[(told.t >= begin) & (told.t <= end)]
    return bool(np.ptp(then) < _TOLD) if len(then) else False


def _power(x: Array) -> float:
    """Mean square length of the rows of x (n, c)."""
    return float(np.mean(np.sum(x**2, axis=1)))


def repeated(recordings: Sequence[Prepared]) -> Iterator[str]:
    """Channels and joints that repeat another one, reading by reading: from another zero, or the other way."""
    for one in recordings:
        for signal in (one.raw, one.run.angle):
            if signal is None or not signal.valid.any():
                continue
            values = signal.values[signal.valid] - signal.values[signal.valid][0]
            least = _SAME * np.abs(signal.values[signal.valid]).max(0)
            for (a, x), (b, y) in combinations(enumerate(values.T), 2):
                apart = min(np.abs(x - y).max(), np.abs(x + y).max())
                if apart <= max(least[a], least[b]) < min(np.ptp(x), np.ptp(y)):
                    names = signal.channels
                    yield f"{names[b]} repeats {names[a]} in {one.entry.name}: one stream is read twice"


def mistimed(campaign: Campaign, recordings: Sequence[Prepared]) -> Iterator[str]:
    """Angles that change faster or slower than their rates say; commands without rates in another cycle than stated.

    The true slope lies between both regressions, whatever noise is in either.
    """
    cycle = campaign.rig.controller.cycle if campaign.drive == "command" and campaign.rig.controller else 0.0
    for one in recordings:
        for what, moved, due in _paces(one.run, float(cycle)):
            both = float(moved @ due)
            if both > 0.0 and not both < RATED * min(due @ due, moved @ moved):
                times = float(np.sqrt((moved @ moved) / (due @ due)))
                yield f"{what} in {one.entry.name} is {times:.3g}, expected 1"


def _paces(run: Run, cycle: float) -> Iterator[tuple[str, Array, Array]]:
    """Steps (n,) by what changes from sample to sample, and as they are due by rates, or by the stated `cycle`, s."""
    if run.command is not None and len(run.command.t) > 1:
        step = np.diff(run.command.t)
        column = dict(zip(run.command.channels, run.command.values.T, strict=True))
        rates = {name.removesuffix(".rate"): x for name, x in column.items() if name.endswith(".rate") and x.any()}
        for joint, x in rates.items():
            yield f"slope of command {joint} against its rate", np.diff(column[joint]), x[:-1] * step
        if cycle and not rates:
            yield "interval of commands over controller.cycle", np.atleast_1d(np.median(step)), np.array([cycle])
    if run.angle is not None and run.rate is not None:
        known = run.angle.valid & run.rate.valid
        for joint in (name for name in run.angle.channels if name in run.rate.channels):
            moved = np.gradient(run.angle.column(joint), run.angle.dt)[known]
            yield f"slope of angle {joint} against its rate", moved, run.rate.column(joint)[known]
