"""A campaign as rows: readings of wrench and encoders, balances of plate and joints, the floor at rest.

    wrench   reading = (I + dX) W(motion; rig) + zero + clock          noise of the transducer
    angle    reading = joint + offset + clock                          rounding
    plate    W's moment on the plate - its springs = force             weak: `intensity`
    joint    gear's torque at the field - torque needed = -force       weak
    floor    velocity, as the balance has it = force                   weak

A row's weight is one over its variance; where recordings say nothing, it has none.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.fft import prev_fast_len
from scipy.ndimage import binary_erosion

from kbs_process.diagnosis.experiments.experiment import Experiment
from kbs_process.diagnosis.experiments.hypothesis import decoupling
from kbs_process.diagnosis.screening.suspects import Candidate, own_values
from kbs_process.diagnosis.smoothing.balance import FIRST_JOINT, FLOOR, PLATE, Loads, Motion, needed
from kbs_process.diagnosis.smoothing.basis import BAND_HZ, Basis, in_band
from kbs_process.diagnosis.smoothing.columns import Columns
from kbs_process.diagnosis.smoothing.drive import WRITTEN, Field, priors, spring
from kbs_process.plant.laws import select
from kbs_process.plant.sensing import SensingPort
from kbs_process.rig.model import Amplifier, Rig
from kbs_process.signals.records import Array
from kbs_process.stages.gravity.parameters import RigElements

_ENDS = 1.0  # s left out at a recording's ends, and half of it beside gaps
_LINES = 3  # first terms of a channel's zero: constant, slope, curvature
_DRIFT = 0.05  # of the bias's sigma: what they drift by
_PINK_HZ = 0.1  # up to which a channel's noise may be 1/f, as large as its white noise there
_WAVES = 24  # of a zero at most: of a long recording the slowest, where 1/f noise is most
_CLOCK = 3e-3  # s, of a clock against the field's
_LEAST = 0.1  # of its value: what a stiffness, a damping or an inertia is at least
_ALIKE = 5e-3  # rad of the motor, by which fields differ that have one set of slopes: closed loops bring up to 4.5e-3
_STEPS = (1e-6, 1e-6, 1e-4)  # of values, rates and accelerations, for slopes
_FLOOR_STEP = 1e-3  # m/s
_EXACT = 1e-6  # of an amplitude that is known without a sigma: its sigma, of itself
_SHARE = 1e-3  # of a sigma: step of an unknown
_OF_RIG = ("body.", "transducer.tilt", "transducer.stiffness", "transducer.damping")
_OF_JOINT = (".origin", ".misalignment", ".Ka", ".fsv", ".Tmax")


@dataclass(eq=False)
class Recording:
    """A recording on its own samples."""

    trial: int
    first: int  # samples of its trajectory's grid before it
    dt: float
    reading: Array  # (n, 6 + joints) wrench decoupled, amplifier undone; angles
    weight: Array  # (n,) 1 where it counts, else 0
    turning: Array  # (n, joints) share of an angle's samples that are rounded apart: codes crossed in one of them
    field: Field
    basis: Basis
    temperature: Array | None  # (first + n,) degC
    ports: tuple[Array, Array] | None = None  # of a course's, along the first motion that asked: poses hardly differ

    @property
    def n(self) -> int:
        return len(self.reading)

    @cached_property
    def slope(self) -> Array:
        """Slopes of its readings (n, 6 + joints), 1/s."""
        return np.asarray(np.gradient(self.reading, self.dt, axis=0))

    @cached_property
    def zero(self) -> Array:
        """Shapes (n, terms) of a zero: lines, then cosines."""
        t = np.linspace(-1.0, 1.0, self.n)
        phase = np.pi * (np.arange(self.n) + 0.5) / self.n
        lines = [np.ones(self.n), t, 1.5 * t**2 - 0.5]
        return np.stack([*lines, *(np.cos(k * phase) for k in self._waves)], axis=1)

    @property
    def _waves(self) -> NDArray[np.int_]:
        return np.arange(_LINES, min(int(2 * _PINK_HZ * self.n * self.dt), _WAVES) + 1)

    def moves_like(self, other: Recording) -> bool:
        """Whether fields turned nearly alike, and the same samples count."""
        there = (self.first, self.n) == (other.first, other.n) and np.array_equal(self.weight, other.weight)
        return there and bool(np.abs(self.field.angle - other.field.angle).max() < _ALIKE)

    def spread(self, bias: Array, white: Array) -> Array:
        """Sigmas (channels, terms) of a zero: `bias` is the constant's, `white` the noise, one-sided, per Hz."""
        lines = np.outer(bias, [1.0] + [_DRIFT] * (_LINES - 1))
        return np.hstack([lines, np.sqrt(np.outer(white, 2 * _PINK_HZ / self._waves))])


