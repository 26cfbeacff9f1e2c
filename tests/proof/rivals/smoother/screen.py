"""Effects as columns along the motion that was found: what each takes of the cost, beside all numbers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import make_interp_spline

from kbs_process.diagnosis.experiments.hypothesis import Tapped
from kbs_process.diagnosis.screening.inlets import Inlet, generalised, inlets_of
from kbs_process.diagnosis.screening.ranges import ranges_of
from kbs_process.diagnosis.screening.signature import inputs, reduced, sensed
from kbs_process.diagnosis.screening.suspects import Candidate, candidates
from kbs_process.plant.compiled.taps import tap_columns
from kbs_process.plant.laws import select
from kbs_process.plant.linear.linearise import linearise
from kbs_process.rig.model import Rig
from kbs_process.stages.align.resample import resample
from proof.rivals.case import Array
from proof.rivals.smoother.balance import FIRST_JOINT, PLATE
from proof.rivals.smoother.drive import spring
from proof.rivals.smoother.fit import Quadratic, State
from proof.rivals.smoother.problem import Problem
from proof.rivals.smoother.splines import in_band

_TAPS_HZ = 100.0
_KNOT_S = 1.0  # between poses at which ports are worked out
_BATCH = 200  # columns at once
_DEPENDENT = 1e-5  # of a column that all numbers leave


@dataclass(frozen=True, slots=True, eq=False)
class Scored:
    """A candidate: what its best amplitudes take of the cost."""

    candidate: Candidate
    gain: float
    amplitudes: Array  # one after the other of each recording, where they are its own
    freedom: int  # amplitudes that make a difference

    @property
    def worth(self) -> float:
        """Gain less what amplitudes that mean nothing would have."""
        return self.gain - 2.0 * self.freedom


class Course:
    """A recording's motion as signals of the plant, and what enters at a port as rows."""

    def __init__(self, problem: Problem, state: State, k: int, rig: Rig) -> None:
        recording, motion = problem.recordings[k], state.ideal_motion(problem, k)
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
        behind = problem.behind(k, state.x, motion, state.ideal_torques[k])
        rotor = smooth - make_interp_spline(own, behind, k=3)(inside)
        turning = np.gradient(rotor, axis=0) * _TAPS_HZ
        joints = slice(FIRST_JOINT, None)
        values = [whole, rotor, turning, angle[:, joints], rate[:, joints], angle[:, PLATE], rate[:, PLATE]]
        shown = problem.predicted(k, state.x, motion, state.ideal_torques[k])[:, : problem.angles.stop]
        readings = make_interp_spline(own, shown, k=3)(inside)
        self.tapped = Tapped(_TAPS_HZ, tap_columns(problem.rig), np.hstack(values), readings)
        self.shown = np.vstack([np.repeat(shown[:1], first, axis=0), shown])
        self._place_ports(motion[0][:, joints])

    def _place_ports(self, angles: Array) -> None:
        problem, rig = self.problem, self.rig
        self._inlets = {inlet: column for column, inlet in enumerate(inlets_of(rig))}
        outside = [effect for effect in select(problem.experiment.effects) if not effect.port.internal]
        n, every = len(angles), round(_KNOT_S / self.recording.dt)
        knots = np.unique(np.append(np.arange(0, n, every), n - 1))
        found = [generalised(rig, linearise(rig, outside, angles[at]), tuple(self._inlets), angles[at]) for at in knots]
        self._force, self._direct = (
            make_interp_spline(knots, np.stack([one[part] for one in found]), k=1)(np.arange(n)) for part in (0, 1)
        )
        drives = [joint.drive for joint in rig.joints if joint.drive is not None]
        self._soft = np.array([float(d.parameters["Ka"]) / (float(d.ratio) ** 2 * spring(d)) for d in drives])

    def _rows(self, column: Mapping[Inlet, Array]) -> Array:
        problem, n = self.problem, self.recording.n
        out = np.zeros((n, problem.rows))
        for inlet, means in column.items():
            slow = resample(means[:, None], _TAPS_HZ, 1 / self.recording.dt)[self.recording.first :, 0]
            slow = in_band(slow, self.recording.dt)
            slow = np.pad(slow, (0, max(n - len(slow), 0)), mode="edge")[:n, None]
            place = self._inlets[inlet]
            force = self._force[:, :, place] * slow
            out[:, problem.wrench] += self._direct[:, :, place] * slow
            out[:, problem.plate] -= force[:, :3]
            out[:, problem.joint] += force[:, 3 : 3 + problem.joints] + self._soft * force[:, 3 + problem.joints :]
        return out

    def columns(self, candidate: Candidate) -> Array:
        """What a unit of each of its amplitudes does to the rows, (n, rows, amplitudes)."""
        problem, experiment = self.problem, self.problem.experiment
        if candidate.effect.in_plant:
            entered = inputs(candidate, self.tapped, self.rig, experiment.effects)
            return np.stack([self._rows(column) for column in entered], axis=2)
        if candidate.effect.whole_band:
            shown = reduced(
                candidate, self.tapped, experiment.channels, self.rig, experiment.dt, len(self.shown)
            )  # fmt: skip
        else:
            t = experiment.dt * np.arange(len(self.shown))
            shown = sensed(candidate, t, self.shown, experiment.channels, self.rig)
        out = np.zeros((self.recording.n, problem.rows, shown.shape[2]))
        out[:, : problem.angles.stop] = in_band(shown[self.recording.first :][: self.recording.n], self.recording.dt)
        return out


