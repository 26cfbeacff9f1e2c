"""Shapes of a law between the places of its grid: which of them slopes can better, how far they go, and where to."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize

from kbs_process.diagnosis.screening.gls import Score, Sums, per_trial, score
from kbs_process.diagnosis.screening.ranges import SPECTRUM, WHILE_RECORDED, is_place, swept
from kbs_process.diagnosis.screening.screen import Bench, Catalogued, Found
from kbs_process.diagnosis.screening.suspects import Candidate, half_lengths
from kbs_process.identification.output_error import Scalar
from kbs_process.plant.effect import LogNormal, Parameter, Uniform
from kbs_process.rig.model import Rig
from kbs_process.signals.records import Array

_FARTHEST = 30.0  # times, up or down, that a shape goes from where the grid had it; of what has a sign,
_STEPS = 6.0  # as many of its steps
_NEAR = 0.05  # m: steps of a search for a point are no less
_DIFFERENCE = 0.02  # steps
_PLACES = 24  # of a law that is somewhere, at most, for each width that it may have
_NARROWER = (0.5, 0.25)  # shares of its width
_ABOUT = 1.5  # widths, on either side of a place
_DESCENTS = 12  # of the search along the linear plant
_SLIGHT = 1e-3  # of what a suspect does: a step that adds less is the last, and the plant betters the rest
_ENDS = 0.99  # of the longest time that recordings show
_STARTS = 3  # of descents, of one that is over less or that known numbers take up on its grid


@dataclass(frozen=True, slots=True)
class Bend:
    """A shape that slopes can better: where it is, what one step of it is, between which bounds, and its prior."""

    name: str
    value: float
    step: float  # that it is known to
    low: float
    high: float
    alike: bool = False  # whether all values are alike likely; else the step is a standard deviation
    ratio: bool = False  # whether steps multiply it: then this one is of its logarithm
    element: tuple[int, ...] = ()  # of a quantity that has several

    def scalar(self, path: str) -> Scalar:
        """The rig's number, of a law that has its numbers at a path."""
        return Scalar(f"{path}.{self.name}", self.element)

    @property
    def size(self) -> float:
        """Of a step, in its own unit."""
        return self.value * self.step if self.ratio else self.step

    @property
    def sigma(self) -> float:
        """Standard deviation of its prior about `value`."""
        return float("inf") if self.alike else self.size

    @property
    def room(self) -> tuple[float, float]:
        """Steps that it may go down and up."""
        ends = np.array([self.low, self.high])
        down, up = np.log(ends / self.value) / self.step if self.ratio else (ends - self.value) / self.step
        return float(down), float(up)

    def moved(self, steps: float) -> float:
        """Its value some steps away."""
        value = self.value * np.exp(steps * self.step) if self.ratio else self.value + steps * self.step
        return float(np.clip(value, self.low, self.high))


def bends(candidate: Candidate, rig: Rig) -> tuple[Bend, ...]:
    """Return what can be bettered of a candidate, its point last where that may be anywhere.

    Whole numbers and tones stay where a line was found, phases where they were tried all round, and a place where it
    was put for want of any other.
    """
    shape = dict(candidate.shape)
    own = [
        _bend(entry, shape[entry.name], step, _last(entry, candidate))
        for entry in candidate.effect.parameters
        if entry.role == "shape" and (step := _step(entry, candidate)) > 0.0
    ]
    if candidate.point is None or not candidate.effect.anywhere:
        return tuple(own)
    reach = np.maximum(half_lengths(rig, candidate.site), _NEAR)
    point = [
        Bend("point", x, step, -np.inf, np.inf, alike=True, element=(k,))
        for k, (x, step) in enumerate(zip(candidate.point, reach.tolist(), strict=True))
    ]
    return (*own, *point)


def _step(entry: Parameter, candidate: Candidate) -> float:
    """What a shape of the grid is known to: its prior's width, of a place the law's own; 0, where it stays."""
    put = entry.over == SPECTRUM or (entry.over and len(entry.grid) == 1)
    if put or isinstance(entry.prior, Uniform) or entry.whole:
        return 0.0
    if is_place(entry):
        wide = _width(entry, candidate)
        return 0.0 if wide is None else dict(candidate.shape)[wide.name]
    if isinstance(entry.prior, LogNormal):
        return entry.prior.sigma
    return entry.prior.spread


def _width(place: Parameter, candidate: Candidate) -> Parameter | None:
    """Over how much a law goes at its place, if it is a number of it."""
    every = candidate.effect.parameters
    return next((entry for entry in every if entry.over == f"{place.over}.span"), None)


def _last(entry: Parameter, candidate: Candidate) -> float:
    """The greatest value that recordings show: what takes far longer than they do stands still in them."""
    return max(entry.grid) * candidate.longest if entry.over == WHILE_RECORDED else np.inf


