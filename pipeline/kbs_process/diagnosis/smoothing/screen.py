"""Effects as columns along the motion that was found: what each takes of the cost, beside all numbers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from kbs_process.diagnosis.facts import Estimate
from kbs_process.diagnosis.screening.ranges import ranges_of
from kbs_process.diagnosis.screening.suspects import Candidate, candidates
from kbs_process.diagnosis.side_by_side import side_by_side
from kbs_process.diagnosis.smoothing.basis import BAND_HZ
from kbs_process.diagnosis.smoothing.columns import Columns, Places
from kbs_process.diagnosis.smoothing.course import Course
from kbs_process.diagnosis.smoothing.fit import Quadratic, State
from kbs_process.diagnosis.smoothing.lines import proposed
from kbs_process.diagnosis.smoothing.problem import Problem, by_recording
from kbs_process.plant.compiled.taps import tap_columns
from kbs_process.plant.effect import Parameter
from kbs_process.signals.records import Array

_BATCH = 200  # columns at once
_DEPENDENT = 1e-5  # of a column that all numbers leave
_FIRST_STEP = 0.1  # of a shape's value
_HALVINGS = 12
_ROUNDS, _SETTLED = 4, 0.02  # through all shapes, at most, and while the gain grows by such a share
_BEND = 1e-3  # of a shape's value: step of its slope
_SAME = 0.002  # of the gain, which two effects that do the same differ by, and gain together
_SIZES = 10  # passes to the size of an effect whose columns it changes
_KNOWN = 4.0  # of the cost, for which a shape is not changed
_MOST = 0.5  # of its value, that a shape goes at once
_NEAR = 0.7  # of the gain, beside the best shape, from which on a parabola leads there


@dataclass(frozen=True, slots=True, eq=False)
class Scored:
    """A candidate: what the best amplitudes take of the cost."""

    candidate: Candidate
    gain: float
    freedom: int  # amplitudes that make a difference
    amplitudes: Array  # that all recordings share
    each: Array  # (recordings or 1, amplitudes)
    moved: Array  # by which unknowns that all recordings share go elsewhere beside it
    likely: float = 0.0  # of amplitudes of this size, beforehand; see `_likely`
    foreseen: float = 0.0  # what these amplitudes take on recordings held out

    @property
    def worth(self) -> float:
        """Of all recordings; gain less what numbers that mean nothing would have."""
        return evidence(self.gain, self.freedom) + self.likely + self.foreseen


def evidence(gain: float, freedom: int) -> float:
    """Twice the logarithm of what a hypothesis of `freedom` amplitudes makes of the data, at the best size of them.

    Amplitudes are Gaussian with g times the variance that the data leave them: g gain / (1 + g) - freedom log(1 + g).
    Source: A. Zellner, On assessing prior distributions and Bayesian regression analysis with g-prior distributions
    (1986); E. George, D. Foster, Calibration and empirical Bayes variable selection, Biometrika 87 (2000) 731.
    """
    if freedom == 0 or gain <= freedom:
        return 0.0
    return float(gain - freedom * (1.0 + np.log(gain / freedom)))


@dataclass(frozen=True, slots=True, eq=False)
class _Products:
    """Products of a set of effects' columns, with unknowns (p, m), with the residual (m,), with each other (m, m).

    What each recording has amplitudes of its own for stands there as often; `owner` (m,) says whose a column is.
    """

    unknowns: Array
    residual: Array
    squares: Array
    owner: Places
    own: NDArray[np.bool_]  # (m,) of one recording alone


@dataclass(frozen=True, slots=True, eq=False)
class _Bends:
    """Shapes of an effect that are estimated beside its amplitudes (recordings or 1, amplitudes), to first order."""

    names: tuple[str, ...]
    amplitudes: Array

    def columns(self, course: Course, member: int, candidate: Candidate, amplitudes: Array) -> Array:
        """What a unit of each shape does to the rows, (n, rows, shapes)."""
        out = []
        for name in self.names:
            step = _BEND * max(abs(dict(candidate.shape)[name]), _BEND)
            more, less = (
                replace(candidate, shape=tuple((n, v + by * (n == name)) for n, v in candidate.shape))
                for by in (step, -step)
            )
            shown = course.columns([more, less], member=member).dense(course.problem.rows)
            out.append((shown[:, :, : len(amplitudes)] - shown[:, :, len(amplitudes) :]) @ amplitudes / (2.0 * step))
        return np.stack(out, axis=2) if out else np.zeros((course.recording.n, course.problem.rows, 0))


class Screen:
    """The catalogue on a state."""

    def __init__(
        self, problem: Problem, state: State, courses: Sequence[Course] = (), quadratic: Quadratic | None = None
    ) -> None:
        self.problem, self.state = problem, state
        self.courses = courses or side_by_side(lambda g: state.course(problem, g), range(len(problem.groups)))
        self.quadratic = quadratic or Quadratic.of(problem, state)
        self._own = self.quadratic.solve(problem.spread, self.quadratic.pull)

    def candidates(self) -> list[Candidate]:
        """Every effect that the model leaves out, with each shape, but those that need a recording's own times."""
        problem, experiment = self.problem, self.problem.experiment
        tapped = [course.tapped for course in self.courses]
        lines = proposed(problem, self.state, self.unexplained())
        shown = [course.shown for course in self.courses]
        ranges = ranges_of(
            tapped, shown, experiment.channels, experiment.dt, proposed=lines,
            temperature=all(recording.temperature is not None for recording in problem.recordings),
        )  # fmt: skip
        every = candidates(problem.rig, experiment.effects, ranges, tap_columns(problem.rig), experiment.channels)
        return [one for one in every if not one.effect.jumps]

    @property
    def left(self) -> float:
        """The cost that motion and numbers leave."""
        return self.quadratic.left - float(self.quadratic.pull @ self._own)

    def unexplained(self) -> list[Array]:
        """What motion and numbers leave of each recording's rows (n, rows), over their sigmas."""
        left = {
            k: part.left(k, self._own[self.problem.local[k]]) for part in self.quadratic.parts for k in part.members
        }
        return [left[k] for k in sorted(left)]

    def scored(self, chosen: Sequence[Candidate]) -> list[Scored]:
        """What each takes of the cost beside all numbers; best first."""
        found = [one for some in _batches(chosen) for one in self._scored(some)]
        return sorted(found, key=lambda one: -one.worth)

    def refined(self, one: Scored) -> Scored:
        """The same with its shape where it takes most, one number after the other."""
        free = {
            entry.name: entry for entry in one.candidate.effect.parameters if entry.role == "shape" and not entry.whole
        }
        places = [place for place, (name, _) in enumerate(one.candidate.shape) if name in free]
        for _ in range(_ROUNDS if len(places) > 1 else 1):
            before = one.gain
            for place in places:
                entry = free[one.candidate.shape[place][0]]
                low, high = entry.bounds
                one = self._along(one, place, (low, min(high, BAND_HZ) if entry.unit == "Hz" else high))
            if one.gain < (1.0 + _SETTLED) * before:
                break
        return one

    def sized(self, one: Scored) -> Scored:
        """The same about the size that it has: readings that are late by more than they turn in are no slope."""
        for _ in range(_SIZES):
            if not any(course.turned(one.candidate, size) for course, sizes in self._each(one) for size in sizes):
                break
            before = one.gain
            with self._about(one):
                (one,) = self.scored([one.candidate])
            if one.gain < (1.0 + _SETTLED) * before:
                break
        return one

    def same(self, one: Scored, other: Scored) -> bool:
        """Whether two effects do the same beside all numbers: neither takes more of the cost, nor do both together."""
        least, most = sorted((one.gain, other.gain))
        if most > (1.0 + _SAME) * least:
            return False
        with self._about(one), self._about(other):
            found = self._products([one.candidate, other.candidate], together=True)
        square, right, _ = self._beside(found)
        gain, _, _ = _best(square, right, np.sqrt(np.maximum(np.diag(found.squares), 1e-300)))
        return gain < (1.0 + _SAME) * most

    def _each(self, one: Scored) -> Iterator[tuple[Course, Array]]:
        """Every group's course, with amplitudes of its members (members, amplitudes)."""
        every = np.broadcast_to(one.each, (len(self.problem.recordings), one.each.shape[1]))
        for course, part in zip(self.courses, self.quadratic.parts, strict=True):
            yield course, every[list(part.members)]

    @contextmanager
    def _about(self, one: Scored) -> Iterator[None]:
        """Take its columns about the size that it has."""
        place = one.candidate.name, one.candidate.site
        for course, sizes in self._each(one):
            course.sizes[place] = sizes
        try:
            yield
        finally:
            for course in self.courses:
                course.sizes.pop(place, None)

    def _along(self, one: Scored, place: int, bounds: tuple[float, float]) -> Scored:
        def at(value: float) -> Scored:
            shape = list(one.candidate.shape)
            shape[place] = (shape[place][0], float(np.clip(value, *bounds)))
            with self._about(one):
                (found,) = self.scored([replace(one.candidate, shape=tuple(shape))])
            return found

        step, best = _FIRST_STEP * max(abs(one.candidate.shape[place][1]), _FIRST_STEP), one
        for _ in range(_HALVINGS):
            value = best.candidate.shape[place][1]
            low, high = at(value - step), at(value + step)
            if max(low.gain, high.gain) <= best.gain < min(low.gain, high.gain) / _NEAR:
                bend = low.gain - 2.0 * best.gain + high.gain
                if bend == 0.0:
                    return best
                return max(best, at(value + 0.5 * step * (low.gain - high.gain) / bend), key=lambda found: found.gain)
            if max(low.gain, high.gain) <= best.gain:
                step *= 0.5
            best = max(best, low, high, key=lambda found: found.gain)
        return best

    def foreseen(self, one: Scored) -> tuple[float, float]:
        """What an effect takes of the cost as it was found elsewhere; and what it would take if that were right.

        Numbers that all recordings share go where they go beside it. Amplitudes of each recording's own are free, and
        count as `evidence`: of these nothing is foretold.
        """
        with nullcontext() if one.candidate.effect.each_trial else self._about(one):
            found = self._products([one.candidate])
        quadratic, spread, free = self.quadratic, self.problem.spread, found.own
        size, moved = np.zeros(len(free)), np.zeros(len(spread))
        size[~free], moved[: len(one.moved)] = one.amplitudes, one.moved
        squares = quadratic.normal - np.diag(spread**-2.0)
        there = found.unknowns @ size + squares @ moved
        left = quadratic.pull - there
        solved = quadratic.solve(spread, np.stack([left, there], axis=1))
        entered = size @ found.squares @ size + moved @ (there + found.unknowns @ size)
        taken = 2.0 * (size @ found.residual + moved @ quadratic.pull) - entered
        taken += left @ solved[:, 0] - quadratic.pull @ self._own
        if free.any():
            square, _, _ = self._beside(found)
            right = found.residual - found.squares @ size - found.unknowns.T @ (moved + solved[:, 0])
            width = np.sqrt(np.maximum(np.diag(found.squares)[free], 1e-300))
            most, _, freedom = _best(square[np.ix_(free, free)], right[free], width)
            taken += evidence(most, freedom)
        return float(taken), 0.0 if free.any() else float(entered - there @ solved[:, 1])

    def _scored(self, chosen: Sequence[Candidate]) -> Iterator[Scored]:
        found = self._products(chosen)
        square, right, solved = self._beside(found)
        common = self.problem.own[0].start
        size = np.sqrt(np.maximum(np.diag(found.squares), 1e-300))
        for number, one in enumerate(chosen):
            places = np.flatnonzero(found.owner == number)
            gain, amplitudes, freedom = _best(square[np.ix_(places, places)], right[places], size[places])
            held = _held(one, amplitudes)
            if np.any(held != amplitudes):
                amplitudes = held
                gain = float(held @ (2.0 * right[places] - square[np.ix_(places, places)] @ held))
            each = amplitudes.reshape(-1, len(one.amplitudes))
            likely = _likely(one.amplitudes, np.sqrt(np.mean(each**2, axis=0)))
            moved = -solved[:common, places] @ amplitudes
            yield Scored(one, gain, freedom, amplitudes[~found.own[places]], each, moved, likely)

    def _beside(self, found: _Products) -> tuple[Array, Array, Array]:
        """Squares and products with the residual, once all numbers have had their part; what they do for a unit."""
        solved = self.quadratic.solve(self.problem.spread, found.unknowns)
        return found.squares - found.unknowns.T @ solved, found.residual - found.unknowns.T @ self._own, solved

    def reshaped(self, candidate: Candidate, places: Places) -> Candidate:
        """An effect that is present with its shape where it fits best beside all numbers; the same, if that is little.

        `places` (recordings, amplitudes) are those of its amplitudes among the unknowns.
        """
        names, square, right, size, _ = self._bent(candidate, places)
        gain, change, _ = _best(square, right, size)
        if gain < _KNOWN:
            return candidate
        by = dict(zip(names, change, strict=True))
        bounds = {entry.name: entry.bounds for entry in candidate.effect.parameters}
        shape = []
        for name, value in candidate.shape:
            most = _MOST * abs(value)
            shape.append((name, float(np.clip(value + np.clip(by.get(name, 0.0), -most, most), *bounds[name]))))
        return replace(candidate, shape=tuple(shape))

    def estimated(self, candidate: Candidate, places: Places) -> tuple[Estimate, ...]:
        """Amplitudes and shapes of an effect that is present beside all numbers, with intervals of 95 %.

        Of amplitudes of each recording's own, those of the first. `places` as above.
        """
        names, square, _, size, solved = self._bent(candidate, places)
        covariance = np.linalg.pinv(square / np.outer(size, size), rcond=_DEPENDENT, hermitian=True)
        covariance /= np.outer(size, size)
        own, alone = places[0], np.eye(len(self.problem.spread))[:, places[0]]
        variance = np.diag(self.quadratic.solve(self.problem.spread, alone)[own])
        variance = variance + np.einsum("ij,jk,ik->i", solved[own], covariance, solved[own])
        entries = {entry.name: entry for entry in candidate.effect.parameters}
        bent = dict(zip(names, np.diag(covariance), strict=True))
        told = [*zip(candidate.amplitudes, self.state.x[own], variance, strict=True)]
        told += [(entries[name], value, bent[name]) for name, value in candidate.shape if name in bent]
        return tuple(Estimate(one.name, one.unit, float(v), float(np.sqrt(max(var, 0.0)))) for one, v, var in told)

    def _bent(self, candidate: Candidate, places: Places) -> tuple[tuple[str, ...], Array, Array, Array, Array]:
        """Shapes that may have any value; products of a unit of each with each other and the residual, beside numbers.

        And sizes of their columns, and what numbers do for a unit of each.
        """
        free = {entry.name for entry in candidate.effect.parameters if entry.role == "shape" and not entry.whole}
        names = tuple(name for name, _ in candidate.shape if name in free)
        found = self._products([candidate], _Bends(names, self.state.x[places]))
        bent = found.owner > 0
        square, right, solved = self._beside(found)
        size = np.sqrt(np.maximum(np.diag(found.squares)[bent], 1e-300))
        return names, square[np.ix_(bent, bent)], right[bent], size, solved[:, bent]

    def _products(
        self, every: Sequence[Candidate], bends: _Bends | None = None, *, together: bool = False
    ) -> _Products:
        """Products of columns; of those of different effects only `together`, or with `bends` of the last."""
        sizes = [len(one.amplitudes) for one in every]
        each = [one.effect.each_trial for one in every]
        if bends is not None:
            sizes, each = [*sizes, *[1] * len(bends.names)], [*each, *[False] * len(bends.names)]
        owner = np.repeat(np.arange(len(sizes)), sizes)
        count = len(self.problem.recordings)
        recording = np.concatenate([
            np.repeat(np.arange(count), size) if alone else np.full(size, -1)
            for alone, size in zip(each, sizes, strict=True)
        ])  # fmt: skip
        ends = np.cumsum([0, *sizes])
        source = np.concatenate([
            np.tile(np.arange(ends[k], ends[k + 1]), count if alone else 1) for k, alone in enumerate(each)
        ])  # fmt: skip
        m = len(source)
        unknowns, residual, squares = np.zeros((len(self.problem.spread), m)), np.zeros(m), np.zeros((m, m))
        of_column = np.zeros(ends[-1], dtype=np.intp) if together or bends is not None else owner
        for seen in side_by_side(lambda g: self._seen(g, every, bends, of_column), range(len(self.courses))):
            for k, mixed, square in seen:
                there = np.flatnonzero((recording < 0) | (recording == k))
                taken = source[there]
                unknowns[np.ix_(self.problem.local[k], there)] += mixed[taken, :-1].T
                residual[there] += mixed[taken, -1]
                squares[np.ix_(there, there)] += square[np.ix_(taken, taken)]
        return _Products(unknowns, residual, squares, owner[source], recording >= 0)

    def _seen(
        self, g: int, every: Sequence[Candidate], bends: _Bends | None, owner: Places
    ) -> list[tuple[int, Array, Array]]:
        """Products with each recording of a group: it, with its unknowns and residual, and with each other.

        All that differs between its recordings is what `by_recording` says, and an amplitude of each one's own.
        """
        course, part = self.courses[g], self.quadratic.parts[g]
        p, differs = (
            part.unknowns,
            any(map(by_recording, every)) or (bends is not None and np.ptp(bends.amplitudes, axis=0).any()),
        )
        found = []
        for at, k in enumerate(part.members):
            if differs or at == 0:
                whole = course.columns(every, member=at)
                if bends is not None:
                    own = bends.amplitudes[k % len(bends.amplitudes)]
                    whole = Columns.beside([whole, Columns.of_dense(bends.columns(course, at, every[-1], own))])
                mixed, square = part.gram(whole, owner)
            found.append((k, mixed[:, [*range(p), p + at]], square))
        return found


