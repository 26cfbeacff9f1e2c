"""Campaigns drawn from an archived one's priors, by the independent engine, with their truth.

What a user has of them is the campaign's parameter files and condensed recordings. `still` leaves the drives' dynamics
out, a hundred times faster: joints follow their commands with the gears' windup, wrench and plate are those at rest.
Sensors, clocks, drift, cross-coupling and rounding are the engine's own in either way.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any
from unittest.mock import patch

import mujoco
import numpy as np
from scipy.interpolate import CubicSpline

from engine import sensors
from engine.campaigns import CAMPAIGNS_FOLDER
from engine.hardware import Array, Hardware
from engine.rigid import AZ, EL, PLATE, ROTOR_AZ, ROTOR_EL, build
from engine.sensors import Stream
from engine.simulation import TIME_STEP, Dense, amplify, at, integrate
from engine.trajectories import TRAJECTORIES, Commands
from kbs_process.campaign.load import load_campaign
from kbs_process.rig.model import Rig
from kbs_process.signals.records import Block, Run
from kbs_process.stages import decouple
from kbs_process.stages.align.condense import CondenseSettings, condense

CALIBRATION = "AZPS_ATA"
FINE_S = 5e-3  # a tenth of the amplifier's fastest period
SAG_ROUNDS = 6  # each takes the error down a hundredfold


@dataclass(frozen=True)
class Drawn:
    """One recording as the pipeline gets it, decoupled, and what is true of it."""

    run: Run
    hardware: Hardware  # as it was in this run
    drift: Array  # (6,) N and N m at the end of warming up
    start: float  # s, true time of the run's time zero
    t: Array  # (m,) s, true time
    static: Array  # (m, 6) true static wrench at the true angles, behind the amplifier


@dataclass(frozen=True)
class DrawnCampaign:
    """Hardware drawn with `seed` around the parameter files of the archived campaign `name`."""

    name: str
    seed: int

    @property
    def folder(self):
        return CAMPAIGNS_FOLDER / self.name

    @cached_property
    def hardware(self) -> Hardware:
        return Hardware.from_campaign(self.folder, seed=self.seed)

    @cached_property
    def rig(self) -> Rig:
        return load_campaign(self.folder, checksums=False).rig

    @property
    def coupling(self) -> Array:
        """What is left of the cross-coupling (6, 6) after the calibrated matrix is undone."""
        calibrated = np.eye(6) + Hardware.from_campaign(self.folder)["transducer.cross_coupling"]
        return np.linalg.solve(calibrated, np.eye(6) + self.hardware["transducer.cross_coupling"]) - np.eye(6)

    def parameter(self, name: str) -> float:
        """True value of a fitted parameter: `body.antenna.cog[0]`, `transducer.cross_coupling[0,3]`."""
        stem, _, index = name.rstrip("]").partition("[")
        value = self.coupling if stem.endswith("cross_coupling") else self.hardware[stem]
        return float(value[tuple(int(i) for i in index.split(","))] if index else value)

    def record(self, trajectory: str, index: int, *, still: bool) -> Drawn:
        """Make recording number `index`."""
        rates = (50.0, 20.0) if trajectory == CALIBRATION else (100.0, 50.0)
        kept = []

        def simulate(hardware: Hardware, commands: Commands, **how: Any) -> Dense:
            dense = at_rest(hardware, commands) if still else integrate(hardware, commands, **how)
            kept.append(dense)
            return dense

        with patch.object(sensors, "integrate", simulate):
            recording = sensors.record(
                self.hardware,
                TRAJECTORIES[trajectory](),
                seed=1000 * self.seed + index,
                epoch_ns=0,
                wrench_hz=rates[0],
                encoder_hz=rates[1],
            )
        streams = {
            "wrench": recording.wrench,
            "angle": recording.encoder,
            "command": recording.command,
            "field": recording.field,
        }
        campaign = load_campaign(self.folder, checksums=False)
        run = condense(
            f"{trajectory}_{index}",
            ((key, _block(stream)) for key, stream in streams.items()),
            campaign.topics.channels(),
            CondenseSettings(working_rate_Hz=campaign.bands.working_rate),
        )
        clock = recording.wrench_clock
        start = (recording.wrench.stamp[0] * 1e-9 - clock.offset) / (1 + clock.skew)
        t, static = _static_history(recording.hardware, kept[0])
        return Drawn(decouple.apply(run, decouple.fit(self.rig)), recording.hardware, recording.drift, start, t, static)


def _block(stream: Stream) -> Block:
    return Block(stream.stamp, stream.log, stream.values)


def at_rest(hardware: Hardware, commands: Commands) -> Dense:
    """A run without the drives' dynamics: each instant as if at rest, rotors at their fields."""
    plate = _Plate(hardware)
    ratio = np.array([hardware.drive(axis, "ratio") for axis in ("az", "el")])
    stiffness = np.array([hardware.drive(axis, "Ka") for axis in ("az", "el")])
    wound = np.zeros(2)
    q, wrench = np.empty((len(commands.t), 7)), np.empty((len(commands.t), 6))
    for k, position in enumerate(commands.position):
        for _ in range(2):
            q[k], wrench[k], torque = plate.at(position - wound)
            wound = torque / stiffness
        q[k, [ROTOR_AZ, ROTOR_EL]] = ratio * position
    t = np.arange(0.0, commands.t[-1], FINE_S)
    return Dense(
        t, CubicSpline(commands.t, wrench)(t), CubicSpline(commands.t, q)(t), commands.t, ratio * commands.position
    )


