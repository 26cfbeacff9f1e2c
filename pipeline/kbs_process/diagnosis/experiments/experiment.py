"""An experiment as the diagnosis sees it: trials on one grid a trajectory, and what drove them.

Repeats of a trajectory are laid on one time grid, so that what they share and what they differ by can be told sample by
sample; those that were driven alike share one simulation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from scipy.ndimage import maximum_filter1d

from kbs_process.diagnosis.experiments.stamps import between
from kbs_process.plant.predict import Schedule
from kbs_process.rig.model import Rig
from kbs_process.signals.records import Array, Loss, Mask, Run, Signal
from kbs_process.stages.align.clocks import offset_sigma
from kbs_process.stages.align.resample import PASS
from kbs_process.stages.motion import Motion
from kbs_process.stages.repeats import lag, motion_of

Role = Literal["calibration", "fit", "held-out"]
_SAME_FIELD = 0.5  # microsteps, and _SAME_COMMAND rad: two drives that differ by less move the article alike
_SAME_COMMAND = 1e-6
_SAME_RATE = 0.02  # relative, of two recorders of one kind
_IN_COMMON = 0.4  # of a recording: that much has to be there in all its repeats
_THERE = 0.99  # of a sample between others, that these have
_ALIKE = 1e-9  # s, shift below which nothing is interpolated


@dataclass(frozen=True, slots=True, eq=False)
class Recorded:
    """A recording as it comes from the stages, decoupled; either commands or its motion drive the rig."""

    role: Role
    trajectory: str
    run: Run
    schedule: Schedule | None
    motion: Motion | None
    known_from: float = 0.0  # s, from which on it is known what drove the joints, and
    known_until: float = np.inf  # s, until which
    unknown: tuple[tuple[float, float], ...] = ()  # s, spans between these in which it is not
    absent: tuple[str, ...] = ()  # effects of the model that did not act in this recording


@dataclass(frozen=True, slots=True, eq=False)
class Drive:
    """What moved the joints, on a trajectory's grid of `n` samples that begins at its time zero."""

    trajectory: int
    n: int
    schedule: Schedule | None
    motion: Motion | None
    wrench_rate: float  # Hz, as recorded
    angle_rate: float
    absent: tuple[str, ...] = ()  # effects of the model that did not act


@dataclass(frozen=True, slots=True, eq=False)
class Trial:
    """One recording on its trajectory's grid; `measured` is zero where it is not `valid`."""

    name: str
    role: Role
    trajectory: int
    drive: int
    measured: Array  # (n, c)
    valid: Mask  # (n,)
    wrench_rate: float  # Hz, as recorded
    angle_rate: float
    wrench_clock_sigma: float  # s, of the wrench's clock against what drove the rig
    angle_clock_sigma: float
    temperature: Array | None  # (n,) degC
    losses: tuple[Loss, ...] = ()  # what the recording lacks


@dataclass(frozen=True, slots=True, eq=False)
class Experiment:
    """All trials of a campaign. `rig` is that of the parameter files: its sigmas are the priors."""

    rig: Rig
    effects: tuple[str, ...]
    dt: float  # s
    channels: tuple[str, ...]  # loads (wrench decoupled, then efforts), then the joints whose angle is measured
    units: tuple[str, ...]
    drives: tuple[Drive, ...]
    trials: tuple[Trial, ...]
    highest_Hz: float  # up to which predictions are whole

    @property
    def wrench_channels(self) -> int:
        return len(self.rig.transducer.channels)

    @property
    def loads(self) -> int:
        """Channels before the angles."""
        return len(self.rig.channels)

    @property
    def angle_joints(self) -> tuple[int, ...]:
        """Places, among the rig's joints, of those whose angle is a channel."""
        names = self.rig.joint_names
        return tuple(names.index(channel) for channel in self.channels[self.loads :])

    @property
    def fit(self) -> tuple[int, ...]:
        """Trials that may be fitted: all that are not held out."""
        return tuple(k for k, trial in enumerate(self.trials) if trial.role != "held-out")

    @property
    def held_out(self) -> tuple[int, ...]:
        return tuple(k for k, trial in enumerate(self.trials) if trial.role == "held-out")

    @property
    def repeats(self) -> tuple[tuple[int, ...], ...]:
        """Trials of each trajectory."""
        count = 1 + max(trial.trajectory for trial in self.trials)
        return tuple(
            tuple(k for k, trial in enumerate(self.trials) if trial.trajectory == number) for number in range(count)
        )

    def reference(self, trajectory: int) -> int:
        """The drive by which a trajectory's sensitivities are taken: that of its first trial which is not held out."""
        own = [trial for trial in self.trials if trial.trajectory == trajectory]
        return next((trial.drive for trial in own if trial.role != "held-out"), own[0].drive)


