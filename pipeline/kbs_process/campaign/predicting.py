"""The plant's prediction of a run, sent through the same reduction as the measurement."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from kbs_process.errors import RecordingError
from kbs_process.plant.predict import Schedule, predict
from kbs_process.rig.model import Rig
from kbs_process.signals.records import WRENCH_CHANNELS, Array, Events, Run
from kbs_process.stages.condense import CondenseSettings, condense


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
    rate = (
        _columns(command, rates)
        if set(rates) <= set(command.channels)
        else np.gradient(position, command.t, axis=0)
    )
    return Schedule(
        t=command.t,
        position=position,
        rate=rate,
        field=None if run.field is None else _at(run.field, names, command.t),
        encoder=None if run.encoder is None else _latest(run.encoder, names, command.t),
    )


def predict_run(
    rig: Rig,
    effects: Sequence[str],
    run: Run,
    settings: CondenseSettings,
    progress: Callable[[float], None] | None = None,
) -> Run:
    """Predict wrench and encoder angles of a command-driven run, on its own time grid."""
    wrench = run.wrench
    if wrench is None:
        raise RecordingError("this recording has no wrench to predict", where=run.name)
    blocks = predict(
        rig,
        effects,
        schedule_of(run, rig),
        rate_Hz=run.rates["wrench"],
        angle_rate_Hz=run.rates.get("angle", wrench.rate),
        duration_s=wrench.t0 + len(wrench) * wrench.dt,
        quantise=False,
        progress=progress,
    )
    channels = {"wrench": WRENCH_CHANNELS, "angle": rig.joint_names, "field": rig.joint_names}
    return condense(run.name, blocks, channels, settings)


def _columns(events: Events, names: Sequence[str]) -> Array:
    return events.values[:, [events.channels.index(name) for name in names]]


def _at(events: Events, names: Sequence[str], t: Array) -> Array:
    """Interpolate linearly: the field moves linearly within a cycle."""
    return np.stack([np.interp(t, events.t, column) for column in _columns(events, names).T], axis=1)


def _latest(events: Events, names: Sequence[str], t: Array) -> Array:
    """The last reading at or before each time: what the controller had."""
    index = np.clip(np.searchsorted(events.t, t, side="right") - 1, 0, None)
    latest: Array = _columns(events, names)[index]
    return latest
