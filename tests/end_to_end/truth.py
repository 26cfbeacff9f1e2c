"""What is true of the archived recordings, from the engine that made them: parameters, static wrench, disturbance."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import mujoco
import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import firwin, oaconvolve

from engine.archive import TRUTH_FOLDER
from engine.campaigns import CAMPAIGNS, Run
from engine.hardware import Array, Hardware
from engine.rigid import AZ, EL, build
from engine.simulation import TIME_STEP, amplify, at, equilibrium, integrate
from engine.trajectories import TRAJECTORIES, Commands

OVERSAMPLED = 10  # rate at which the truth is low-passed before it is taken down to the rate asked for


@dataclass(frozen=True)
class Truth:
    """The hardware of one campaign, as drawn."""

    name: str

    @cached_property
    def document(self) -> dict[str, Any]:
        """The truth file."""
        return json.loads((TRUTH_FOLDER / f"{self.name}.json").read_text())

    @cached_property
    def nominal(self) -> Hardware:
        """What the campaign's parameter files say."""
        return Hardware.from_campaign(CAMPAIGNS[self.name].folder)

    @cached_property
    def coupling(self) -> Array:
        """Cross-coupling that is left after the calibrated matrix is undone: (I + X_cal)^-1 (I + X) - I, (6, 6)."""
        calibrated = np.eye(6) + self.nominal["transducer.cross_coupling"]
        true = np.eye(6) + np.array(self.document["hardware"]["transducer.cross_coupling"])
        return np.linalg.solve(calibrated, true) - np.eye(6)

    def parameter(self, name: str) -> float:
        """True value of a fitted parameter: `body.antenna.cog[0]`, `transducer.cross_coupling[0,3]`."""
        stem, _, index = name.rstrip("]").partition("[")
        value = self.coupling if stem.endswith("cross_coupling") else np.array(self.document["hardware"][stem])
        return float(value[tuple(int(i) for i in index.split(","))] if index else value)

    def runs(self) -> Iterator[TrueRun]:
        """Yield the runs in the order of the campaign."""
        for index in range(len(CAMPAIGNS[self.name].runs)):
            yield TrueRun(self, index)


@dataclass(frozen=True)
class TrueRun:
    """One recording's run."""

    truth: Truth
    index: int

    @property
    def run(self) -> Run:
        """How it was made."""
        return CAMPAIGNS[self.truth.name].runs[self.index]

    @property
    def recording(self) -> str:
        """Its name in the results."""
        return self.run.file.removesuffix(".mcap")

    @cached_property
    def hardware(self) -> Hardware:
        """The hardware as it was in this run, without any cord."""
        document = self.truth.document
        changed = document["recordings"][self.index]["hardware_in_this_run"]
        return self.truth.nominal.with_values(document["hardware"] | changed)

    @property
    def commands(self) -> Commands:
        """Its commands."""
        return TRAJECTORIES[self.run.trajectory]()

    def static(self, commanded: Array) -> tuple[Array, Array]:
        """Joint angles (2,) and wrench (6,) at rest where the drives hold the `commanded` angles."""
        rigid = build(self.hardware, TIME_STEP)
        q = equilibrium(self.hardware, rigid, commanded)
        rigid.data.qpos[:] = q
        mujoco.mj_forward(rigid.model, rigid.data)
        return q[[AZ, EL]], -rigid.data.sensordata.copy()

    def disturbance(self, t: Array) -> Array:
        """Wrench less the static wrench at the true elevation, noise-free, at uniform times t; (n, 6).

        For runs in which elevation moves alone. Low-passed at 0.4 of the rate of t.
        """
        dense = integrate(self.hardware, self.commands)
        dt = (t[-1] - t[0]) / (len(t) - 1)
        fine = t[0] + dt / OVERSAMPLED * np.arange((len(t) - 1) * OVERSAMPLED + 1)
        wrench, angle = at(dense.t, amplify(self.hardware, dense), fine), at(dense.t, dense.q, fine)[:, EL]
        az = self.commands.position[0, 0]
        grid = [self.static(np.array([az, el])) for el in np.linspace(angle.min() - 0.01, angle.max() + 0.01, 60)]
        static = CubicSpline([q[1] for q, _ in grid], [w for _, w in grid])
        kernel = firwin(40 * OVERSAMPLED + 1, 0.8 / OVERSAMPLED)
        half = len(kernel) // 2
        left = np.pad(wrench - static(angle), ((half, half), (0, 0)), mode="edge")
        return np.asarray(oaconvolve(left, kernel[:, None], mode="valid", axes=0)[::OVERSAMPLED])
