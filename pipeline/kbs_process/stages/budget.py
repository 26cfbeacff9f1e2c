"""The uncertainty budget: what every stage may be wrong by, in one band, on every channel.

Every entry is the rms over the run of a one-sigma error, taken through the same linear stages as the signal.
Entries are independent causes; the total is the root of their sum of squares (JCGM 100:2008, 5.1.2).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from kbs_process.signals.records import Array, Signal

Filter = Callable[[Signal], Signal]


@dataclass(frozen=True, slots=True, eq=False)
class Entry:
    """One stage's part: standard deviations (c,) of the channels, in their units."""

    stage: str
    source: str
    sigma: Array


def total(entries: Sequence[Entry]) -> Array:
    """Root of the sum of squares, (c,)."""
    squares: Array = np.sqrt(np.sum([entry.sigma**2 for entry in entries], axis=0))
    return squares


def rms(signal: Signal) -> Array:
    """Root mean square of the valid samples of every channel, (c,)."""
    values: Array = np.sqrt(np.mean(signal.values[signal.valid] ** 2, axis=0))
    return values


def sensor_noise(noise: Array, rate: float, bandwidth: float) -> Entry:
    """White noise of rms `noise` (c,) a sample at `rate` Hz, in a band `bandwidth` Hz wide: noise sqrt(2 B / rate)."""
    return Entry("transducer", "noise of the transducer, white", noise * np.sqrt(2.0 * bandwidth / rate))


def from_shapes(stage: str, source: str, shapes: Sequence[Signal], band: Filter) -> Entry:
    """Entry of a stage whose independent one-sigma errors have known time histories `shapes` (at least one)."""
    squares = sum((rms(band(shape)) ** 2 for shape in shapes), np.zeros(len(shapes[0].channels)))
    return Entry(stage, source, np.sqrt(squares))


def cross_coupling(wrench: Signal, sigma: Array) -> Entry:
    """Error of each channel from the uncertainty `sigma` (c, c) of the matrix, for a wrench within the band."""
    return Entry(
        "cross-coupling", "uncertainty of the calibrated matrix", np.sqrt(sigma**2 @ rms(wrench) ** 2)
    )


def clock(static: Signal, sigma_s: float, band: Filter) -> Entry:
    """Error of the static model evaluated `sigma_s` s early or late: its time derivative times that."""
    slope = static.derive(np.gradient(static.values, static.dt, axis=0) * sigma_s, "time derivative")
    return Entry("clocks", "encoder against transducer: clocks, amplifier's delay", rms(band(slope)))


def repeatability(noise_rms: Array, explained: Array) -> Entry:
    """What repeats differ by beyond the noise that is already in the budget (`explained`, (c,))."""
    excess = np.sqrt(np.maximum(noise_rms**2 - explained**2, 0.0))
    return Entry("repeatability", "differences of repeats beyond sensor noise", excess)


def filter_edges(signal: Signal, relative: float) -> Entry:
    """Transient of the band's filter at the ends of the record: `relative` of the signal."""
    return Entry("band filter", "transient at the ends of the record", relative * rms(signal))


def resonance(signal: Signal, frequency: float | None, passband: tuple[float, float]) -> Entry:
    """Amplification of the interface wrench by the rocking mode above the band: 1 / (1 - (f2 / f0)^2) - 1.

    Exact at the band's upper edge for one undamped mode, too large below it; it concerns what a rigid interface would
    feel. Where the mode lies within the band the amplification is not an error but the signal: the whole signal.
    """
    if frequency is None:
        return Entry("transducer", "resonance next to the band", np.zeros(len(signal.channels)))
    ratio = (passband[1] / frequency) ** 2
    gain = ratio / (1.0 - ratio) if ratio < 0.5 else 1.0
    return Entry("transducer", "resonance next to the band", gain * rms(signal))
