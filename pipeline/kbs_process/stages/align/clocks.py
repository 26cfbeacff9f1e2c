"""Every stream has its sensor's clock; the recorder's clock is common to all. One axis out of both.

A message is logged some latency after it was stamped, log - stamp = a + b stamp + latency, latency >= 0 and
irregular. The least latency of many messages hardly varies, so the line through the *floor* of log - stamp
gives the sensor clock's offset a and skew b against the recorder. Two streams are related through it.

What no such method can see is a difference between the least latencies of two streams: it counts as offset.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from kbs_process.rig.model import Amplifier
from kbs_process.signals.records import Array, Clock, Stamps

STRETCHES = 256  # bound on the pairs kept, however long the recording
LEAST_PAIRS = 8
UNKNOWN_OFFSET_S = 1e-3  # standard uncertainty taken for clocks that cannot be compared
NO_CLOCK = 0.1  # beyond it the recorder's clock tells nothing (a file written in one go)
LARGEST_SKEW = 3e-4  # no oscillator is further off, and some latency grows
BENT = 5e-5  # by how much an oscillator's skew may differ between the halves of a recording, as it warms up
LEAST_STEP_S = 1e-3
STEP_SCATTERS = 8.0  # a step of the floor: so many times what it changes by from stretch to stretch
LEVEL = 8  # stretches on either side that a step lasts


@dataclass(frozen=True, slots=True)
class ClockLine:
    """recorder = offset + (1 + skew) own, both in s from their own zero, valid around `middle`."""

    offset: float  # s, at own = 0
    skew: float
    middle: float  # s, own time where offset and skew are uncorrelated
    sigma_middle: float  # s, standard uncertainty of recorder - own at the middle
    sigma_skew: float
    latency: float  # s, mean above the floor

    def sigma(self, own: float) -> float:
        """Standard uncertainty of the recorder time at own time `own`, s."""
        return float(np.hypot(self.sigma_middle, self.sigma_skew * (own - self.middle)))


@dataclass(frozen=True, slots=True)
class FloorStep:
    """A step of log - stamp that lasts."""

    own: float  # s, on the stream's own clock
    by: float  # s
    within: float  # s, how well `own` is known


class LatencyFloor:
    """The message of least latency in each of at most `STRETCHES` stretches of time, found in one pass.

    Stretches start at 1/16 s and double in length whenever there are too many of them.
    """

    def __init__(self, first_stamp: int, first_log: int) -> None:
        self.first_stamp = first_stamp
        self.first_log = first_log
        self._width = 62_500_000  # ns
        self._floor: dict[int, tuple[int, int]] = {}  # stretch -> own time, latency (ns, from the first)
        self._sum = 0.0
        self._count = 0
        self._known: tuple[int, ClockLine | None, str] | None = None

    def push(self, stamp: Stamps, log: Stamps) -> None:
        """Take stamps in increasing order with their recorder times."""
        own = stamp - self.first_stamp
        latency = (log - self.first_log) - own
        self._sum += float(latency.sum(dtype=np.float64))
        self._count += len(own)
        while own[-1] // self._width >= STRETCHES:
            self._width *= 2
            kept, self._floor = self._floor, {}
            for at, least in kept.values():
                self._keep(at, least)
        edges = np.flatnonzero(np.diff(own // self._width)) + 1
        for start, stop in zip([0, *edges.tolist()], [*edges.tolist(), len(own)], strict=True):
            index = start + int(np.argmin(latency[start:stop]))
            self._keep(int(own[index]), int(latency[index]))

    def _keep(self, own: int, latency: int) -> None:
        stretch = own // self._width
        if stretch not in self._floor or latency < self._floor[stretch][1]:
            self._floor[stretch] = (own, latency)

    def line(self) -> ClockLine | None:
        """Fit the floor; None where it is too short, or does not run like a clock (`trouble`)."""
        line, trouble = self._judged()
        return None if trouble else line

    def trouble(self) -> str:
        """Why the floor is no line of two clocks, or nothing."""
        return self._judged()[1]

    def _judged(self) -> tuple[ClockLine | None, str]:
        """Line and trouble, fitted once for all messages so far."""
        if self._known is None or self._known[0] != self._count:
            line = self._fitted()
            self._known = (self._count, line, "" if line is None else self._trouble(line))
        return self._known[1:]

    def _trouble(self, line: ClockLine) -> str:
        own, floor = self._pairs()
        if abs(line.skew) >= LARGEST_SKEW:
            ways = f"{'later' if line.skew > 0.0 else 'earlier'} by {1e3 * abs(line.skew):.3g} ms each second"
            return f"log times come {ways}, and no oscillator is so far off: a latency that grows, not a skew"
        if (step := self.step()) is not None:
            return (
                f"log times come {1e3 * step.by:+.3g} ms later from {step.own:.4g} s on: no clock is compared by them"
            )
        if len(own) >= 4 * LEAST_PAIRS:
            half = len(own) // 2
            parts = [fit_floor(own[part], floor[part], 0.0) for part in (slice(0, half), slice(half, None))]
            bent = parts[1].skew - parts[0].skew
            if abs(bent) > BENT + 6.0 * np.hypot(parts[0].sigma_skew, parts[1].sigma_skew):
                return f"log times drift, {1e6 * bent:+.3g} ppm from half to half: a latency that changes, not a skew"
        return ""

    def step(self) -> FloorStep | None:
        """Find the largest step of the floor from one level to another, both of which last."""
        if len(self._floor) < 2 * LEAST_PAIRS:
            return None
        own, floor = self._pairs()
        # A skew is no step: of the slopes over a quarter of the whole, few have a step in them.
        far = len(own) // 4
        floor = floor - float(np.median((floor[far:] - floor[:-far]) / (own[far:] - own[:-far]))) * own
        change = np.diff(floor)
        scatter = 1.4826 * float(np.median(np.abs(change - np.median(change))))
        best: FloorStep | None = None
        for at in np.flatnonzero(np.abs(change) > max(LEAST_STEP_S, STEP_SCATTERS * scatter)):
            before, after = floor[max(at + 1 - LEVEL, 0) : at + 1], floor[at + 1 : at + 1 + LEVEL]
            by = float(np.median(after) - np.median(before))
            lasts = min(len(before), len(after)) >= LEAST_PAIRS // 2 and abs(by - change[at]) < 0.3 * abs(by)
            if lasts and (best is None or abs(by) > abs(best.by)):
                best = FloorStep(float(own[at : at + 2].mean()), by, float(own[at + 1] - own[at]))
        return best

    def _pairs(self) -> tuple[Array, Array]:
        pairs = np.array(sorted(self._floor.values()), dtype=np.float64) * 1e-9
        return pairs[:, 0], pairs[:, 1]

    def _fitted(self) -> ClockLine | None:
        if len(self._floor) < LEAST_PAIRS:
            return None
        line = fit_floor(*self._pairs(), self._sum / self._count * 1e-9)
        return line if abs(line.skew) < NO_CLOCK else None


def fit_floor(own: Array, floor: Array, mean: float) -> ClockLine:
    """Fit a line to floor samples by Huber's M-estimate (iteratively reweighted least squares).

    own (n,) s, floor (n,) s; `mean` is the mean latency of all messages. Robust, as a stretch may hold no
    message in time, or one that a stepped recorder clock brought too early.

    Uncertainty: the statistical part of the line, and for the level the floor's own scatter s and a tenth of
    the mean latency above it, in quadrature: for latencies with an exponential tail the floor lies above
    the true one by about s, for others by more.
    """
    middle = float(own.mean())
    x = own - middle
    design = np.column_stack((np.ones_like(x), x))
    weight = np.ones_like(x)
    for _ in range(30):
        normal = design.T @ (weight[:, None] * design)
        level, slope = np.linalg.solve(normal, design.T @ (weight * floor))
        residual = floor - level - slope * x
        scatter = max(1.4826 * float(np.median(np.abs(residual))), 1e-9)  # stamps are rounded to 1 ns
        weight = np.minimum(1.0, 1.5 * scatter / np.maximum(np.abs(residual), 1e-15))
    # The mean latency refers to the line at the mean time; messages are spread evenly enough for that.
    latency = max(mean - float(level), 0.0)
    covariance = np.linalg.inv(normal) * scatter**2
    return ClockLine(
        offset=float(level - slope * middle),
        skew=float(slope),
        middle=middle,
        sigma_middle=float(np.sqrt(covariance[0, 0] + scatter**2 + (0.1 * latency) ** 2)),
        sigma_skew=float(np.sqrt(covariance[1, 1])),
        latency=latency,
    )


@dataclass(frozen=True, slots=True)
class ClockData:
    """What one stream knows about its clock once it has been read."""

    first_stamp: int  # ns
    first_log: int  # ns
    span: float  # s of its own clock
    line: ClockLine | None
    by_recorder: bool  # its stamps were no clock; the recorder's time is used instead


def align(streams: dict[str, ClockData], reference: str) -> dict[str, Clock]:
    """Map every stream's clock to the reference's: t = 0 at the reference's first sample.

    A clock that agrees with one already placed, within three standard uncertainties at both of its ends, is
    taken to be that clock: streams of one computer keep their relation exactly. The uncertainty stated remains
    that of the comparison, which is all that shows that it is one clock.
    """
    base = streams[reference]
    clocks = {
        reference: Clock(
            0.0, 0.0, 0.0, 0.0, base.line.latency if base.line else float("nan"), _own_source(base, "reference")
        )
    }
    for key, data in streams.items():
        if key != reference:
            clocks[key] = _place(data, streams, clocks, reference)
    return clocks


def offset_sigma(clock: Clock) -> float:
    """Return the standard uncertainty of a clock's offset, s; a conventional one where nothing was there to tell."""
    return clock.sigma_offset_s if np.isfinite(clock.sigma_offset_s) else UNKNOWN_OFFSET_S


