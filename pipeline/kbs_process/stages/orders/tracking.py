r"""Loads over a joint's angle: spectra over order (cycles in a turn of the joint), window by window.

Equation: with windows of L turns, u the way into one and a Hann window w(u),
    $X(k) = 2 \sum_i w_i |\dot q_i| y_i e^{-2 \pi i k u_i} / \sum_i w_i |\dot q_i|$,
    the integral of y over the angle: A sin(k q) gives A at k, whatever the rate does. A tone of fixed frequency is
    spread over the orders that the rate makes of it. $Y(f)$ is the same with $e^{-2 \pi i f t_i}$: there it is a line.
    A straight line over the angle is taken off first. Windows of a recording overlap by half. Their powers are averaged
    with weights that make white noise equally large in each.
Units: N m, rad/s, turns -> N m, an amplitude.
Validity: at the local rate, samples show orders up to band / rate. Up to there the sum over samples is the integral. It
    is made on a uniform grid in angle, over which a symmetrical kernel spreads every sample, so that nothing is
    delayed; its response is divided out. An angle that errs by s (rad) costs k^2 s^2 / 2 of the amplitude of order k.
Source: J. R. Blough, A survey of DSP methods for rotating machinery analysis, J. Sound and Vibration 262 (2003) 707;
    L. Greengard, J.-Y. Lee, Accelerating the nonuniform fast Fourier transform, SIAM Review 46 (2004) 443.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.fft import fft, next_fast_len, rfft

from kbs_process.signals.records import Array, Mask

OVER = 4  # orders computed to one that a window tells from the next
WIDTH = 1.44  # of a line behind a Hann window at half of its power, in 1 / L
FEWEST = 32  # lines that a window must hold for its spectrum to have a floor
LEAST = 3.0  # periods in a window, below which a line is not told from a drift
LONGEST = 8.0  # turns of a window
_MOVES = 0.05  # of a recording's fastest rate: slower ones count as rest
_ALIKE = 0.95  # of the longest stretch: those that are hardly shorter have a window, too
_LOST = 0.05  # of an amplitude, by what the angle errs
_OVERLAP = 1.06  # windows that overlap by half to one that is independent
_SPREAD = 6  # cells of the grid to either side over which a sample is spread: errors of 1e-6


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """How one joint moves through a recording, and up to which frequency loads beside it are shown."""

    turns: Array  # (n,) angle
    rate: Array  # (n,) turns/s
    valid: Mask  # (n,)
    dt: float  # s
    sigma: float  # rad, of the angle
    band_Hz: float

    @property
    def by_angle(self) -> float:
        """Order up to which the angle is known well enough."""
        return float(np.sqrt(2.0 * _LOST) / self.sigma) if self.sigma > 0.0 else np.inf

    def highest(self, fastest: float) -> float:
        """Return the highest order that shows at a rate (turns/s)."""
        return min(self.band_Hz / fastest, self.by_angle)

    def stretches(self) -> list[tuple[int, int]]:
        """Samples from which to which the joint moves one way, without a gap."""
        moves = np.abs(self.rate) > _MOVES * np.max(np.abs(self.rate), initial=0.0)
        way = np.where(self.valid & moves, np.sign(self.rate), 0.0)
        edges = np.flatnonzero(np.diff(way, prepend=0.0, append=0.0))
        return [(int(a), int(b)) for a, b in itertools.pairwise(edges) if way[a] != 0.0 and b - a > 1]

    def longest(self) -> float:
        """Turns of the longest stretch."""
        return max((abs(float(self.turns[b - 1] - self.turns[a])) for a, b in self.stretches()), default=0.0)


@dataclass(frozen=True, slots=True, eq=False)
class Window:
    """The spectrum of one window: orders are multiples of 1 / (OVER L), frequencies of a step that all share."""

    turns: float  # angle in its middle
    rate: float  # turns/s, mean magnitude
    fastest: float
    frequency_step: float  # Hz
    noise: float  # what white noise of one N m^2/Hz would make of each power below
    power: Array  # (orders, c) amplitude squared
    tones: Array  # (frequencies, c) likewise


@dataclass(frozen=True, slots=True, eq=False)
class Average:
    """Mean spectra of a recording's windows."""

    length: float  # turns of a window
    windows: int
    order: Array  # (m,)
    power: Array  # (m, c) amplitude squared
    averages: Array  # (m, c) of how many windows each power is: few, where few have most of it
    frequency: Array  # (f,) Hz
    tones: Array  # (f, c)
    rates: tuple[float, float]  # turns/s, least and greatest mean of a window

    @property
    def resolution(self) -> float:
        """Width of a line."""
        return WIDTH / self.length


def length_of(track: Track) -> float:
    """Return the turns of a window: the longest stretch, up to so many that a line is narrow; 0 of one too short."""
    length = min(_ALIKE * track.longest(), LONGEST)
    one = next(windows(track, np.zeros((len(track.turns), 1)), length), None) if length > 0.0 else None
    return length if one is not None and length * track.highest(one.fastest) >= FEWEST else 0.0


def windows(track: Track, loads: Array, length: float, hop: float = 0.5) -> Iterator[Window]:
    """Yield the spectrum of loads (n, c) in each window of so many turns, one after the other."""
    parts = list(_parts(track, length, hop))
    for part in parts:
        yield _window(track, loads[part], part, length, _size(parts))