class _Plate:
    """The rigid bodies at rest on their elastic plate."""

    def __init__(self, hardware: Hardware) -> None:
        self.rigid = build(hardware, TIME_STEP)
        self.stiffness = hardware["transducer.stiffness"]

    def at(self, angles: Array) -> tuple[Array, Array, Array]:
        """Coordinates (7,), wrench on the transducer (6,) and the joints' holding torques (2,) at joint angles (2,)."""
        model, data = self.rigid.model, self.rigid.data
        data.qpos[[AZ, EL]] = angles
        data.qvel[:] = 0
        data.qacc[:] = 0
        for _ in range(SAG_ROUNDS):
            mujoco.mj_inverse(model, data)
            data.qpos[PLATE] -= data.qfrc_inverse[PLATE] / self.stiffness
        mujoco.mj_inverse(model, data)
        return data.qpos.copy(), -data.sensordata.copy(), data.qfrc_inverse[[AZ, EL]].copy()


def _static_history(hardware: Hardware, dense: Dense) -> tuple[Array, Array]:
    """Time (m,) and static wrench (m, 6) along the true angles, as late as the amplifier makes it."""
    plate = _Plate(hardware)
    coarse = np.arange(dense.t[0], dense.t[-1], 0.1)
    angles = at(dense.t, dense.q[:, [AZ, EL]], coarse)
    wrench = np.array([plate.at(q)[1] for q in angles])
    t = np.arange(coarse[0], coarse[-1], FINE_S)
    fine = Dense(t, CubicSpline(coarse, wrench)(t), np.empty((0, 7)), dense.field_t, dense.field)
    step = 10
    return t[::step], amplify(hardware, fine)[::step]


def truth_of(campaign: DrawnCampaign, drawn: Drawn) -> Array:
    """What the fitted static wrench of a recording estimates, on its grid (n, 6): the coupling's rest included.

    Its constant is bias and mean drift.
    """
    t = drawn.start + drawn.run.wrench.t
    static = at(drawn.t, drawn.static, t) @ (np.eye(6) + campaign.coupling).T
    wandering = np.mean(1 - np.exp(-t / sensors.DRIFT_TIME)) * drawn.drift
    calibrated = np.eye(6) + Hardware.from_campaign(campaign.folder)["transducer.cross_coupling"]
    return static + np.linalg.solve(calibrated, drawn.hardware["transducer.bias"] + wandering)