def assemble(
    recorded: Sequence[Recorded], rig: Rig, effects: Sequence[str], *, highest_Hz: float | None = None
) -> Experiment:
    """Bring recordings onto the grids of their trajectories; recordings that do not repeat others stay alone.

    `highest_Hz` bounds the band that is looked at, below what the working rate passes.
    """
    driven_by_motion = recorded[0].schedule is None
    first = _loads(recorded[0].run)
    channels, units = _channels(recorded[0], rig, driven_by_motion)
    trials: list[Trial] = []
    drives: list[Drive] = []
    for number, members in enumerate(_trajectories(recorded, channels)):
        reference = members[0][0]
        own: list[int] = []
        for one, shift in members:
            drive = _drive(one, reference, shift, number)
            place = next((k for k in own if _alike(drives[k], drive, rig)), None)
            if place is None:
                place = len(drives)
                drives.append(drive)
                own.append(place)
            trials.append(_trial(one, shift, number, place, drives[own[0]].n, channels))
    order = {one.run.name: k for k, one in enumerate(recorded)}
    passed = PASS / first.dt
    return Experiment(
        rig=rig,
        effects=tuple(effects),
        dt=first.dt,
        channels=channels,
        units=units,
        drives=tuple(drives),
        trials=tuple(sorted(trials, key=lambda trial: order[trial.name])),
        highest_Hz=passed if highest_Hz is None else min(passed, highest_Hz),
    )


def _channels(one: Recorded, rig: Rig, driven_by_motion: bool) -> tuple[tuple[str, ...], tuple[str, ...]]:
    loads = _loads(one.run)
    # Angles that drive the rig are no output of it.
    seen = () if driven_by_motion or one.run.angle is None else one.run.angle.channels
    angles = tuple(name for name in rig.joint_names if name in seen)
    return (*rig.channels, *angles), (*loads.units, *("rad",) * len(angles))


def _loads(run: Run) -> Signal:
    assert run.loads is not None  # without loads nothing is diagnosed
    return run.loads


def _seen(one: Recorded, channels: Sequence[str]) -> Mask:
    """Where all of a recording's channels are there, and what drove it is known, on the grid of its loads."""
    loads, angle = _loads(one.run), one.run.angle
    seen = loads.valid & (loads.t >= one.known_from) & (loads.t <= one.known_until)
    for start, end in one.unknown:
        seen = seen & ~((loads.t > start) & (loads.t < end))
    if angle is not None and any(name not in loads.channels for name in channels):
        seen = seen & angle.valid
    if one.motion is not None:
        moved = one.motion
        own = moved.t0 + moved.dt * np.arange(len(moved))
        known = np.interp(loads.t, own, moved.valid, 0.0, 0.0) > _THERE
        # Angles alone are missing: beside what was made up for them they are wrong, too.
        invented = (loads.valid & ~known).astype(np.float64)
        seen = seen & known & ~(maximum_filter1d(invented, 2 * round(moved.reach / loads.dt) + 1) > 0.0)
    return np.asarray(seen, dtype=np.bool_)


def _trajectories(recorded: Sequence[Recorded], channels: Sequence[str]) -> list[list[tuple[Recorded, float]]]:
    """Recordings that repeat each other with the time (s) by which each is later than the first, the longest.

    Those of which gaps leave too little at the same time stay apart, whatever they repeat, and so do those that were
    sampled at other rates: their noise is another one.
    """
    groups: list[list[tuple[Recorded, float]]] = []
    common: list[Mask] = []  # of each group, where all its members are valid
    for one in sorted(recorded, key=lambda r: -_length(r.run)):
        moved = motion_of(one.run)
        assert moved is not None
        seen = _seen(one, channels)
        for number, group in enumerate(groups):
            reference = group[0][0]
            if reference.trajectory != one.trajectory or not _sampled_alike(reference.run, one.run):
                continue
            target = motion_of(reference.run)
            assert target is not None
            shift = lag(target, moved)
            if shift is None:
                continue
            t = _loads(reference.run).t + shift
            both = common[number] & _seen_at(t, _loads(one.run), seen)
            longest = max(np.count_nonzero(_seen(reference, channels)), np.count_nonzero(seen))
            if np.count_nonzero(both) >= _IN_COMMON * longest:
                group.append((one, shift))
                common[number] = both
                break
        else:
            groups.append([(one, 0.0)])
            common.append(seen)
    return groups


def _sampled_alike(one: Run, other: Run) -> bool:
    """Whether loads and angles were sampled at the same rates, but for what clocks differ by."""
    first, second = ((run.rates.get("angle", _rate(run)), _rate(run)) for run in (one, other))
    return bool(np.allclose(first, second, rtol=_SAME_RATE))


