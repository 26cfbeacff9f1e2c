"""A recording's motion as signals of the plant, and what effects along it do to the rows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np
from scipy.interpolate import make_interp_spline

from kbs_process.diagnosis.experiments.hypothesis import Tapped
from kbs_process.diagnosis.screening.inlets import Inlet, generalised, inlets_of
from kbs_process.diagnosis.screening.scene import courses
from kbs_process.diagnosis.screening.signature import inputs, reduced, sensed, stamped, unit_values
from kbs_process.diagnosis.screening.suspects import Candidate
from kbs_process.plant.compiled.taps import tap_columns
from kbs_process.plant.laws import select
from kbs_process.plant.linear.linearise import linearise
from kbs_process.plant.sensing import SensingPort
from kbs_process.stages.align.resample import resample
from proof.rivals.case import Array
from proof.rivals.smoother.balance import FIRST_JOINT, PLATE, Motion
from proof.rivals.smoother.basis import in_band
from proof.rivals.smoother.drive import spring
from proof.rivals.smoother.problem import Problem

_TAPS_HZ = 100.0
_ON_TIME = 1e-5  # s, by which readings that are late have the slope at their instant
_STEEP = 5e-3  # s, by which readings may be late and have one slope
_PASSES = 3
_KNOT_S = 1.0  # between poses at which ports are worked out


class Course:
    """A recording's motion as signals of the plant, and what enters at a port as rows."""

    def __init__(self, problem: Problem, k: int, x: Array, motion: Motion, torques: Array) -> None:
        recording, rig = problem.recordings[k], problem.rig_at(x)
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
        self.sizes: dict[tuple[str, str], Array] = {}  # amplitudes, as far as they are known, of effects at a place
        shown = problem.predicted(k, x, motion, torques) - problem.beyond[k]
        ends = np.cumsum([0, *(len(one.amplitudes) for one in problem.present)])
        for one, (a, b) in zip(problem.present, pairwise(ends), strict=True):
            self.sizes[one.name, one.site] = x[problem.amplitudes[k]][a:b]
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
        self._inlets = {inlet: column for column, inlet in enumerate(inlets_of(rig))}
        self._force, self._direct = self.recording.ports or self._ports(angles)
        self.recording.ports = self._force, self._direct
        drives = [joint.drive for joint in rig.joints if joint.drive is not None]
        self._soft = np.array([float(d.parameters["Ka"]) / (float(d.ratio) ** 2 * spring(d)) for d in drives])

    def _ports(self, angles: Array) -> tuple[Array, Array]:
        """What a unit at each inlet is as forces and as a wrench along the motion, (n, ..., inlets)."""
        rig = self.rig
        outside = [effect for effect in select(self.problem.experiment.effects) if not effect.port.internal]
        n, every = len(angles), round(_KNOT_S / self.recording.dt)
        knots = np.unique(np.append(np.arange(0, n, every), n - 1))
        found = [generalised(rig, linearise(rig, outside, angles[at]), tuple(self._inlets), angles[at]) for at in knots]
        force, direct = (
            make_interp_spline(knots, np.stack([one[part] for one in found]), k=1)(np.arange(n)) for part in (0, 1)
        )
        return force, direct

    def acting(self) -> tuple[Array, Array]:
        """Slopes (n, rows, amplitudes) of what is present at its size, and what it does beyond them (n, rows)."""
        present = self.problem.present
        slopes, whole = self.columns(present, local=True), self.columns(present)
        size = np.concatenate([self.sizes[one.name, one.site] for one in present])
        return slopes, (whole - slopes) @ size

    def columns(self, chosen: Sequence[Candidate], local: bool = False) -> Array:
        """What a unit of each amplitude of each candidate does to the rows, (n, rows, amplitudes of all).

        Of a clock that is known to be late this is all that it does over its lateness; its slope there, if `local`.
        """
        shown = [self._sensed(one, local) if not one.effect.in_plant else self._entered(one) for one in chosen]
        entered = [column for one in shown if isinstance(one, list) for column in one]
        slow = iter(self._slow([means for column in entered for means in column.values()]))
        rows = iter([self._rows({inlet: next(slow) for inlet in column}) for column in entered])
        every = [
            np.stack([next(rows) for _ in one], axis=2) if isinstance(one, list) else one for one in shown
        ]  # fmt: skip
        return np.nan_to_num(np.concatenate(every, axis=2))

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

    def _rows(self, column: Mapping[Inlet, Array]) -> Array:
        """What enters, in the band at the working rate, as rows."""
        problem = self.problem
        out = np.zeros((self.recording.n, problem.rows))
        for inlet, slow in column.items():
            place = self._inlets[inlet]
            force = self._force[:, :, place] * slow[:, None]
            out[:, problem.wrench] += self._direct[:, :, place] * slow[:, None]
            out[:, problem.plate] -= force[:, :3]
            out[:, problem.joint] += force[:, 3 : 3 + problem.joints] + self._soft * force[:, 3 + problem.joints :]
        return out

    def _sensed(self, candidate: Candidate, local: bool) -> Array:
        problem, experiment = self.problem, self.problem.experiment
        own = slice(self.recording.first, self.recording.first + self.recording.n)
        if candidate.effect.whole_band:
            shown = reduced(
                candidate, self.tapped, experiment.channels, self.rig, experiment.dt, len(self.shown)
            )[own]  # fmt: skip
        elif candidate.effect.port is SensingPort.STREAM:
            shown = self._late(candidate, local)
        else:
            t = experiment.dt * np.arange(len(self.shown))
            shown = sensed(candidate, t, self.shown, experiment.channels, self.rig)[own]
        out = np.zeros((self.recording.n, problem.rows, shown.shape[2]))
        acted = np.flatnonzero(shown.any(axis=(0, 2)))  # of the readings, which are the first rows
        out[:, acted] = in_band(shown[:, acted], self.recording.dt)
        return out

    def turned(self, candidate: Candidate, size: Array) -> bool:
        """Whether an effect of some size (amplitudes,) is beyond what its columns say of it to first order."""
        if candidate.effect.port is not SensingPort.STREAM:
            return False
        units = unit_values(candidate, self.recording.dt * np.arange(len(self.shown)), {})
        return bool(np.abs(units @ size).max() > _STEEP)

    def _late(self, candidate: Candidate, local: bool) -> Array:
        """What a unit of each amplitude of a clock's lateness does to readings, (n, channels, amplitudes).

        It is their mean slope over the lateness that the clock is known to have: so that all of them together bring
        back what was read at its own time. Their slope then, if `local`.
        """
        recording, channels = self.recording, self.problem.experiment.channels
        t = recording.dt * (recording.first + np.arange(recording.n))
        units = unit_values(candidate, t, {})
        size = self.sizes.get((candidate.name, candidate.site), np.zeros(units.shape[1]))
        for _ in range(_PASSES if size.any() else 0):  # what was read then was late by what its clock was late then
            units = unit_values(candidate, t + units @ size, {})
        late = (units @ size)[:, None]
        acted = stamped(candidate.site, channels, self.rig)
        spline, known = make_interp_spline(t, recording.reading[:, acted], k=3), np.abs(late) > _ON_TIME
        then = np.clip(t + late[:, 0], t[0], t[-1])
        mean = (spline(then) - recording.reading[:, acted]) / np.where(known, late, 1.0)
        out = np.zeros((recording.n, len(channels), units.shape[1]))
        out[:, acted] = -np.where(known & (not local), mean, spline(then, 1))[:, :, None] * units[:, None, :]
        return out