class Problem:
    """Rows, unknowns and priors of some recordings of an experiment."""

    def __init__(self, experiment: Experiment, trials: list[int]) -> None:
        self.experiment, self.rig = experiment, experiment.rig
        self.joints = len(self.rig.joints)
        self.freedoms = FIRST_JOINT + self.joints
        self.recordings = [_recording(experiment, k, *span) for k, span in _spans(experiment, trials).items()]
        self._undone = decoupling(experiment)
        self.wrench, self.angles = slice(0, 6), slice(6, 6 + self.joints)
        self.plate = slice(self.angles.stop, self.angles.stop + 3)
        self.joint = slice(self.plate.stop, self.plate.stop + self.joints)
        self.floor = slice(self.joint.stop, self.joint.stop + 3)
        self.rows = self.floor.stop
        transducer, dt = self.rig.transducer, experiment.dt
        rate = experiment.trials[trials[0]].wrench_rate
        noise = np.hypot(transducer.noise.value, transducer.resolution.value / np.sqrt(12))
        self.sigma = np.ones(self.rows)
        self.sigma[self.wrench] = noise / np.sqrt(rate * dt)
        self.sigma[self.angles] = [float(j.encoder.step) / np.sqrt(12) for j in self.rig.joints if j.encoder]
        self.given = present(self.rig, experiment.effects)
        self.found: list[Candidate] = []
        self._place_unknowns()

    def joined(self, candidate: Candidate) -> Problem:
        """The same with an effect that was found, of which nothing is known but its bounds."""
        new = copy(self)
        new.found = [*self.found, candidate]
        new._place_unknowns()
        return new

    @property
    def present(self) -> list[Candidate]:
        """Effects beside those of a drive that are written here."""
        return [*self.given, *self.found]

    @cached_property
    def repeats(self) -> list[list[int]]:
        """Recordings of one trajectory, of each that was recorded more than once."""
        trials = self.experiment.trials
        by_trajectory: dict[int, list[int]] = {}
        for k, recording in enumerate(self.recordings):
            by_trajectory.setdefault(trials[recording.trial].trajectory, []).append(k)
        return [own for own in by_trajectory.values() if len(own) > 1]

    @cached_property
    def _driven_alike(self) -> list[list[int]]:
        groups: list[list[int]] = []
        for k, one in enumerate(self.recordings):
            near = [own for own in groups if one.moves_like(self.recordings[own[0]])]
            near[0].append(k) if near else groups.append([k])
        return groups

    @property
    def groups(self) -> list[list[int]]:
        """Recordings that were driven alike: the model by itself moves alike in them, and rows have the same slopes.

        Beside what acts by a recording's own readings each is alone.
        """
        if any(by_recording(one) for one in self.present):
            return [[k] for k in range(len(self.recordings))]
        return self._driven_alike

    @property
    def forces(self) -> slice:
        """The rows of which the residual is a force that the equations lack."""
        return slice(self.plate.start, self.rows)

    def _place_unknowns(self) -> None:
        quantities = self.rig.quantities()
        chosen = [
            quantity
            for name, quantity in quantities.items()
            if np.any(quantity.sigma > 0)
            and (name.startswith(_OF_RIG) or (name.startswith("joint.") and name.endswith(_OF_JOINT)))
        ]
        self.elements = RigElements(self.rig, tuple(chosen), tuple(q.sigma > 0 for q in chosen))
        X = self.rig.transducer.cross_coupling
        self.coupled = [(int(i), int(k)) for i, k in np.argwhere(X.sigma > 0)]
        drives = [priors(joint.drive) for joint in self.rig.joints if joint.drive is not None]
        offsets = [float(joint.encoder.offset.sigma) for joint in self.rig.joints if joint.encoder is not None]
        bias = self.rig.transducer.bias.sigma
        white = 2.0 * self.sigma[self.wrench] ** 2 * self.experiment.dt
        each = np.concatenate([_widths(one) for one in self.found if one.effect.each_trial] or [np.zeros(0)])
        common = np.concatenate([_widths(one) for one in self.found if not one.effect.each_trial] or [np.zeros(0)])
        own = [np.concatenate([one.spread(bias, white).ravel(), each, [_CLOCK, _CLOCK]]) for one in self.recordings]
        blocks = [
            (self.elements.value, self.elements.sigma),
            (np.concatenate([value for value, _ in drives]), np.concatenate([sigma for _, sigma in drives])),
            (np.zeros(len(self.coupled)), np.array([X.sigma[place] for place in self.coupled])),
            (np.zeros(len(offsets)), np.array(offsets)),
            _amplitudes(self.rig, self.given),
            (np.zeros(len(common)), common),
            *[(np.zeros(len(one)), one) for one in own],
        ]
        self.prior, spread = (np.concatenate([block[k] for block in blocks]) for k in (0, 1))
        self.spread = np.where(spread > 0.0, spread, _EXACT**2)  # what is known exactly hardly moves
        ends = np.cumsum([0, *(len(value) for value, _ in blocks)])
        of_rig, numbers, coupling, offset, given, found, *owned = (slice(a, b) for a, b in pairwise(ends))
        self.of_rig, self.numbers, self.coupling, self.offsets, self.own = of_rig, numbers, coupling, offset, owned
        self.stated = slice(0, given.stop)  # what files say something of
        shared = np.arange(owned[0].start)
        self.local = [np.concatenate([shared, np.arange(one.start, one.stop)]) for one in owned]
        # Amplitudes of what is present, of each recording, and what a unit of each does to its rows along its motion.
        self.amplitudes = [self._placed(given, found, one.stop - 2 - len(each)) for one in owned]
        self.acting = [
            np.zeros((r.n, self.rows, len(own))) for r, own in zip(self.recordings, self.amplitudes, strict=True)
        ]
        # What clocks do beyond these slopes.
        self.beyond = [np.zeros((r.n, self.rows)) for r in self.recordings]
        scales = (".Ka", ".fsv", ".Tmax", ".inertia[0]", ".inertia[1]", ".inertia[2]")
        positive = [
            name.endswith(scales) or name.startswith(("transducer.stiffness", "transducer.damping"))
            for name in self.elements.names
        ]
        self.dynamic = np.zeros(len(self.prior), dtype=bool)  # numbers that scale a balance, and show while it moves
        self.dynamic[: len(positive)] = np.array(positive) | [".inertia[" in name for name in self.elements.names]
        self.lower = np.where(positive, _LEAST * self.elements.value, self.elements.lower)

    def _placed(self, given: slice, found: slice, own: int) -> NDArray[np.intp]:
        """Where unknowns are that what is present is linear in; those of a recording's own begin at `own`."""
        places = list(range(given.start, given.stop))
        common, alone = found.start, own
        for one in self.found:
            count = len(one.amplitudes)
            if one.effect.each_trial:
                places += range(alone, alone + count)
                alone += count
            else:
                places += range(common, common + count)
                common += count
        return np.array(places, dtype=np.intp)

    def rig_at(self, x: Array) -> Rig:
        """The rig with its elements at x."""
        return self.elements.rig_at(x[self.of_rig])

    def start(self, k: int) -> Array:
        """Coefficients of a motion that follows the field, at rest at every instant."""
        recording = self.recordings[k]
        still = np.zeros((recording.n, self.freedoms))
        x = still.copy()
        drives = [joint.drive for joint in self.rig.joints if joint.drive is not None]
        stiffness = self.rig.transducer.stiffness
        for _ in range(3):
            _, efforts = needed(self.rig, (x, still, still), recording.field.rotors)
            if stiffness is not None:
                x[:, PLATE] = -efforts[:, :3] / stiffness.value
            for j, drive in enumerate(drives):
                wound = efforts[:, 3 + j] / float(drive.parameters["Ka"])
                x[:, FIRST_JOINT + j] = recording.field.angle[:, j] / float(drive.ratio) - wound
        return recording.basis.fitted(x)

    def behind(self, k: int, x: Array, motion: Motion, torques: Array | None) -> Array:
        """How far each rotor (n, joints) is behind its field, motor rad."""
        rig = self.rig_at(x)
        _, efforts = needed(rig, motion, self.recordings[k].field.rotors)
        return np.stack([self._behind(rig, k, x, j, efforts[:, 3 + j], torques) for j in range(self.joints)], axis=1)

    def _behind(self, rig: Rig, k: int, x: Array, j: int, torque: Array, torques: Array | None) -> Array:
        drive = rig.joints[j].drive
        assert drive is not None
        of_rotor = float(drive.rotor_inertia) * self.recordings[k].field.acceleration[:, j]
        if torques is not None:
            of_rotor = of_rotor - torques[:, j] @ x[self.numbers].reshape(self.joints, -1)[j]
        return np.asarray((torque / float(drive.ratio) + of_rotor) / spring(drive))

    def predicted(
        self, k: int, x: Array, motion: Motion, torques: Array, rig: Rig | None = None, loads: Loads | None = None
    ) -> Array:
        """Rows (n, rows) of a recording: readings, and what the balances leave.

        `rig` and the `loads` that it needs are those at x and the motion, where somebody knows them.
        """
        recording, rig = self.recordings[k], rig or self.rig_at(x)
        angle, rate, _ = motion
        wrench, efforts = loads or needed(rig, motion, recording.field.rotors)
        out = np.zeros((recording.n, self.rows))
        own = x[self.own[k]]
        dX = np.zeros((6, 6))
        for place, value in zip(self.coupled, x[self.coupling], strict=True):
            dX[place] = value
        out[:, self.wrench] = wrench @ (np.eye(6) + self._undone @ dX).T
        out[:, self.wrench] += recording.zero @ own[: 6 * recording.zero.shape[1]].reshape(6, -1).T
        out[:, self.angles] = angle[:, FIRST_JOINT:] + x[self.offsets]
        out[:, self.wrench] -= own[-2] * recording.slope[:, self.wrench]
        out[:, self.angles] -= own[-1] * rate[:, FIRST_JOINT:]
        out[:, self.plate] = efforts[:, :3]
        if rig.transducer.stiffness is not None:
            out[:, self.plate] += angle[:, PLATE] * rig.transducer.stiffness.value
        if rig.transducer.damping is not None:
            out[:, self.plate] += rate[:, PLATE] * rig.transducer.damping.value
        field = recording.field
        for j, joint in enumerate(rig.joints):
            assert joint.drive is not None
            ratio, numbers = float(joint.drive.ratio), joint.drive.parameters
            torque = efforts[:, 3 + j]
            rotor = (field.angle[:, j] - self._behind(rig, k, x, j, torque, torques)) / ratio
            wound, winding = rotor - angle[:, FIRST_JOINT + j], field.rate[:, j] / ratio - rate[:, FIRST_JOINT + j]
            winding /= 1.0 + float(numbers["Ka"]) / (ratio**2 * spring(joint.drive))
            out[:, self.joint.start + j] = float(numbers["Ka"]) * wound + float(numbers["fsv"]) * winding - torque
        out[:, self.floor] = angle[:, FLOOR]
        return out + self.acting[k] @ x[self.amplitudes[k]] + self.beyond[k]

    def residual(self, k: int, x: Array, motion: Motion, torques: Array) -> Array:
        """Measured less predicted (n, rows); the balances' measured is zero."""
        left = -self.predicted(k, x, motion, torques)
        left[:, : self.angles.stop] += self.recordings[k].reading
        return left

    def by_motion(self, k: int, x: Array, motion: Motion, torques: Array) -> Array:
        """Slopes of a recording's rows by its motion (n, rows, freedoms, 3): values, rates, accelerations."""
        rig = self.rig_at(x)
        base = self.predicted(k, x, motion, torques, rig)
        slopes = np.zeros((self.recordings[k].n, self.rows, self.freedoms, 3))
        for d in range(self.freedoms):
            for order, step in enumerate(_STEPS):
                if d < FLOOR.stop:
                    step = _FLOOR_STEP
                    if order == 2:
                        continue
                moved = [part.copy() if o == order else part for o, part in enumerate(motion)]
                moved[order][:, d] += step
                shown = self.predicted(k, x, (moved[0], moved[1], moved[2]), torques, rig)
                slopes[:, :, d, order] = (shown - base) / step
        return slopes

    def by_unknown(self, k: int, x: Array, motion: Motion, torques: Array) -> Columns:
        """Slopes of a recording's rows by its unknowns; differences of those of the rig, all others are exact."""
        rig, recording = self.rig_at(x), self.recordings[k]
        loads = needed(rig, motion, recording.field.rotors)
        base = self.predicted(k, x, motion, torques, rig, loads)
        at = self.of_rig
        differences = np.zeros((recording.n, self.rows, at.stop - at.start))
        for column, place in enumerate(range(at.start, at.stop)):
            step = _SHARE * self.spread[place]
            moved = x.copy()
            moved[place] += step
            differences[:, :, column] = (self.predicted(k, moved, motion, torques) - base) / step
        found = [Columns.of_dense(differences), self._by_numbers(rig, recording, loads[0], torques)]
        zero, own = recording.zero, self.own[k]
        every = np.arange(zero.shape[1])
        zeros = [(channel, every + channel * len(every), zero) for channel in range(6)]
        late = [
            *((row, 0, -recording.slope[:, row]) for row in range(6)),
            *((6 + j, 1, -motion[1][:, FIRST_JOINT + j]) for j in range(self.joints)),
        ]
        found += [
            Columns(recording.n, 6 * len(every), tuple(zeros)),
            Columns.of(recording.n, 2, late),
            Columns.of_dense(self.acting[k]),
        ]
        places = [
            np.arange(at.start, self.offsets.stop),
            np.arange(own.start, own.start + 6 * len(every)),
            np.arange(own.stop - 2, own.stop),
            self.amplitudes[k],
        ]
        return Columns.beside(found).placed(np.searchsorted(self.local[k], np.concatenate(places)), len(self.local[k]))

    def _by_numbers(self, rig: Rig, recording: Recording, wrench: Array, torques: Array) -> Columns:
        """What drives' numbers, the cross-coupling and encoders' offsets do, in which rows are linear."""
        entries, place = [], 0
        for j, joint in enumerate(rig.joints):
            assert joint.drive is not None
            of_rotor = float(joint.drive.parameters["Ka"]) / (spring(joint.drive) * float(joint.drive.ratio))
            for number in range(torques.shape[2]):
                entries.append((self.joint.start + j, place, of_rotor * torques[:, j, number]))
                place += 1
        for i, acts in self.coupled:
            entries += [(row, place, self._undone[row, i] * wrench[:, acts]) for row in range(6)]
            place += 1
        for j in range(self.joints):
            entries.append((self.angles.start + j, place, np.ones(recording.n)))
            place += 1
        return Columns.of(recording.n, place, entries)