def _best(square: Array, right: Array, size: Array) -> tuple[float, Array, int]:
    """Gain, amplitudes and freedom of columns of `size` (m,) with their products."""
    values, vectors = np.linalg.eigh(square / np.outer(size, size))
    seen = values > _DEPENDENT
    along = vectors[:, seen].T @ (right / size)
    amplitudes = vectors[:, seen] @ (along / values[seen]) / size
    return float(np.sum(along**2 / values[seen])), amplitudes, int(seen.sum())


def _held(candidate: Candidate, amplitudes: Array) -> Array:
    """Amplitudes within their bounds; a dry friction alone takes energy out."""
    entries = candidate.amplitudes
    low = [0.0 if entry.dry and len(entries) == 1 else entry.bounds[0] for entry in entries]
    high = [entry.bounds[1] for entry in entries]
    return np.asarray(np.clip(amplitudes.reshape(-1, len(entries)), low, high).ravel())


def _likely(entries: Sequence[Parameter], size: Array) -> float:
    """Twice the logarithm of how likely amplitudes of a `size` are, against their priors' middles, with Cauchy's tails.

    A motor's torque that would turn the gear as its own error does is out of all proportion; nothing else tells them
    apart in the band.
    """
    spread = np.array([entry.prior.spread for entry in entries])
    return float(-2.0 * np.sum(np.log1p((size / spread) ** 2)))


def _batches(chosen: Sequence[Candidate]) -> Iterator[list[Candidate]]:
    """Some at once; those that differ between recordings by themselves."""
    for differing in (False, True):
        batch: list[Candidate] = []
        for one in chosen:
            if by_recording(one) != differing:
                continue
            batch.append(one)
            if sum(len(entry.amplitudes) for entry in batch) >= _BATCH:
                yield batch
                batch = []
        if batch:
            yield batch