def _seen_at(t: Array, loads: Signal, seen: Mask) -> Mask:
    return np.asarray(np.interp(t, loads.t, seen, left=0.0, right=0.0) > _THERE, dtype=np.bool_)


def _length(run: Run) -> int:
    return len(_loads(run))


def _drive(one: Recorded, reference: Recorded, shift: float, trajectory: int) -> Drive:
    return Drive(
        trajectory=trajectory,
        n=_length(reference.run),
        schedule=None if one.schedule is None else _earlier(one.schedule, shift),
        motion=None if one.motion is None else _on_grid(one.motion, shift, _length(reference.run)),
        wrench_rate=_rate(one.run),
        angle_rate=one.run.rates.get("angle", _rate(one.run)),
        absent=one.absent,
    )


def _rate(run: Run) -> float:
    return run.rates["wrench"] if "wrench" in run.rates else run.rates["effort"]


def _earlier(schedule: Schedule, shift: float) -> Schedule:
    return Schedule(schedule.t - shift, schedule.position, schedule.rate, schedule.field, schedule.encoder)


def _on_grid(motion: Motion, shift: float, n: int) -> Motion:
    """Motion is band-limited: what is interpolated is no less exact than what was recorded."""
    count = motion.rounding.shape[0]
    stacked = np.hstack([motion.q, motion.qd, motion.qdd, motion.sigma_q, *motion.rounding])
    moved, valid = _moved(stacked, motion.valid, motion.dt, motion.t0, shift, n)
    joints = motion.q.shape[1]
    parts = [moved[:, k * joints : (k + 1) * joints] for k in range(4 + count)]
    q, qd, qdd, sigma_q = parts[:4]
    return replace(motion, t0=0.0, q=q, qd=qd, qdd=qdd, sigma_q=sigma_q, rounding=np.stack(parts[4:]), valid=valid)


def _alike(one: Drive, other: Drive, rig: Rig) -> bool:
    """Whether two drives move the article alike, over the time that both know."""
    a, b = one.schedule, other.schedule
    if (
        a is None
        or b is None
        or one.absent != other.absent
        or (one.wrench_rate, one.angle_rate) != (other.wrench_rate, other.angle_rate)
    ):
        return False
    t = a.t[(a.t >= b.t[0]) & (a.t <= b.t[-1])]
    if (a.field is None) != (b.field is None) or len(t) < 0.5 * len(a.t):
        return False
    if a.field is not None and b.field is not None:
        steps = [float(joint.drive.steps_per_turn) if joint.drive else 1.0 for joint in rig.joints]
        apart = _at(t, a.t, a.field) - _at(t, b.t, b.field)
        return bool(np.all(np.abs(apart) * steps < _SAME_FIELD * 2.0 * np.pi))
    if rig.controller is not None and rig.controller.loop == "closed":
        return False
    return bool(np.all(np.abs(_at(t, a.t, a.position) - _at(t, b.t, b.position)) < _SAME_COMMAND))


def _at(t: Array, own: Array, values: Array) -> Array:
    return np.stack([np.interp(t, own, column) for column in values.T], axis=1)


def _trial(one: Recorded, shift: float, trajectory: int, drive: int, n: int, channels: Sequence[str]) -> Trial:
    run, loads = one.run, _loads(one.run)
    columns = []
    for channel in channels:
        source = loads if channel in loads.channels else run.angle
        assert source is not None
        columns.append(source.column(channel))
    dt = loads.dt
    measured, inside = _moved(np.stack(columns, axis=1), _seen(one, channels), dt, loads.t0, shift, n)
    driven = run.clocks.get("field") or run.clocks.get("command")
    late = 0.0 if driven is None else offset_sigma(driven)
    angle = run.clocks.get("angle")
    temperature = None
    if run.temperature is not None:
        temperature = np.interp(dt * np.arange(n) + shift, run.temperature.t, run.temperature.values[:, 0])
    return Trial(
        name=run.name,
        role=one.role,
        trajectory=trajectory,
        drive=drive,
        measured=measured * inside[:, None],
        valid=inside,
        wrench_rate=_rate(run),
        angle_rate=run.rates.get("angle", _rate(run)),
        wrench_clock_sigma=late,
        angle_clock_sigma=0.0 if angle is None else float(np.hypot(late, offset_sigma(angle))),
        temperature=temperature,
        losses=run.losses,
    )


def _moved(values: Array, valid: Mask, dt: float, t0: float, shift: float, n: int) -> tuple[Array, Mask]:
    """Values (m, k) at k dt + shift, k < n, by the interpolation that made the working rate; exact in its band."""
    own = dt * np.arange(n, dtype=np.float64) + (shift - t0)
    if abs(shift - t0) < _ALIKE and len(values) >= n:
        return values[:n], valid[:n]
    return between(values, valid, dt, own)
