r"""From any rate to the working rate, without phase, with errors that can be stated.

Two linear-phase Kaiser filters. The first takes every M-th sample of a low-pass, M = floor(rate / 2 r_w), so
that a little more than twice the working rate r_w is kept of a recording. The second interpolates those at
arbitrary times, which makes the exact working rate of any ratio and applies the clock's offset and skew:

    y(t) = sum_i g(t r_i - i) x_i,   g(u) = 2 c sinc(2 c u) kaiser(u),  c = r / 2 r_i,  r = min(r_i, r_w)

with r_i the kept rate. Gain error <= 1e-5 up to 0.4 r, and what would alias into that band is down by 120 dB
(tests measure both with tones). Between 0.4 r and 0.6 r the response falls, half at 0.5 r.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.signal import kaiser_beta
from scipy.special import i0

from kbs_process.machine_code import njit
from kbs_process.signals.records import Array, Mask

ATTENUATION_DB = 140.0  # of the design; 20 dB in hand for two stages
PASS, STOP = 0.4, 0.6  # of the working rate
PHASES = 2048  # tabulated phases of g; linear interpolation between them errs by 1e-7
BLOCK = 8192


def kaiser_half_width(transition: float) -> float:
    """Half length, in samples, of a Kaiser filter whose transition band is `transition` of the rate."""
    return (ATTENUATION_DB - 7.95) / (2.285 * 2.0 * np.pi * transition) / 2.0


def kaiser_sinc(u: Array, cut: float, half: float) -> Array:
    """Windowed ideal low-pass at u samples from its centre, cut-off `cut` of the rate."""
    beta = float(kaiser_beta(ATTENUATION_DB))
    inside = np.clip(1.0 - (u / half) ** 2, 0.0, None)
    window = np.where(np.abs(u) <= half, i0(beta * np.sqrt(inside)) / i0(beta), 0.0)
    g: Array = 2.0 * cut * np.sinc(2.0 * cut * u) * window
    return g


@dataclass(frozen=True, slots=True, eq=False)
class Design:
    """Both filters for one input rate and one working rate."""

    rate: float  # Hz, in
    working_rate: float  # Hz
    factor: int  # M
    taps: Array  # (2 H + 1,), the first filter; a single 1 where M = 1
    table: Array  # (PHASES + 1, 2 W), g at -W + 1 + j - p / PHASES

    @property
    def half(self) -> int:
        """H, input samples."""
        return len(self.taps) // 2

    @property
    def reach(self) -> int:
        """W, kept samples."""
        return int(self.table.shape[1]) // 2

    @property
    def kept_rate(self) -> float:
        """Hz, between the filters."""
        return self.rate / self.factor

    @property
    def extension(self) -> int:
        """Input samples that both filters together look beyond either end."""
        return self.half + (self.reach + 1) * self.factor

    def leaning(self, doubt: float) -> float:
        """From how far off, s, what is invented weighs more than `doubt` in a sample, by both filters."""
        spaced = np.kron(np.abs(self.table).max(axis=0), np.arange(self.factor) == 0)
        weight = np.cumsum(np.convolve(spaced, np.abs(self.taps)))
        return float((self.reach - 1) * self.factor + self.half + 1 - np.searchsorted(weight, doubt)) / self.rate

    @property
    def passband(self) -> float:
        """Hz up to which the gain is 1 within 1e-5."""
        return PASS * min(self.kept_rate, self.working_rate)


@lru_cache(maxsize=16)
def design(rate: float, working_rate: float) -> Design:
    """Design both filters; rates in Hz, any ratio, an input slower than the working rate included."""
    factor = max(int(np.floor(rate / (2.0 * working_rate) * (1.0 + 1e-9))), 1)
    taps = np.ones(1)
    if factor > 1:
        kept = rate / factor
        transition = (kept - 2.0 * PASS * working_rate) / rate
        half = int(np.ceil(kaiser_half_width(transition)))
        taps = kaiser_sinc(np.arange(-half, half + 1.0), 0.5 / factor, half + 1.0)
        taps /= taps.sum()
    kept = rate / factor
    slower = min(kept, working_rate)
    width = kaiser_half_width((STOP - PASS) * slower / kept)
    reach = int(np.ceil(width))
    offsets = np.arange(-reach + 1.0, reach + 1.0)
    phases = np.arange(PHASES + 1)[:, None] / PHASES
    table = kaiser_sinc(offsets - phases, 0.5 * slower / kept, width)
    table /= table.sum(axis=1, keepdims=True)  # a constant passes exactly, at every phase
    return Design(rate, working_rate, factor, taps, table)


class Extender:
    """Continue a stream beyond both ends by `count` rows: the end's straight line plus the mirrored rest.

    The line keeps a trend going; the mirrored residual keeps the spectrum. What is invented is flagged.
    """

    def __init__(self, count: int) -> None:
        self._count = count
        self._recent: list[tuple[Array, Mask | None]] = []
        self._begun = False

    @property
    def begun(self) -> bool:
        """Whether there were enough rows to begin with."""
        return self._begun

    def push(self, rows: Array, invented: Mask | None) -> Iterator[tuple[Array, Mask | None]]:
        self._recent.append((rows, invented))
        held = sum(len(piece) for piece, _ in self._recent)
        if not self._begun:
            if held <= self._count:
                return
            self._begun = True
            head = np.concatenate([piece for piece, _ in self._recent])[: self._count + 1]
            yield self._mirror(head)[::-1], np.ones(self._count, dtype=np.bool_)
            yield from list(self._recent)
        else:
            yield rows, invented
        while held - len(self._recent[0][0]) > self._count:
            held -= len(self._recent.pop(0)[0])

    def flush(self) -> Iterator[tuple[Array, Mask | None]]:
        if self._begun:
            tail = np.concatenate([piece for piece, _ in self._recent])[-self._count - 1 :]
            yield self._mirror(tail[::-1]), np.ones(self._count, dtype=np.bool_)

    def _mirror(self, rows: Array) -> Array:
        """Continue rows (count + 1, c), of which the first is the end, outwards: (count, c)."""
        m = np.arange(len(rows), dtype=np.float64)
        centred = m - m.mean()
        slope = centred @ rows / (centred @ centred)
        # level - slope m, the line outwards, plus the mirrored residual, rows - (level + slope m)
        continued: Array = (rows - 2.0 * m[:, None] * slope)[1:]
        return continued


class Decimator:
    """The first filter, block by block; its output k is centred on input row k M of the extended stream."""

    def __init__(self, design: Design) -> None:
        self._design = design
        # Transposed, as the filter runs along contiguous memory: the last row is the flag of invented samples.
        self._x: Array = np.empty((0, 0))
        self._held = 0
        self._doubtful = False  # whether any flag is held
        self._rows: list[Array] = []
        self._weights: list[Array] = []

    def push(self, rows: Array, invented: Mask | None) -> None:
        """Take rows (n, c) in order; the first output is centred on the H-th of them."""
        end = self._held + len(rows)
        if end > self._x.shape[1]:
            held = self._x[:, : self._held]
            self._x = np.empty((rows.shape[1] + 1, end))
            if self._held:
                self._x[:, : self._held] = held
        x = self._x
        x[:-1, self._held : end] = rows.T
        x[-1, self._held : end] = 0.0 if invented is None else invented
        self._doubtful = self._doubtful or invented is not None
        taps, factor = self._design.taps, self._design.factor
        count = max((end - len(taps)) // factor + 1, 0)
        if count:
            self._rows.append(_every(x[:-1], taps, factor, count))
            doubtful = self._doubtful
            self._weights.append(_every(x[-1:], np.abs(taps), factor, count)[0] if doubtful else np.zeros(count))
        self._held = end - count * factor
        x[:, : self._held] = x[:, count * factor : end].copy()
        self._doubtful = self._doubtful and bool(x[-1, : self._held].any())

    def result(self) -> tuple[Array, Array]:
        """Give away kept samples (c, k) and the weight (k,) that invented input has in each."""
        rows, self._rows = np.concatenate(self._rows, axis=1), []
        weights, self._weights = np.concatenate(self._weights), []
        return rows, weights


# Slices below, because an index that may be negative keeps the compiler from vectorising: a factor of four.
@njit(cache=True, error_model="numpy", fastmath={"reassoc", "contract"})
def _dot(a: Array, b: Array) -> float:
    total = 0.0
    for j in range(len(a)):
        total += a[j] * b[j]
    return total


@njit(cache=True, error_model="numpy", fastmath={"reassoc", "contract"})
def _every(x: Array, taps: Array, factor: int, count: int) -> Array:
    """y[c, k] = sum_j taps[j] x[c, k factor + j]; four outputs at a time, which share the loads of the taps."""
    n = len(taps)
    y = np.empty((x.shape[0], count))
    for c in range(x.shape[0]):
        row = x[c]
        k = 0
        while k + 4 <= count:
            i = k * factor
            x0, x1 = row[i : i + n], row[i + factor : i + factor + n]
            x2, x3 = row[i + 2 * factor : i + 2 * factor + n], row[i + 3 * factor : i + 3 * factor + n]
            y0 = y1 = y2 = y3 = 0.0
            for j in range(n):
                h = taps[j]
                y0 += h * x0[j]
                y1 += h * x1[j]
                y2 += h * x2[j]
                y3 += h * x3[j]
            y[c, k], y[c, k + 1], y[c, k + 2], y[c, k + 3] = y0, y1, y2, y3
            k += 4
        while k < count:
            y[c, k] = _dot(taps, row[k * factor : k * factor + n])
            k += 1
    return y


@njit(cache=True, error_model="numpy", fastmath={"reassoc", "contract"})
def _at(x: Array, weight: Array, position: Array, table: Array) -> tuple[Array, Array]:
    """Interpolate x (c, k) and the weights of invented samples at fractional positions (n,): (n, c), (n,)."""
    phases, width = table.shape[0] - 1, table.shape[1]
    y = np.zeros((len(position), x.shape[0]))
    doubt = np.zeros(len(position))
    g = np.empty(width)
    for n in range(len(position)):
        whole = int(np.floor(position[n]))
        fraction = (position[n] - whole) * phases
        row = int(fraction)
        share = fraction - row
        start = whole - width // 2 + 1
        if start < 0 or start + width > x.shape[1]:
            # Beyond the extension: hold the last value there is, in full doubt.
            for c in range(x.shape[0]):
                y[n, c] = x[c, min(max(whole, 0), x.shape[1] - 1)]
            doubt[n] = 1.0
            continue
        lower, upper, invented = table[row], table[row + 1], weight[start : start + width]
        total = 0.0
        for j in range(width):
            g[j] = (1.0 - share) * lower[j] + share * upper[j]
            total += abs(g[j]) * invented[j]
        doubt[n] = total
        for c in range(x.shape[0]):
            y[n, c] = _dot(g, x[c, start : start + width])
    return y, doubt


@dataclass(frozen=True, slots=True, eq=False)
class Kept:
    """A stream at a little more than twice the working rate, extended at both ends."""

    design: Design
    x: Array  # (c, k)
    weight: Array  # (k,) of invented samples in each
    samples: int  # input rows without the extensions

    def at(self, own: Array) -> tuple[Array, Array]:
        """Return values (n, c) at times own (n,), s from the first sample, and the invented weight (n,)."""
        before = self.design.extension - self.design.half
        position = (own * self.design.rate + before) / self.design.factor
        values, doubt = _at(self.x, self.weight, position, self.design.table)
        return values, doubt


class Reducer:
    """Extend and decimate a stream that comes as uniform rows."""

    def __init__(self, design: Design) -> None:
        self._design = design
        self._extender = Extender(design.extension)
        self._decimator = Decimator(design)
        self._samples = 0

    def push(self, rows: Array, invented: Mask | None) -> None:
        self._samples += len(rows)
        self._take(self._extender.push(rows, invented))

    def finish(self) -> Kept | None:
        """Return what was kept, or None where there were too few samples for the filters."""
        if not self._extender.begun:
            return None
        self._take(self._extender.flush())
        return Kept(self._design, *self._decimator.result(), self._samples)

    def _take(self, pieces: Iterable[tuple[Array, Mask | None]]) -> None:
        for rows, invented in pieces:
            self._decimator.push(rows, invented)


def resample(values: Array, rate: float, working_rate: float) -> Array:
    """Reduce uniform samples (n, c) at `rate` to the working rate, first sample on first sample: (m, c).

    Raises ValueError for fewer samples than the filters' half length.
    """
    reducer = Reducer(design(rate, working_rate))
    for start in range(0, len(values), BLOCK):
        reducer.push(values[start : start + BLOCK], None)
    kept = reducer.finish()
    if kept is None:
        raise ValueError(f"{len(values)} samples are too few for a filter at {working_rate:g} Hz")
    count = int(np.floor((len(values) - 1) / rate * working_rate * (1.0 + 1e-12))) + 1
    return kept.at(np.arange(count) / working_rate)[0]