def _size(parts: Sequence[slice]) -> int:
    """Samples to which each window is lengthened with noughts before its spectrum over frequency is made."""
    return int(next_fast_len(OVER * max((part.stop - part.start for part in parts), default=1), real=True))


def _parts(track: Track, length: float, hop: float) -> Iterator[slice]:
    for begin, end in track.stretches():
        way = np.maximum.accumulate(np.abs(track.turns[begin:end] - track.turns[begin]))
        for start in np.arange(0.0, way[-1] - 0.999 * length, hop * length):
            first, last = np.searchsorted(way, [start, start + length])
            if last - first > _SPREAD:
                yield slice(begin + int(first), begin + int(last))


def _window(track: Track, loads: Array, part: slice, length: float, size: int) -> Window:
    way, weight = _weighted(track, part, length)
    rate = np.abs(track.rate[part])
    total = float(np.sum(weight))
    line = np.column_stack([np.ones(len(way)), way - way.mean()])
    root = np.sqrt(np.maximum(weight, 0.0))[:, None]
    fit = np.linalg.lstsq(root * line, root * loads, rcond=None)[0]
    weighted = weight[:, None] * (loads - line @ fit) * (2.0 / total)
    fastest = float(np.max(rate))
    lines = int(OVER * length * track.highest(fastest)) + 1
    return Window(
        turns=float(track.turns[(part.start + part.stop) // 2]),
        rate=float(np.mean(rate)),
        fastest=fastest,
        frequency_step=1.0 / (size * track.dt),
        noise=float(2.0 * np.sum(weight**2) / (track.dt * total**2)),
        power=np.abs(_along(way / (OVER * length), weighted, lines)) ** 2,
        tones=np.abs(rfft(weighted, size, axis=0)[: int(track.band_Hz * size * track.dt) + 1]) ** 2,
    )


def _weighted(track: Track, part: slice, length: float) -> tuple[Array, Array]:
    """Way of each sample into its window, turns, and its weight: that of the window times the rate."""
    way = np.abs(track.turns[part] - track.turns[part.start])
    return way, np.abs(track.rate[part]) * np.sin(np.pi * way / length) ** 2


def in_frequency(track: Track, length: float, order: float) -> Array:
    """Return the spectrum over `Average.frequency` of a load sin(k q) of amplitude 1, mean over the windows."""
    parts = list(_parts(track, length, 0.5))
    size = _size(parts)
    total, weights = np.zeros(int(track.band_Hz * size * track.dt) + 1), 0.0
    for part in parts:
        way, weight = _weighted(track, part, length)
        if order <= track.highest(float(np.max(np.abs(track.rate[part])))):
            scale = np.sum(weight) ** 2 / np.sum(weight**2)
            line = fft(weight * np.exp(2j * np.pi * order * way), size)[: len(total)] / np.sum(weight)
            total, weights = total + scale * np.abs(line) ** 2, weights + scale
    return total / (weights or 1.0)


def _along(place: Array, values: Array, lines: int) -> NDArray[np.complex128]:
    """Return the sum of values (n, c) times exp(-2 pi i k place), k = 0 .. lines - 1: (lines, c)."""
    size = next_fast_len(max(4 * lines, 4 * _SPREAD), real=True)
    over = size / (2.0 * lines)
    tau = np.pi * _SPREAD / (4.0 * lines**2 * over * (over - 0.5))
    step = 2.0 * np.pi / size
    cell = np.floor(size * place).astype(np.int64)
    grid = np.zeros((size, values.shape[1]))
    for tap in range(1 - _SPREAD, _SPREAD + 1):
        kernel = np.exp(-((2.0 * np.pi * place - step * (cell + tap)) ** 2) / (4.0 * tau))
        for c in range(values.shape[1]):
            grid[:, c] += np.bincount((cell + tap) % size, kernel * values[:, c], minlength=size)
    k = np.arange(lines)[:, None]
    found: NDArray[np.complex128] = np.sqrt(np.pi / tau) / size * np.exp(tau * k**2) * rfft(grid, axis=0)[:lines]
    return found


def average(track: Track, loads: Array, length: float) -> Average:
    """Return the mean spectra of loads (n, c); each order over the windows whose rate shows it."""
    order = tones = np.zeros((0, 2 * loads.shape[1] + 1))
    rates: list[float] = []
    step = 0.0
    for one in windows(track, loads, length):
        order, tones = (
            _added(sums, powers / one.noise, 1.0 / one.noise)
            for sums, powers in zip((order, tones), (one.power, one.tones), strict=True)
        )
        rates.append(one.rate)
        step = one.frequency_step
    sums, squares, weight = np.split(order, [loads.shape[1], 2 * loads.shape[1]], axis=1)
    averages = np.divide(sums**2, squares, out=np.ones_like(sums), where=squares > 0.0)
    return Average(
        length=length,
        windows=len(rates),
        order=np.arange(len(order)) / (OVER * length),
        power=sums / weight,
        averages=np.maximum(averages / _OVERLAP, 1.0),
        frequency=step * np.arange(len(tones), dtype=np.float64),
        tones=tones[:, : loads.shape[1]] / tones[:, -1:],
        rates=(min(rates), max(rates)),
    )


def _added(sums: Array, power: Array, weight: float) -> Array:
    """Add a window's powers, their squares and its weight to sums that may be shorter or longer."""
    longer = np.zeros((max(len(sums), len(power)), sums.shape[1]))
    longer[: len(sums)] = sums
    longer[: len(power)] += np.column_stack([power, power**2, np.full(len(power), weight)])
    return longer
