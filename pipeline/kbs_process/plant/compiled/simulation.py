"""A plant in motion: its state, and the samples that its sensors take of it."""

from __future__ import annotations

import numpy as np

from kbs_process.errors import DivergenceError
from kbs_process.plant.amplifier import discretised, steady
from kbs_process.plant.compiled.compile import compiled_plant
from kbs_process.plant.compiled.equilibrium import at_rest
from kbs_process.plant.compiled.stepping import state_layout
from kbs_process.plant.compiled.taps import OF_JOINTS
from kbs_process.plant.effect import Effect
from kbs_process.plant.schedule import Schedule, covering
from kbs_process.plant.structure import FIRST, JOINTS, MICROSTEP, RATIO, parameters, structure_of
from kbs_process.rig.model import Rig
from kbs_process.signals.records import Array


class Simulation:
    """The plant of `rig` with `effects`, at rest under the first command; `advance` moves it on.

    A recorded field has in it what changed it before: effects that are `recorded` do not act again.

    Time is counted in whole steps from the recording's time zero, so that nothing drifts over a day.
    """

    def __init__(
        self,
        rig: Rig,
        effects: tuple[Effect, ...],
        schedule: Schedule,
        *,
        step: float,
        per_sample: int,
        angle_rate: float,
        end: float,
        taps: bool = False,
    ) -> None:
        self.step, self.per_sample, self.angle_rate, self.taps = step, per_sample, angle_rate, taps
        acting = tuple(one for one in effects if schedule.field is None or not one.recorded)
        self.structure = structure_of(rig, acting)
        self.plant = compiled_plant(self.structure)
        self.p = parameters(rig, self.structure)
        n = self.structure.joints
        controller = rig.controller
        cycles = covering(schedule, n, float(controller.cycle) if controller else None, end)
        offsets = JOINTS + np.arange(n) * self.structure.stride
        self.microsteps = self.p[offsets + MICROSTEP]  # a radian of the motor
        per_output = self.microsteps * self.p[offsets + RATIO]
        self.knots = cycles.t
        self.fields = cycles.position * per_output if cycles.field is None else cycles.field * self.microsteps
        self.p[offsets + FIRST] = self.fields[0]
        self.first = int(np.ceil(self.knots[0] / step / per_sample - 1e-9)) * per_sample
        self.cycles = cycles
        self.closed = cycles.field is None and controller is not None and controller.loop == "closed"
        self.recorded = cycles.encoder is not None
        self.latency = controller.latency if controller else 0
        gains = (controller.Kp.value, controller.Ki.value) if controller else (0.0, 0.0)
        self.gains = np.stack([np.broadcast_to(gains[0], n), np.broadcast_to(gains[1], n), per_output])
        self.encoder = np.array(
            [
                [float(joint.encoder.step) if joint.encoder else 0.0 for joint in rig.joints],
                [float(joint.encoder.offset) if joint.encoder else 0.0 for joint in rig.joints],
            ]
        )
        self.readings = np.zeros_like(self.fields) if cycles.encoder is None else cycles.encoder
        self.sums = np.zeros(n)
        self.cursor = np.zeros(2, dtype=np.int64)
        self.state, self.wrench = at_rest(self.plant, self.structure, self.p, self.fields[0])
        self.low_pass, self.drive_in = discretised(rig.transducer.amplifier, step)
        self.amplified = steady(len(self.drive_in), self.wrench)

    @property
    def controlled(self) -> int:
        """Cycles whose field motion is settled; `fields` holds one row more."""
        return int(self.cursor[1])

    def part(self, name: str) -> Array:
        """Return a view of one part of the state vector: see `generate.state_layout`."""
        view: Array = self.state[state_layout(self.structure)[name]]
        return view

    def advance(self, steps: int, angle_first: int) -> tuple[Array, Array, Array]:
        """Move on by `steps` (whole sample intervals); return the samples taken of wrench, angles and taps.

        The wrench, shape (n, 6), is that at the steps that `per_sample` divides; angles, shape (m, joints),
        are unquantised, from sample number `angle_first` on, at times after the start and up to the end.
        Taps, at the instants of the wrench's samples, have the columns of `taps.tap_columns`, and no rows unless
        the simulation was made with `taps`.
        """
        n = self.structure.joints
        wrench = np.empty((-(-steps // self.per_sample), 6))
        span = steps * self.step
        angle = np.empty((int(span * self.angle_rate) + 2, n))
        states = np.empty((len(wrench) if self.taps else 0, len(self.state) + n))
        taken = self.plant.advance(
            self.first, steps, self.step, self.p, self.state, self.cursor, self.closed, self.recorded,
            self.latency, self.cycles.position, self.cycles.rate, self.encoder, self.readings,
            self.gains, self.sums, self.knots, self.fields, self.per_sample, self.wrench, self.low_pass,
            self.drive_in, self.amplified, wrench, self.angle_rate, angle_first, angle, states,
        )  # fmt: skip
        self.first += steps
        angle = angle[:taken]
        if not (np.isfinite(self.state).all() and np.isfinite(wrench).all() and np.isfinite(angle).all()):
            raise DivergenceError(
                f"the solution is no longer finite before {self.first * self.step:.3f} s",
                where="plant",
                remedy="check stiffness, damping and inertia of the parameters, or take a smaller step",
            )
        tapped = np.empty((len(states), len(OF_JOINTS) * n + 6))
        if self.taps:
            self.plant.tap(states, self.p, tapped)
        return wrench, angle, tapped
