"""Trajectories of a trial: the paper's kinds, shortened, and random sweeps and tracks within the rig's limits."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from engine.hardware import Array
from engine.trajectories import RANGE, Axis, Commands, commands
from proof.concealed.ranges import PATHS, Split

_LEAST_EL, _MOST_EL = 30.0, 89.5  # deg: between them, no path meets a stop or the zenith
_QUICK = 0.6  # deg/s^2, of the calibration

Draw = Callable[[str], float]


def calibration(rng: np.random.Generator) -> Commands:
    """Pseudo-static: azimuth there and back at up to 2 deg/s while elevation rises, rests and falls; 110 s."""
    low, start = float(rng.uniform(48.0, 56.0)), float(rng.uniform(-75.0, -35.0))
    az = Axis(start).rest(2.0).move(100.0, acceleration=_QUICK).rest(2.0).move(-100.0, acceleration=_QUICK)
    el = Axis(low).rest(2.0).move(30.0, rate=0.7, acceleration=_QUICK)
    el = el.rest(az.duration() - el.duration() - 25.0).move(-12.0, rate=0.7, acceleration=_QUICK)
    return commands(az, el, az.duration() + 2.0)


def draw(rng: np.random.Generator, split: Split, count: int) -> list[Commands]:
    """Draw trajectories; the first sweeps both axes, so that every axis is moved in what models are fitted to."""

    def number(name: str) -> float:
        return PATHS[name].draw(rng, split)

    kinds: list[Callable[[np.random.Generator, Draw], tuple[Axis, Axis]]] = [sweep]
    others = [sweep, track, prepoint, hand_over, pass_over]
    kinds += [others[k] for k in rng.permutation(len(others))[: count - 1]]
    made: list[Commands] = []
    while len(made) < count:
        az, el = kinds[len(made)](rng, number)
        duration = round(number("duration"), 1)
        try:
            path = commands(az, el, duration)
        except ValueError:  # beyond a stop or the greatest rate: drawn again
            continue
        elevation = np.degrees(path.position[:, 1])
        if elevation.min() > _LEAST_EL and elevation.max() < _MOST_EL:
            made.append(path)
    return made


def _sign(rng: np.random.Generator) -> float:
    return float(rng.choice([-1.0, 1.0]))


def sweep(rng: np.random.Generator, number: Draw) -> tuple[Axis, Axis]:
    """Rates of both axes from zero to a peak, to its negative, to zero, elevation slower and later."""

    def axis(start: float, peak: float, rest: float, half: float) -> Axis:
        a = abs(peak) / half
        return Axis(start).rest(rest).accelerate(peak, a).accelerate(-peak, a).accelerate(0.0, a)

    az = axis(number("az.start"), _sign(rng) * number("rate.quick"), 2.0, float(rng.uniform(12, 15)))
    start = number("el.low")
    el = axis(start, number("rate.quick") * 0.6, float(rng.uniform(2, 6)), float(rng.uniform(12, 15)))
    return az, el


def track(rng: np.random.Generator, number: Draw) -> tuple[Axis, Axis]:
    """Slow rates with a reversal of each axis at an instant of its own."""

    def axis(start: float, sign: float) -> Axis:
        first, second, a = number("rate.slow"), number("rate.slow"), number("acceleration")
        moved = Axis(start).rest(2.0).accelerate(sign * first, a).rest(float(rng.uniform(15, 25)))
        return moved.accelerate(-sign * second, a).rest(60.0)

    return axis(number("az.start"), _sign(rng)), axis(number("el.high"), -1.0)


def prepoint(rng: np.random.Generator, number: Draw) -> tuple[Axis, Axis]:
    """Elevation from rest to rest at a constant rate (EL089P00, shortened), azimuth at rest or creeping."""
    az = Axis(number("az.start")).rest(2.0)
    if rng.uniform() < 0.5:
        az = az.accelerate(_sign(rng) * number("rate.slow"), 0.015)
    el = Axis(number("el.low")).rest(8.0).move(float(rng.uniform(12.0, 16.0)), rate=0.3, acceleration=0.03)
    return az, el


def hand_over(rng: np.random.Generator, number: Draw) -> tuple[Axis, Axis]:
    """Track, slew to another target, track again (ACQ600, shortened)."""

    def axis(start: float, slew: float) -> Axis:
        creep = number("rate.slow") * 0.3
        moved = Axis(start).rest(2.0).accelerate(creep, 0.02).rest(8.0).accelerate(0.0, 0.02)
        return moved.move(slew, rate=1.2, acceleration=number("acceleration")).accelerate(-creep, 0.02).rest(60.0)

    return axis(number("az.start"), _sign(rng) * float(rng.uniform(8, 20))), axis(
        number("el.low"), float(rng.uniform(5, 10))
    )


def pass_over(rng: np.random.Generator, number: Draw) -> tuple[Axis, Axis]:
    """A pass close to the singularity, azimuth fastest when elevation is highest (AESING00, shortened)."""
    a = number("acceleration")
    half = 30.0
    sign = _sign(rng)
    az = Axis(number("az.start")).rest(4.0).accelerate(sign * a * half, a).accelerate(0.0, a)
    rise = float(rng.uniform(5.0, 8.0))
    b = 4 * rise / half**2
    el = Axis(80.0).rest(4.0).move(rise, acceleration=b).move(-rise, acceleration=b)
    return az, el


def swept(paths: Sequence[Commands]) -> dict[str, tuple[float, float]]:
    """Least and greatest commanded angle of each joint, rad, in the trajectory that moves it farthest."""
    low, high = farthest([path.position for path in paths]).T
    return {name: (float(low[k]), float(high[k])) for k, name in enumerate(RANGE)}


def farthest(runs: Sequence[Array]) -> Array:
    """Least and greatest value (columns, 2) of each column in the run that moves it farthest.

    Over all runs together, a place within the range could be one that no run passes.
    """
    ends = np.stack([np.column_stack([run.min(axis=0), run.max(axis=0)]) for run in runs])
    widest = np.argmax(ends[:, :, 1] - ends[:, :, 0], axis=0)
    return np.asarray(ends[widest, np.arange(ends.shape[1])])