class Screen:
    """The catalogue on a state."""

    def __init__(self, problem: Problem, state: State) -> None:
        self.problem, self.state = problem, state
        rig = problem.rig_at(state.x)
        self.courses = [Course(problem, state, k, rig) for k in range(len(problem.recordings))]
        self.quadratic = Quadratic.of(problem, state)
        self._own = self.quadratic.solve(problem.spread, self.quadratic.pull)
        self.left = self.quadratic.left - float(self.quadratic.pull @ self._own)

    def candidates(self) -> list[Candidate]:
        """Every effect that the model leaves out, with each shape, but those that need a recording's own times."""
        problem, experiment = self.problem, self.problem.experiment
        tapped = [course.tapped for course in self.courses]
        ranges = ranges_of(tapped, [course.shown for course in self.courses], experiment.channels, experiment.dt)
        every = candidates(problem.rig, experiment.effects, ranges, tap_columns(problem.rig), experiment.channels)
        return [one for one in every if not one.effect.jumps]

    def scored(self, chosen: Sequence[Candidate], known: Sequence[Candidate] = ()) -> list[Scored]:
        """What each takes of the cost beside all numbers, and beside what is `known`; best first."""
        found = [one for some in _batches(chosen, known) for one in self._scored(some, known)]
        return sorted(found, key=lambda one: -one.worth)

    def predicted(self, one: Scored) -> tuple[float, float]:
        """What an effect takes of the cost with the amplitudes that it has, which were found elsewhere; what it would.

        The latter, if these amplitudes were right.
        """
        unknowns, products, squares = (np.sum(parts, axis=0) for parts in self._sums([one.candidate]))
        given = one.amplitudes[-len(one.candidate.amplitudes) :]
        by = unknowns @ given
        foretold = float(given @ squares @ given - by @ self.quadratic.solve(self.problem.spread, by))
        return float(2.0 * (given @ products - by @ self._own)) - foretold, foretold

    def _scored(self, chosen: Sequence[Candidate], known: Sequence[Candidate]) -> Iterator[Scored]:
        every = [*known, *chosen]
        sizes = [len(one.amplitudes) for one in every]
        ends = np.cumsum([0, *sizes])
        unknowns, products, squares = self._sums(every)
        spread = self.problem.spread
        for number, one in enumerate(chosen, start=len(known)):
            wanted = [*range(len(known)), number]
            places = np.concatenate([np.arange(ends[w], ends[w + 1]) for w in wanted])
            if one.effect.each_trial:
                places = np.concatenate([places + k * ends[-1] for k in range(len(unknowns))])
                by, right, square = _apart(unknowns, products, squares)
            else:
                by, right, square = np.sum(unknowns, axis=0), np.sum(products, axis=0), np.sum(squares, axis=0)
            by, right, square = by[:, places], right[places], square[np.ix_(places, places)]
            size = np.sqrt(np.maximum(np.diag(square), 1e-300))
            beside = square - by.T @ self.quadratic.solve(spread, by)
            rest = right - by.T @ self._own
            of_known = [k for k, w in enumerate(np.repeat(wanted, [sizes[w] for w in wanted])) if w < len(known)]
            gain, amplitudes, freedom = _best(beside, rest, size)
            before = _best(beside[np.ix_(of_known, of_known)], rest[of_known], size[of_known])[0] if of_known else 0.0
            yield Scored(one, gain - before, amplitudes, freedom)

    def _sums(self, every: Sequence[Candidate]) -> tuple[list[Array], list[Array], list[Array]]:
        """Of each recording: products with the unknowns (p, m), with the residual (m,), and with each other (m, m)."""
        unknowns, products, squares = [], [], []
        for course, part, local in zip(self.courses, self.quadratic.parts, self.problem.local, strict=True):
            whole = np.concatenate([course.columns(one) for one in every], axis=2) * part.root[:, :, None]
            mixed, square = part.gram(np.nan_to_num(whole).reshape(-1, whole.shape[2]))
            by = np.zeros((len(self.problem.spread), whole.shape[2]))
            by[local] = mixed[:, :-1].T
            unknowns.append(by)
            products.append(mixed[:, -1])
            squares.append(square)
        return unknowns, products, squares


def _apart(unknowns: list[Array], products: list[Array], squares: list[Array]) -> tuple[Array, Array, Array]:
    """The same with amplitudes of each recording its own."""
    m = len(products[0])
    square = np.zeros((m * len(squares),) * 2)
    for k, own in enumerate(squares):
        square[k * m : (k + 1) * m, k * m : (k + 1) * m] = own
    return np.hstack(unknowns), np.concatenate(products), square


def _best(square: Array, right: Array, size: Array) -> tuple[float, Array, int]:
    """Gain, amplitudes and freedom of columns of `size` (m,) with their products."""
    values, vectors = np.linalg.eigh(square / np.outer(size, size))
    seen = values > _DEPENDENT
    along = vectors[:, seen].T @ (right / size)
    amplitudes = vectors[:, seen] @ (along / values[seen]) / size
    return float(np.sum(along**2 / values[seen])), amplitudes, int(seen.sum())


def _batches(chosen: Sequence[Candidate], known: Sequence[Candidate]) -> Iterator[list[Candidate]]:
    batch: list[Candidate] = []
    for one in chosen:
        batch.append(one)
        if sum(len(entry.amplitudes) for entry in batch) >= _BATCH:
            yield batch
            batch = []
    if batch:
        yield batch