def _bend(entry: Parameter, value: float, step: float, last: float) -> Bend:
    ratio = isinstance(entry.prior, LogNormal)
    low, high = value - _STEPS * step, value + _STEPS * step
    if ratio:
        low, high = value / _FARTHEST, value * _FARTHEST
    low, high = max(low, entry.bounds[0]), min(high, entry.bounds[1], max(last, value))
    return Bend(entry.name, value, step, low, high, alike=entry.over != "" and not ratio, ratio=ratio)


def bettered(bench: Bench, found: Found) -> Found:
    """A suspect of the screen with the shape, near the best of many, with which it does most along the linear plant."""
    suspect = found.suspect
    if not isinstance(suspect, Catalogued) or not bends(suspect.candidate, suspect.scene.hypothesis.rig):
        return found
    (wide,) = _best(bench, [suspect, *_everywhere(suspect)], 1)
    # Which of them is the best descents tell.
    seeds = [wide] if wide is suspect else [suspect, wide]
    starts = [wide, *_best(bench, [one for seed in seeds for one in _narrower(seed)], _STARTS)]
    best, own = max((_descended(bench, one, _gain) for one in starts), key=lambda end: _gain(*end))
    gained = own.gain - found.score.gain
    return replace(found, suspect=best, score=own, log_evidence=found.log_evidence + 0.5 * gained)


def _best(bench: Bench, suspects: Sequence[Catalogued], most: int) -> list[Catalogued]:
    """Those of some suspects with as many amplitudes that do most, the best first, at most so many."""
    scored = zip(suspects, _scores(bench, suspects) if suspects else [], strict=True)
    return [one for one, _ in sorted(scored, key=lambda end: -_gain(*end))[:most]]


def uncovered(bench: Bench, found: Found, grid: Sequence[Catalogued]) -> Found:
    """A suspect that known numbers take up on its `grid`, at the shape with which it does most beyond all that they do.


    Most of what a cord does that carries weight is a weight. What is left, as its pull and its way change, is none, and
    far less than a hundredth: the linear plant cannot tell it from its own errors. So it is a lead, and the plant's to
    judge.
    """
    scored = zip(grid, _scores(bench, grid), strict=True)
    starts = sorted(scored, key=lambda end: -_whole(*end))[:_STARTS]
    best, own = max((_descended(bench, start, _whole) for start, _ in starts), key=lambda end: _whole(*end))
    all_of_it = replace(own, gain=own.whole_gain, rank=own.whole_rank, amplitude=own.whole)
    return replace(found.told_as(best, all_of_it, bench.background.rows), absorbed_by=())


def _everywhere(suspect: Catalogued) -> list[Catalogued]:
    """A law that is somewhere all through what its signal sweeps: between places a width apart it does little."""
    place, wide = _somewhere(suspect.candidate)
    if place is None or wide is None:
        return []
    ranges, site = swept(suspect.scene), suspect.candidate.site
    low, high = ranges.within(place, site)
    every = []
    for width in ranges.choices(wide, site, None):
        count = min(int(np.ceil((high - low) / width)), _PLACES)
        places = low + (np.arange(count) + 0.5) / count * (high - low)
        every += [_put(suspect, {place.name: float(one), wide.name: width}) for one in places]
    return every


def _narrower(suspect: Catalogued) -> list[Catalogued]:
    """A law that is somewhere about where it is, over less: what makes the article ring is seen long after."""
    place, wide = _somewhere(suspect.candidate)
    if place is None or wide is None:
        return []
    shape, every = dict(suspect.candidate.shape), []
    for share in _NARROWER:
        width = share * shape[wide.name]
        places = shape[place.name] + width * np.arange(-round(_ABOUT / share), round(_ABOUT / share) + 1)
        every += [_put(suspect, {place.name: float(one), wide.name: width}) for one in places]
    return every


def _somewhere(candidate: Candidate) -> tuple[Parameter | None, Parameter | None]:
    """The numbers of a law that are its place, and over how much it goes there; none of one that is anywhere."""
    place = next(filter(is_place, candidate.effect.parameters), None)
    return place, None if place is None else _width(place, candidate)


def _put(suspect: Catalogued, moved: Mapping[str, float]) -> Catalogued:
    """A suspect with some numbers of its shape elsewhere."""
    shape = tuple((name, moved.get(name, value)) for name, value in suspect.candidate.shape)
    return replace(suspect, candidate=replace(suspect.candidate, shape=shape))


def _descended(
    bench: Bench, start: Catalogued, worth: Callable[[Catalogued, Score], float]
) -> tuple[Catalogued, Score]:
    """The shape at which a suspect is `worth` most of all that a descent saw, and what it does."""
    free = bends(start.candidate, start.scene.hypothesis.rig)
    seen: list[tuple[Catalogued, Score]] = []

    def fall(u: Array) -> tuple[float, Array]:
        around = u + np.vstack([np.zeros(len(u)), _DIFFERENCE * np.eye(len(u))])
        tried = [_at(start, free, one) for one in around]
        ends = list(zip(tried, _scores(bench, tried), strict=True))
        seen.append(ends[0])
        gains = np.array([worth(*end) for end in ends])
        return -float(gains[0]), (gains[0] - gains[1:]) / _DIFFERENCE

    minimize(
        fall,
        np.zeros(len(free)),
        jac=True,
        method="L-BFGS-B",
        bounds=[one.room for one in free],
        options={"maxiter": _DESCENTS, "maxfun": 2 * _DESCENTS, "ftol": _SLIGHT},
    )
    return max(seen, key=lambda end: worth(*end))


