"""The planned day, flown: what the controller is told, and what the plant does."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from kbs_process.campaign.config import Campaign
from kbs_process.mission.planner import Plan
from kbs_process.plant.predict import Schedule, predict
from kbs_process.rig.model import Rig
from kbs_process.signals.records import WRENCH_CHANNELS, Array, Block, Signal
from kbs_process.stages.align.condense import CondenseSettings, condense
from kbs_process.stages.gravity.equation import encoder_offsets

WRENCH_RATE = 100.0  # Hz: the low-pass before the samples lets nothing alias into the bands


@dataclass(frozen=True, slots=True, eq=False)
class Flown:
    """What the plant did on the planned commands, on the day's own time axis."""

    angle: Signal  # true joint angles, rad
    wrench: Signal  # on the spacecraft at the interface, in T


def commands(planned: Plan, rig: Rig) -> Schedule:
    """Return what the controller is told at the start of every cycle, for the plan's angles.

    The desired rate is the plan's motion over the coming cycle, which the controller feeds forward. Its closed loop
    compares the desired angle with an encoder reading that is `latency` cycles old, so that it is given the
    angle desired then: with the present one the antenna would lead its plan by rate x latency x cycle.
    """
    controller = rig.controller
    assert controller is not None  # by load_day
    delay = controller.latency if controller.loop == "closed" else 0
    ahead = np.diff(planned.q, axis=0)
    rate = np.concatenate([ahead, ahead[-1:]]) / float(controller.cycle)
    position = planned.q[np.maximum(np.arange(len(planned.q)) - delay, 0)]
    return Schedule(planned.t, position, rate)


def fly(campaign: Campaign, planned: Plan, duration: float, update: Callable[[float], None] | None = None) -> Flown:
    """Simulate the day in one piece, a block at a time; only the working rate is kept."""
    rig, rate = campaign.rig, campaign.bands.working_rate
    angles: list[Array] = []
    blocks = predict(
        rig,
        campaign.effects,
        commands(planned, rig),
        rate_Hz=WRENCH_RATE,
        angle_rate_Hz=rate,
        duration_s=duration,
        quantise=False,
        progress=update,
    )
    run = condense(
        campaign.name,
        _aside(blocks, angles),
        {"wrench": WRENCH_CHANNELS},
        CondenseSettings(working_rate_Hz=rate),
        keep_spikes=True,
    )
    assert run.wrench is not None  # the plant gives one
    q = np.concatenate(angles) - encoder_offsets(rig)
    names = rig.joint_names
    valid = np.ones(len(q), dtype=np.bool_)
    angle = Signal(0.0, 1.0 / rate, q, names, ("rad",) * len(names), "joint", valid, ("true angle of the plant",))
    return Flown(angle, run.wrench)


def _aside(blocks: Iterator[tuple[str, Block]], angles: list[Array]) -> Iterator[tuple[str, Block]]:
    """Pass the wrench on, and put the angles aside: they are instants, not to be filtered."""
    for key, block in blocks:
        if key == "angle":
            angles.append(block.values)
        elif key == "wrench":
            yield key, block