def by_recording(candidate: Candidate) -> bool:
    """Whether what it does differs between recordings that were driven alike: by when they were read, or how warm."""
    return candidate.effect.port is SensingPort.STREAM or "temperature" in candidate.effect.arguments


def present(rig: Rig, effects: Sequence[str]) -> list[Candidate]:
    """Effects that the model has beside those of a drive that are written here, at every place where they act."""
    found = []
    for effect in select([name for name in effects if name not in WRITTEN]):
        sites = (
            [joint.name for joint in rig.joints if joint.drive and effect.parameters[0].name in joint.drive.parameters]
            if effect.port.of_drive
            else [load.on for load in rig.external if load.name == effect.name]
        )
        for site in sites:
            own = own_values(rig, site)
            load = next((one for one in rig.external if one.name == effect.name), None)
            at = None if load is None or load.point is None else load.point.value
            point = None if at is None else (float(at[0]), float(at[1]), float(at[2]))
            shape = tuple((one.name, own[one.name]) for one in effect.parameters if one.role != "amplitude")
            found.append(Candidate(effect, site, shape, point))
    return found


def _amplitudes(rig: Rig, present: Sequence[Candidate]) -> tuple[Array, Array]:
    """Values and sigmas of what they are linear in; one that is known exactly hardly moves."""
    known = {
        (site, name): quantity
        for site, numbers in (
            *((joint.name, joint.drive.parameters) for joint in rig.joints if joint.drive),
            *((load.on, load.parameters) for load in rig.external),
        )
        for name, quantity in numbers.items()
    }
    own = [known[one.site, entry.name] for one in present for entry in one.amplitudes]
    value = np.array([float(quantity) for quantity in own])
    sigma = np.array([float(quantity.sigma) for quantity in own])
    return value, np.maximum(sigma, _EXACT * np.maximum(np.abs(value), _EXACT))


