"""Several plants of one structure under one schedule, side by side on a processor's vector: see `lanes`."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kbs_process.plant.compiled.compile import compiled_lanes
from kbs_process.plant.compiled.lanes import LANES, Rows
from kbs_process.plant.compiled.simulation import Simulation
from kbs_process.signals.records import Array


class Together:
    """Simulations that have not begun, up to `LANES` of them: alike in structure, schedule, step and rates."""

    def __init__(self, simulations: Sequence[Simulation]) -> None:
        self.count = len(simulations)
        first = simulations[0]
        if not 0 < self.count <= LANES:
            raise ValueError(f"{self.count} simulations for {LANES} lanes")
        if any(one.structure != first.structure or one.step != first.step for one in simulations):
            raise ValueError("plants side by side have to be alike in structure and step")
        # Lanes without a plant of their own repeat the first.
        self.each = [*simulations, *[first] * (LANES - self.count)]
        self.advance = compiled_lanes(first.structure)

    def run(self, samples: int, angles: int) -> tuple[Array, Array]:
        """Return wrench (count, samples, 6) and unquantised angles (count, angles, joints) from time zero on.

        A plant that diverges has samples that are not finite.
        """
        first = self.each[0]
        rows = Rows(first.structure)
        s = np.zeros((rows.count, LANES))
        s[: rows.state.start] = np.stack([one.p for one in self.each], axis=1)
        s[rows.state] = np.stack([one.state for one in self.each], axis=1)
        held = np.stack([one.wrench for one in self.each], axis=1)
        encoder, readings, gains, sums, fields, low_pass, drive_in, amplified = (
            np.stack([getattr(one, name) for one in self.each])
            for name in (
                "encoder", "readings", "gains", "sums", "fields", "low_pass", "drive_in", "amplified"
            )
        )  # fmt: skip
        cursor = first.cursor.copy()
        wrench = np.empty((LANES, samples, 6))
        n = first.structure.joints
        angle = np.empty((LANES, max(angles - 1, 0), n))

        def move(begin: int, steps: int, seen: Array, sampled: int, turned: Array) -> int:
            return int(
                self.advance(
                    begin, steps, first.step, s.reshape(-1), cursor, first.closed, first.recorded, first.latency,
                    first.cycles.position, first.cycles.rate, encoder, readings, gains, sums, first.knots, fields,
                    first.per_sample, held, low_pass, drive_in, amplified, seen, first.angle_rate, sampled, turned,
                )
            )  # fmt: skip

        if first.first < 0:  # what precedes the recording
            unseen = np.empty((LANES, -first.first // first.per_sample, 6))
            move(first.first, -first.first, unseen, 0, np.empty((LANES, 0, n)))
        # The sample at time zero ends no step.
        start = s[rows.q : rows.qd].T[:, None, :].copy()
        move(0, samples * first.per_sample, wrench, 1, angle)
        return wrench[: self.count], np.concatenate([start, angle], axis=1)[: self.count, :angles]