def along(bench: Bench, suspect: Catalogued, amplitude: Array, drive: int) -> Array:
    """(n, c, shapes) slopes of what a suspect of some amplitudes adds to the prediction, by each of its `bends`."""
    free = bends(suspect.candidate, suspect.scene.hypothesis.rig)
    slopes = []
    for one, step in zip(free, _DIFFERENCE * np.eye(len(free)), strict=True):
        below, above = (
            bench.signatures([_at(suspect, free, -step)], drive),
            bench.signatures([_at(suspect, free, step)], drive),
        )
        slopes.append((above - below) @ amplitude / (one.moved(_DIFFERENCE) - one.moved(-_DIFFERENCE)))
    return np.stack(slopes, axis=2)


def _gain(suspect: Catalogued, found: Score) -> float:
    """What a suspect does; less than nothing with a sign that it has not."""
    return -found.gain if _reversed(suspect, found) else found.gain


def _whole(suspect: Catalogued, found: Score) -> float:
    """The same with what it has in common with known numbers, as far as these do not do it alone."""
    return -found.whole_gain if _of_wrong_sign(suspect, found.whole) else found.whole_gain


def _reversed(suspect: Catalogued, found: Score) -> bool:
    return _of_wrong_sign(suspect, found.amplitude)


def _of_wrong_sign(suspect: Catalogued, amplitude: Array) -> bool:
    """Whether a lone amplitude has a sign that its law has not: no inertia is less than none."""
    lone = len(amplitude) == 1 and suspect.candidate.amplitudes[0].bounds[0] >= 0.0
    return lone and float(amplitude[0]) < 0.0


def possible(found: Found) -> bool:
    """Whether a suspect of the screen has a sign that its law may have."""
    return not (isinstance(found.suspect, Catalogued) and _reversed(found.suspect, found.score))


def standing_still(suspect: Catalogued, values: Sequence[float]) -> tuple[str, ...]:
    """Why a law with a fit's shapes is none that goes on in time: it would take longer than recordings do, if it may.

    Friction that falls hardly at all is friction.
    """
    candidate = suspect.candidate
    entries = {entry.name: entry for entry in candidate.effect.parameters}
    reasons = []
    for one, value in zip(bends(candidate, suspect.scene.hypothesis.rig), values, strict=False):
        last = np.inf if one.element else _last(entries[one.name], candidate)
        if value >= _ENDS * last:
            reasons.append(f"{one.name} = {value:.3g} s: what takes as long stands still in these recordings")
    return tuple(reasons)


def _at(suspect: Catalogued, free: Sequence[Bend], steps: Array) -> Catalogued:
    """The suspect with its shape some steps away."""
    return _with(suspect, free, [one.moved(float(step)) for one, step in zip(free, steps, strict=True)])


def moved(suspect: Catalogued, steps: Sequence[float]) -> Catalogued:
    """The suspect with its shape some steps away."""
    return _at(suspect, bends(suspect.candidate, suspect.scene.hypothesis.rig), np.asarray(steps))


def fitted(suspect: Catalogued, values: Sequence[float]) -> Catalogued:
    """The suspect with the shape that a fit has: a value for each of its `bends`."""
    return _with(suspect, bends(suspect.candidate, suspect.scene.hypothesis.rig), values)


def _with(suspect: Catalogued, free: Sequence[Bend], values: Sequence[float]) -> Catalogued:
    moved = {one.name: value for one, value in zip(free, values, strict=True) if not one.element}
    candidate, point = suspect.candidate, suspect.candidate.point
    if free and free[-1].element:
        x, y, z = values[-3:]
        point = x, y, z
    shape = tuple((name, moved.get(name, value)) for name, value in candidate.shape)
    return replace(suspect, candidate=replace(candidate, shape=shape, point=point))


def _scores(bench: Bench, suspects: Sequence[Catalogued]) -> list[Score]:
    """Of suspects with as many amplitudes each."""
    columns = bench.columns(suspects)
    m = len(suspects[0].amplitudes)
    owns = [np.arange(k * m, (k + 1) * m) for k in range(len(suspects))]
    if suspects[0].each_trial:
        parts = [per_trial(bench.background, {k: x[:, own] for k, x in columns.items()}) for own in owns]
        return [score(bench.background, part) for part in parts]
    sums = Sums.over(bench.background, columns)
    return [score(bench.background, sums.pick(own)) for own in owns]