def late_sigma(clocks: Mapping[str, Clock], amplifier: Amplifier | None, stated: float = 0.0) -> float:
    """How well it is known when angles and wrench belong together, s: their clocks, and the amplifier's delay.

    `stated` is what the clocks are uncertain by beyond what their stamps tell.
    """
    clock = clocks.get("angle") or clocks.get("rate")
    late = UNKNOWN_OFFSET_S if clock is None else float(np.hypot(offset_sigma(clock), np.nan_to_num(clock.latency_s)))
    late = float(np.hypot(late, stated))
    if amplifier is None:
        return late
    return float(np.hypot(late, amplifier.delay * float(amplifier.corner.sigma) / float(amplifier.corner)))


def _own_source(data: ClockData, otherwise: str) -> str:
    return "recorder" if data.by_recorder else otherwise


def _place(data: ClockData, streams: dict[str, ClockData], clocks: dict[str, Clock], reference: str) -> Clock:
    base = streams[reference]
    if data.line is None or base.line is None:
        # A recorder's time is compared with a recorder's.
        logged = data.by_recorder != base.by_recorder
        begins = (data.first_log, base.first_log) if logged else (data.first_stamp, base.first_stamp)
        start = (begins[0] - begins[1]) * 1e-9
        return Clock(start, 0.0, float("nan"), float("nan"), float("nan"), _own_source(data, "not comparable"))
    fitted = _against(data, data.line, base, base.line, _own_source(data, "fitted"))
    for key, clock in clocks.items():
        other = streams[key]
        if other.line is None or other.by_recorder != data.by_recorder:
            continue
        # The same clock would put this stream's first sample here:
        lead = (data.first_stamp - other.first_stamp) * 1e-9
        shared = Clock(
            clock.offset_s + (1.0 + clock.skew) * lead,
            clock.skew,
            fitted.sigma_offset_s,
            fitted.sigma_skew,
            data.line.latency,
            f"same as {key}",
        )
        ends = (0.0, data.span)
        apart = [fitted.offset_s - shared.offset_s + (fitted.skew - shared.skew) * own for own in ends]
        spread = [np.hypot(data.line.sigma(own), other.line.sigma(own + lead)) for own in ends]
        if all(abs(a) <= 3.0 * s for a, s in zip(apart, spread, strict=True)):
            return shared
    return fitted


def _against(data: ClockData, line: ClockLine, base: ClockData, reference: ClockLine, source: str) -> Clock:
    # own -> recorder -> reference, with both recorder zeros brought to one
    recorder_zero = (data.first_log - base.first_log) * 1e-9
    rate = 1.0 + reference.skew
    offset = (recorder_zero + line.offset - reference.offset) / rate
    skew = (1.0 + line.skew) / rate - 1.0
    middle = offset + (1.0 + skew) * line.middle
    return Clock(
        offset_s=offset,
        skew=skew,
        sigma_offset_s=float(np.hypot(line.sigma_middle, reference.sigma(middle))),
        sigma_skew=float(np.hypot(line.sigma_skew, reference.sigma_skew)),
        latency_s=line.latency,
        source=source,
    )