def _widths(candidate: Candidate) -> Array:
    """How large amplitudes may be."""
    return np.array([max(abs(bound) for bound in entry.bounds) for entry in candidate.amplitudes])


def _spans(experiment: Experiment, trials: Sequence[int]) -> dict[int, tuple[int, int]]:
    """First sample and end of each trial: what is common to those of a trajectory that cover nearly the same."""
    own = {k: np.flatnonzero(experiment.trials[k].valid)[[0, -1]] + [0, 1] for k in trials}
    ends, spans = round(_ENDS / experiment.dt), {}
    for k in trials:
        near = [
            other
            for j, other in own.items()
            if experiment.trials[j].trajectory == experiment.trials[k].trajectory
            and np.abs(other - own[k]).max() <= ends
        ]
        first, end = int(max(one[0] for one in near)), int(min(one[1] for one in near))
        spans[k] = first, first + prev_fast_len(end - first, real=True)
    return spans


def _recording(experiment: Experiment, k: int, first: int, end: int) -> Recording:
    trial = experiment.trials[k]
    reading, n, dt = trial.measured[first:end].copy(), end - first, experiment.dt
    amplifier = experiment.rig.transducer.amplifier
    reading[:, 6:] = in_band(reading[:, 6:], dt)
    reading[:, :6] = _undone(reading[:, :6], amplifier, dt)
    weight = np.zeros(n)
    ends = round(_ENDS / dt)
    weight[ends:-ends] = 1.0
    if not trial.valid[first:end].all():
        weight *= binary_erosion(trial.valid[first:end], iterations=ends // 2)
    schedule = experiment.drives[trial.drive].schedule
    assert schedule is not None
    field = Field.of(experiment.rig, schedule, first, n, dt)
    steps = np.array([float(j.encoder.step) for j in experiment.rig.joints if j.encoder is not None])
    ratios = np.array([float(j.drive.ratio) for j in experiment.rig.joints if j.drive is not None])
    temperature = None if trial.temperature is None else trial.temperature[:end]
    turning = np.clip(np.abs(field.rate) / ratios / steps / (2 * BAND_HZ), 0.0, 1.0)
    return Recording(k, first, dt, reading, weight, turning, field, Basis(n, dt), temperature)


def _undone(wrench: Array, amplifier: Amplifier | None, dt: float) -> Array:
    """Undo an amplifier of the second order."""
    if amplifier is None:
        return in_band(wrench, dt)
    corner = float(amplifier.corner)
    late: Array = np.sqrt(2) / (2 * np.pi * corner) * (wrench[-1:] - wrench[:1]) / (dt * (len(wrench) - 1))
    return in_band(wrench, dt, lambda f: 1 + np.sqrt(2) * 1j * f / corner - (f / corner) ** 2) + late
