"""The planned day, flown: what the controller is told, and what the plant does."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from kbs_process.campaign.config import Campaign
from kbs_process.errors import ConfigError
from kbs_process.mission.planner import Plan
from kbs_process.plant.predict import Schedule, predict
from kbs_process.rig.model import Amplifier, Quantity, Rig
from kbs_process.signals.records import WRENCH_CHANNELS, Array, Block, Signal
from kbs_process.signals.spatial import transform_wrench
from kbs_process.stages.align.condense import CondenseSettings, condense
from kbs_process.stages.gravity.equation import encoder_offsets
from kbs_process.stages.to_cog import pose

TORQUES = WRENCH_CHANNELS[3:]
WRENCH_RATE = 200.0  # Hz
# Nothing in flight has an amplifier: this one lets nothing alias, and ends the widest band. The rotors' modes near
# 200 Hz are down to 0.4 % there.
CORNER = 50.0  # Hz
_LOW_PASS = Amplifier(4, Quantity("transducer.amplifier.corner", np.array(CORNER), "Hz", np.zeros(()), "sampling"))


@dataclass(frozen=True, slots=True, eq=False)
class Flown:
    """What the plant did on the planned commands, on the day's own time axis."""

    angle: Signal  # true joint angles, rad
    wrench: Signal  # on the spacecraft at the interface, in T, at the working rate
    torque: Signal  # at the spacecraft's centre of mass, up to `CORNER`


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
    rate = campaign.bands.working_rate
    rig = replace(campaign.rig, transducer=replace(campaign.rig.transducer, amplifier=_LOW_PASS))
    if rig.spacecraft is None:
        raise ConfigError(
            "nothing says where the spacecraft's centre of mass is",
            where=campaign.name,
            remedy="describe [spacecraft] in a parameter file",
        )
    angles: list[Array] = []
    torques: list[Array] = []
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
        _aside(blocks, pose(rig.spacecraft), angles, torques),
        {"wrench": WRENCH_CHANNELS},
        CondenseSettings(working_rate_Hz=rate),
        keep_spikes=True,
    )
    assert run.wrench is not None  # the plant gives one
    q = np.concatenate(angles) - encoder_offsets(rig)
    at = (f"at the spacecraft's centre of mass, below {CORNER:g} Hz",)
    return Flown(
        angle=_signal(q, 1.0 / rate, rig.joint_names, "rad", "joint", ("true angle of the plant",)),
        wrench=run.wrench,
        torque=_signal(np.concatenate(torques), 1.0 / WRENCH_RATE, TORQUES, "N m", "S", at),
    )


def _signal(x: Array, dt: float, channels: tuple[str, ...], unit: str, frame: str, history: tuple[str, ...]) -> Signal:
    return Signal(0.0, dt, x, channels, (unit,) * len(channels), frame, np.ones(len(x), dtype=np.bool_), history)


def _aside(
    blocks: Iterator[tuple[str, Block]], at: tuple[Array, Array], angles: list[Array], torques: list[Array]
) -> Iterator[tuple[str, Block]]:
    """Pass the wrench on, and put aside the angles, which are instants, not to be filtered, and the torques."""
    for key, block in blocks:
        if key == "angle":
            angles.append(block.values)
        elif key == "wrench":
            torques.append(transform_wrench(block.values, *at)[:, 3:].copy())
            yield key, block
