"""The plant's prediction of a run, sent through the same reduction as the measurement."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from kbs_process.errors import RecordingError
from kbs_process.plant.predict import Schedule, predict
from kbs_process.results.kept import kept
from kbs_process.rig.model import Rig
from kbs_process.signals.records import WRENCH_CHANNELS, Array, Events, Run, Signal
from kbs_process.stages.align.condense import CondenseSettings, condense

LEAD = 10.0  # s at the first rate, after as long a ramp from rest: 3 to 4 time constants of 6 Hz at 1 % damping
AT_REST = 1e-4  # rad/s; a start at this rate shakes the article by a fiftieth of one at 0.3 deg/s

SAME_INSTANT = 1e-3  # s, between an encoder's sample and a cycle's start: what clocks are known to
LOST = 0.05  # share of cycles that may lack a sample


def schedule_of(run: Run, rig: Rig) -> Schedule:
    """Return what drove the motors: commands, and where they were recorded, field positions and encoders.

    Raises RecordingError for a run without commands.
    """
    if run.command is None:
        raise RecordingError(
            "this recording has no commands to drive the plant with",
            where=run.name,
            remedy='record the commands, or set drive = "motion" in campaign.toml',
        )
    names = rig.joint_names
    command = run.command
    rates = tuple(f"{name}.rate" for name in names)
    position = _columns(command, names)
    rate = _columns(command, rates) if set(rates) <= set(command.channels) else np.gradient(position, command.t, axis=0)
    return Schedule(
        t=command.t,
        position=position,
        rate=rate,
        field=None if run.field is None else _at(run.field, names, command.t),
        encoder=None if run.encoder is None else _readings(run.encoder, names, command.t),
    )


def approached(schedule: Schedule) -> Schedule:
    """Return the schedule with what must have come before a start in motion: a ramp from rest to the first rate.

    The plant starts at rest. Thrown into motion it would ring, and friction and windup would begin from the wrong side,
    in a recording that a test engineer merely started late.
    """
    if len(schedule.t) < 2:
        return schedule
    step = float(schedule.t[1] - schedule.t[0])
    first = (schedule.position[1] - schedule.position[0]) / step
    if np.abs(first).max() < AT_REST:
        return schedule
    cycle = float(np.median(np.diff(schedule.t)))
    ahead = cycle * np.arange(np.ceil(2.0 * LEAD / cycle), 0.0, -1.0)[:, None]  # s before the first command
    ramp = np.clip(ahead - LEAD, 0.0, LEAD)
    way = np.minimum(ahead, LEAD) + ramp - ramp**2 / (2.0 * LEAD)  # s at the first rate

    def before(values: Array | None, rate: Array) -> Array | None:
        return None if values is None else np.concatenate([values[0] - rate * way, values])

    turn = None if schedule.field is None else (schedule.field[1] - schedule.field[0]) / step
    return Schedule(
        t=np.concatenate([schedule.t[0] - ahead[:, 0], schedule.t]),
        position=np.concatenate([schedule.position[0] - first * way, schedule.position]),
        rate=np.concatenate([first * (1.0 - ramp / LEAD), schedule.rate]),
        field=before(schedule.field, first if turn is None else turn),
        encoder=before(schedule.encoder, first),
    )


def predict_run(
    rig: Rig,
    effects: Sequence[str],
    run: Run,
    settings: CondenseSettings,
    progress: Callable[[float], None] | None = None,
) -> Run:
    """Predict wrench and encoder angles of a command-driven run, on its own time grid.

    A run that begins in motion is led into it, see `approached`. Before the first recorded command nothing is valid.
    """
    wrench = run.wrench
    if wrench is None:
        raise RecordingError("this recording has no wrench to predict", where=run.name)
    schedule = approached(schedule_of(run, rig))
    rate, angle_rate, duration = (
        run.rates["wrench"],
        run.rates.get("angle", wrench.rate),
        wrench.t0 + len(wrench) * wrench.dt,
    )

    def made() -> Run:
        blocks = predict(
            rig,
            effects,
            schedule,
            rate_Hz=rate,
            angle_rate_Hz=angle_rate,
            duration_s=duration,
            quantise=False,
            progress=progress,
        )
        channels = {"wrench": WRENCH_CHANNELS, "angle": rig.joint_names, "field": rig.joint_names}
        return condense(run.name, blocks, channels, settings, keep_spikes=True)

    predicted = kept(
        "prediction", (run.name, rig, tuple(effects), schedule, rate, angle_rate, duration, settings), made
    )
    start = commanded_from(run)
    return replace(predicted, wrench=_known(predicted.wrench, start), angle=_known(predicted.angle, start))


def commanded_from(run: Run) -> float:
    """Return the time, s, from which commands are known to have driven the joints: a cycle before the first."""
    assert run.command is not None  # `schedule_of` demands it
    t = run.command.t
    return float(t[0] - np.median(np.diff(t))) if len(t) > 1 else float(t[0])


def _known(signal: Signal | None, start: float) -> Signal | None:
    """Flag what was predicted for a time before `start`: nobody recorded what drove the joints then."""
    if signal is None or start <= signal.t0:
        return signal
    step = f"not known before {start:.2f} s, the first command"
    return signal.derive(signal.values, step, valid=signal.valid & (signal.t >= start))


def _columns(events: Events, names: Sequence[str]) -> Array:
    return events.values[:, [events.channels.index(name) for name in names]]


def _at(events: Events, names: Sequence[str], t: Array) -> Array:
    """Interpolate linearly: the field moves linearly within a cycle."""
    return np.stack([np.interp(t, events.t, column) for column in _columns(events, names).T], axis=1)


def _readings(encoder: Events, names: Sequence[str], t: Array) -> Array | None:
    """What the controller read at each cycle's start; None where the encoders' recorder sampled at other instants, or
    does not read every joint.

    The recorded motion does not answer to the loop that it is fed to: a reading late by some milliseconds of a slew is
    an error that the controller integrates twice, degrees in minutes. A loop closed on its own encoder holds.
    """
    if not set(names) <= set(encoder.channels):
        return None
    after = np.clip(np.searchsorted(encoder.t, t), 1, len(encoder.t) - 1)
    nearest = after - (t - encoder.t[after - 1] < encoder.t[after] - t)
    missing = np.abs(encoder.t[nearest] - t) > SAME_INSTANT
    if np.mean(missing) > LOST:
        return None
    readings: Array = _columns(encoder, names)[nearest]
    return np.where(missing[:, None], np.nan, readings)  # interpolated by the plant's schedule
