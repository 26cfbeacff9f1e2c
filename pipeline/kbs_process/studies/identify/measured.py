"""From a condensed recording to what the identification compares with the plant."""

from __future__ import annotations

import math

from kbs_process.errors import RecordingError
from kbs_process.identification.output_error import Measured
from kbs_process.reduction.predicting import schedule_of
from kbs_process.rig.model import Rig
from kbs_process.signals.records import Run
from kbs_process.stages.align.clocks import offset_sigma


def measured(run: Run, rig: Rig) -> Measured:
    """Return wrench and angles of a run with what drove it.

    Raises RecordingError where there is no wrench, no angle or no command.
    """
    if run.wrench is None or run.angle is None:
        raise RecordingError(
            "an identification needs wrench and joint angles",
            where=run.name,
            remedy="give this recording another role than 'fit'",
        )
    unread = [name for name in rig.joint_names if name not in run.angle.channels]
    if unread:
        raise RecordingError(
            f"an identification needs the angle of every joint, and {', '.join(unread)} is not read",
            where=run.name,
            remedy="record it, and list it as one of `joints` of [topics.encoder] in campaign.toml; processing and "
            "diagnose do without",
        )
    driven = "field" if run.field is not None else "command"
    return Measured(
        name=run.name,
        dt=run.wrench.dt,
        wrench=run.wrench.values,
        angle=run.angle.values,
        valid=run.wrench.valid & run.angle.valid,
        schedule=schedule_of(run, rig),
        wrench_rate=run.rates["wrench"],
        angle_rate=run.rates["angle"],
        clock_sigma=offset_sigma(run.clocks[driven]),
        angle_clock_sigma=math.hypot(offset_sigma(run.clocks[driven]), offset_sigma(run.clocks["angle"])),
    )
