"""A recording's motion as signals of the plant, and what effects along it do to the rows."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise

import numpy as np
from scipy.interpolate import make_interp_spline

from kbs_process.diagnosis.experiments.hypothesis import Tapped
from kbs_process.diagnosis.screening.inlets import Inlet, generalised, inlets_of
from kbs_process.diagnosis.screening.scene import courses
from kbs_process.diagnosis.screening.signature import inputs, reduced, sensed, stamped, unit_values
from kbs_process.diagnosis.screening.suspects import Candidate
from kbs_process.diagnosis.smoothing.balance import FIRST_JOINT, PLATE, Motion
from kbs_process.diagnosis.smoothing.basis import in_band
from kbs_process.diagnosis.smoothing.columns import Columns, Entry
from kbs_process.diagnosis.smoothing.drive import spring
from kbs_process.diagnosis.smoothing.problem import Problem
from kbs_process.plant.compiled.taps import tap_columns
from kbs_process.plant.laws import select
from kbs_process.plant.linear.linearise import linearise
from kbs_process.plant.sensing import SensingPort
from kbs_process.signals.records import Array
from kbs_process.stages.align.resample import resample

_TAPS_HZ = 100.0
_ON_TIME = 1e-5  # s, by which readings that are late have the slope at their instant
_STEEP = 5e-3  # s, by which readings may be late and have one slope
_PASSES = 3
_RUNAWAY = 1e30
_KNOT_S = 1.0  # between poses at which ports are worked out


class Course:
    """The motion of recordings that were driven alike as signals of the plant, and what enters at a port as rows."""

    def __init__(self, problem: Problem, members: Sequence[int], x: Array, motion: Motion, torques: Array) -> None:
        self.members = [problem.recordings[k] for k in members]
        k, recording, rig = members[0], self.members[0], problem.rig_at(x)
        self.problem, self.rig, self.recording = problem, rig, recording
        dt, n, first = recording.dt, recording.n, recording.first
        own = dt * (first + np.arange(n))
        t = np.arange(round((first + n) * dt * _TAPS_HZ)) / _TAPS_HZ
        inside = np.clip(t, own[0], own[-1])
        angle, rate = (make_interp_spline(own, part, k=3)(inside) for part in motion[:2])
        field = recording.field
        whole, smooth = (
            np.stack([np.interp(t, field.t, column) for column in part.T], axis=1)
            for part in (field.whole, field.smooth)
        )
        behind = problem.behind(k, x, motion, torques)
        rotor = smooth - make_interp_spline(own, behind, k=3)(inside)
        turning = np.gradient(rotor, axis=0) * _TAPS_HZ
        joints = slice(FIRST_JOINT, None)
        values = [whole, rotor, turning, angle[:, joints], rate[:, joints], angle[:, PLATE], rate[:, PLATE]]
        # Amplitudes of each member (members, amplitudes), as far as they are known, of effects at a place.
        self.sizes: dict[tuple[str, str], Array] = {}
        shown = problem.predicted(k, x, motion, torques) - problem.beyond[k]
        ends = np.cumsum([0, *(len(one.amplitudes) for one in problem.present)])
        for one, (a, b) in zip(problem.present, pairwise(ends), strict=True):
            self.sizes[one.name, one.site] = np.stack([x[problem.amplitudes[j]][a:b] for j in members])
            if not one.effect.in_plant:  # what a sensor adds: others act on what there is without
                shown -= problem.acting[k][:, :, a:b] @ x[problem.amplitudes[k]][a:b]
        shown = shown[:, : problem.angles.stop]
        readings = make_interp_spline(own, shown, k=3)(inside)
        self.tapped = Tapped(_TAPS_HZ, tap_columns(problem.rig), np.hstack(values), readings)
        self.shown = np.vstack([np.repeat(shown[:1], first, axis=0), shown])
        self._links = courses(rig, self.tapped)
        self._place_ports(motion[0][:, joints])

    def _place_ports(self, angles: Array) -> None:
        rig = self.rig
        inlets = inlets_of(rig)
        force, direct = self.recording.ports or self._ports(inlets, angles)
        self.recording.ports = force, direct
        drives = [joint.drive for joint in rig.joints if joint.drive is not None]
        soft = np.array([float(d.parameters["Ka"]) / (float(d.ratio) ** 2 * spring(d)) for d in drives])
        problem, joints = self.problem, len(drives)
        every = np.zeros((self.recording.n, problem.rows, len(inlets)))
        every[:, problem.wrench] = direct
        every[:, problem.plate] = -force[:, :3]
        every[:, problem.joint] = force[:, 3 : 3 + joints] + soft[:, None] * force[:, 3 + joints :]
        # What a unit at an inlet does, by row.
        self._ways: dict[Inlet, dict[int, Array]] = {inlet: {} for inlet in inlets}
        for row, places, values in Columns.of_dense(every).parts:
            for place, factor in zip(places, values.T, strict=True):
                self._ways[inlets[place]][row] = factor

    def _ports(self, inlets: Sequence[Inlet], angles: Array) -> tuple[Array, Array]:
        """What a unit at each inlet is as forces and as a wrench along the motion, (n, ..., inlets)."""
        rig = self.rig
        outside = [effect for effect in select(self.problem.experiment.effects) if not effect.port.internal]
        n, every = len(angles), round(_KNOT_S / self.recording.dt)
        knots = np.unique(np.append(np.arange(0, n, every), n - 1))
        found = [generalised(rig, linearise(rig, outside, angles[at]), tuple(inlets), angles[at]) for at in knots]
        force, direct = (
            make_interp_spline(knots, np.stack([one[part] for one in found]), k=1)(np.arange(n)) for part in (0, 1)
        )
        return force, direct

    def acting(self) -> tuple[Array, Array]:
        """Slopes (n, rows, amplitudes) of what is present at its size, and what it does beyond them (n, rows).

        Of the first member: where a clock is present, there is no other.
        """
        present = self.problem.present
        slopes, whole = (self.columns(present, local=local).dense(self.problem.rows) for local in (True, False))
        size = np.concatenate([self.sizes[one.name, one.site][0] for one in present])
        return slopes, (whole - slopes) @ size

    def columns(self, chosen: Sequence[Candidate], local: bool = False, member: int = 0) -> Columns:
        """What a unit of each amplitude of each candidate does to a member's rows.

        Of a clock that is known to be late this is all that it does over its lateness; its slope there, if `local`.
        """
        driven = list(self._placed(chosen))
        means = [series for _, column in driven for series in column.values()]
        slow = iter(self._slow(means))
        entries = [
            entry for place, column in driven for entry in self._rows(place, {inlet: next(slow) for inlet in column})
        ]  # fmt: skip
        place = 0
        for one in chosen:
            if not one.effect.in_plant:
                entries += self._sensed(one, local, member, place)
            place += len(one.amplitudes)
        return Columns.of(self.recording.n, place, entries)

    def _placed(self, chosen: Sequence[Candidate]) -> Iterator[tuple[int, dict[Inlet, Array]]]:
        """What enters the plant, by the place of its column."""
        place = 0
        for one in chosen:
            if one.effect.in_plant:
                yield from enumerate(self._entered(one), start=place)
            place += len(one.amplitudes)

    def _entered(self, candidate: Candidate) -> list[dict[Inlet, Array]]:
        return inputs(
            candidate, self.tapped, self.rig, self.problem.experiment.effects, self._links.get(candidate.site)
        )

    def _slow(self, means: Sequence[Array]) -> Array:
        """Series at the taps' rate as they are in the band at the working rate, (series, n)."""
        if not means:
            return np.zeros((0, self.recording.n))
        n, dt, first = self.recording.n, self.recording.dt, self.recording.first
        slow = resample(np.stack(means, axis=1), _TAPS_HZ, 1 / dt)[first : first + n]
        slow = in_band(slow, dt)
        return np.pad(slow, ((0, n - len(slow)), (0, 0)), mode="edge").T

    def _rows(self, place: int, column: Mapping[Inlet, Array]) -> list[Entry]:
        """What enters, in the band at the working rate, as rows."""
        out: dict[int, Array] = {}
        for inlet, slow in column.items():
            for row, factor in self._ways[inlet].items():
                out[row] = out.get(row, 0.0) + factor * slow
        return [(row, place, _bounded(series)) for row, series in out.items()]

    def _sensed(self, candidate: Candidate, local: bool, member: int, place: int) -> list[Entry]:
        experiment = self.problem.experiment
        own = slice(self.recording.first, self.recording.first + self.recording.n)
        if candidate.effect.whole_band:
            shown = reduced(
                candidate, self.tapped, experiment.channels, self.rig, experiment.dt, len(self.shown)
            )[own]  # fmt: skip
        elif candidate.effect.port is SensingPort.STREAM:
            shown = self._late(candidate, local, member)
        else:
            t = experiment.dt * np.arange(len(self.shown), dtype=np.float64)
            warm = self.members[member].temperature
            known: dict[str, Array | float] = {} if warm is None else {"temperature": warm}
            shown = sensed(candidate, t, self.shown, experiment.channels, self.rig, known)[own]
        acted = np.flatnonzero(shown.any(axis=(0, 2)))  # of the readings, which are the first rows
        seen = in_band(shown[:, acted], self.recording.dt)
        return [
            (int(row), place + amplitude, _bounded(seen[:, at, amplitude]))
            for at, row in enumerate(acted)
            for amplitude in range(shown.shape[2])
        ]

    def turned(self, candidate: Candidate, size: Array) -> bool:
        """Whether an effect of some size (amplitudes,) is beyond what its columns say of it to first order."""
        if candidate.effect.port is not SensingPort.STREAM:
            return False
        units = unit_values(candidate, self.recording.dt * np.arange(len(self.shown), dtype=np.float64), {})
        return bool(np.abs(units @ size).max() > _STEEP)

    def _late(self, candidate: Candidate, local: bool, member: int) -> Array:
        """What a unit of each amplitude of a clock's lateness does to readings, (n, channels, amplitudes).

        It is their mean slope over the lateness that the clock is known to have: so that all of them together bring
        back what was read at its own time. Their slope then, if `local`.
        """
        recording, channels = self.members[member], self.problem.experiment.channels
        t = recording.dt * (recording.first + np.arange(recording.n, dtype=np.float64))
        units = unit_values(candidate, t, {})
        known = self.sizes.get((candidate.name, candidate.site))
        size = np.zeros(units.shape[1]) if known is None else known[member]
        for _ in range(_PASSES if size.any() else 0):  # what was read then was late by what its clock was late then
            units = unit_values(candidate, t + units @ size, {})
        late = (units @ size)[:, None]
        acted = stamped(candidate.site, channels, self.rig)
        spline, shifted = make_interp_spline(t, recording.reading[:, acted], k=3), np.abs(late) > _ON_TIME
        then = np.clip(t + late[:, 0], t[0], t[-1])
        mean = (spline(then) - recording.reading[:, acted]) / np.where(shifted, late, 1.0)
        out = np.zeros((recording.n, len(channels), units.shape[1]))
        out[:, acted] = -np.where(shifted & (not local), mean, spline(then, 1))[:, :, None] * units[:, None, :]
        return out


def _bounded(series: Array) -> Array:
    """What a unit of an amplitude does (n,); nothing, where it runs away along the motion or has no value."""
    return series if np.abs(series).max(initial=0.0) < _RUNAWAY else np.zeros_like(series)
