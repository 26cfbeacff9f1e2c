"""The uncertainty budget: what every stage may be wrong by, in one band, on every channel of one recording.

Every entry is the rms over the run of a one-sigma error, taken through the same linear stages as the signal.
Errors that depend on motion count with their rms in motion or at rest, whichever is larger: neither makes a peak in
the other better known. Entries are independent causes; the total is the root of their sum of squares
(JCGM 100:2008, 5.1.2).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from kbs_process.signals.records import Array, Mask, Signal
from kbs_process.stages.bandpass import Band, gain

Filter = Callable[[Signal], Signal]

NOISE = "noise of the transducer, white"
MATRIX = "what is not known of the matrix"
CORDS = "what is not known of its cords"
TWO_OCTAVES = 4.0
TELLING = 0.1  # least difference of the shares by which noise and drift are told apart in a band


@dataclass(frozen=True, slots=True, eq=False)
class Entry:
    """One stage's part: standard deviations (c,) of the channels, in their units."""

    stage: str
    source: str
    sigma: Array
    grows: bool = False  # with the signal: at a peak, by as many times as this is above the rms


def total(entries: Sequence[Entry]) -> Array:
    """Root of the sum of squares, (c,)."""
    squares: Array = np.sqrt(np.sum([entry.sigma**2 for entry in entries], axis=0))
    return squares


def rms(signal: Signal, moving: Mask | None = None) -> Array:
    """Root mean square of the valid samples of every channel, (c,).

    With `moving` (n,): of those in motion or of those at rest, whichever is larger.
    """
    return _root_mean(signal.values**2, signal.valid, moving)


def _root_mean(variance: Array, valid: Mask, moving: Mask | None) -> Array:
    """Root of the mean of a variance (n, c) over valid samples; the larger of motion's and rest's, given `moving`."""
    states = [valid] if moving is None else [valid & moving, valid & ~moving]
    means = [np.mean(variance[state], axis=0) for state in states if state.any()]
    root: Array = np.sqrt(np.max(means, axis=0))
    return root


def sensor_noise(noise: Array, rate: Array | float, bandwidth: float) -> Entry:
    """White noise of rms `noise` (c,) a sample at `rate` Hz, in a band `bandwidth` Hz wide: noise sqrt(2 B / rate)."""
    return Entry("transducer", NOISE, noise * np.sqrt(2.0 * bandwidth / rate))


def from_shapes(stage: str, source: str, shapes: Iterable[Signal], band: Filter, moving: Mask | None = None) -> Entry:
    """Entry of a stage whose independent one-sigma errors have known time histories `shapes` (at least one)."""
    variance, valid = np.zeros(1), np.ones(1, dtype=np.bool_)
    for cut in map(band, shapes):
        variance = variance + cut.values**2
        valid = valid & cut.valid
    return Entry(stage, source, _root_mean(variance, valid, moving))


def cross_coupling(wrench: Signal, sigma: Array) -> Entry:
    """Error of each channel from the uncertainty `sigma` (c, c) of the matrix, for a wrench within the band."""
    return Entry("cross-coupling", MATRIX, np.sqrt(sigma**2 @ rms(wrench) ** 2), grows=True)


def clock(static: Signal, sigma_s: float, band: Filter, moving: Mask | None = None) -> Entry:
    """Error of the static model evaluated `sigma_s` s early or late: its time derivative times that."""
    slope = static.derive(np.gradient(static.values, static.dt, axis=0) * sigma_s, "time derivative")
    return Entry("clocks", "encoder against transducer: clocks, amplifier's delay", rms(band(slope), moving))


def repeatability(noise_rms: Array, explained: Array) -> Entry:
    """What repeats differ by beyond the noise that is already in the budget (`explained`, (c,))."""
    excess = np.sqrt(np.maximum(noise_rms**2 - explained**2, 0.0))
    return Entry("repeatability", "differences of repeats beyond sensor noise", excess)


def filter_edges(signal: Signal, flat: float, drift: float, drifting: Array) -> tuple[Entry, Entry]:
    """Transient of the band's filter at the ends of the record, of what is flat and of what drifts.

    What lay beyond the ends is not known. Relative to its own rms in the band a signal with a flat spectrum (noise,
    bursts) errs by `flat`, one that drifts like a random walk (what gravity, warming up or a cable leave) by `drift`.
    `drifting` (c,) is the part of the signal's power that is the latter, see `drifting_part`.
    """
    power = rms(signal) ** 2
    return (
        Entry("band filter", "ends of the record: flat spectrum", flat * np.sqrt((1.0 - drifting) * power)),
        Entry("band filter", "ends of the record: drift", drift * np.sqrt(drifting * power)),
    )


def drifting_part(signal: Signal, band: Band) -> Array:
    """Part (c,) of the power of a signal in a band that drifts; none where no high-pass remembers what was before.

    White noise and a random walk have known shares of their power in the band's lowest two octaves; a mixture of both
    has what lies between. Invalid samples count as zero; records are taken as they are, without a window.
    """
    if band.high_pass_Hz is None:
        return np.zeros(len(signal.channels))
    below = TWO_OCTAVES * band.high_pass_Hz
    f = np.geomspace(0.1 * band.high_pass_Hz, 0.5 / signal.dt, 4001)[:-1]
    passed = gain(band, f, signal.dt) ** 2
    white, walk = _share_below(below, f, passed * f), _share_below(below, f, passed / f)  # d ln f
    if walk - white < TELLING:
        return np.ones(len(signal.channels))
    known = np.where(signal.valid[:, None], signal.values, 0.0)
    power = np.abs(np.fft.rfft(known, axis=0)) ** 2
    low = np.sum(power[np.fft.rfftfreq(len(known), signal.dt) <= below], axis=0)
    whole = np.sum(power, axis=0)
    part: Array = np.clip((low / np.where(whole > 0.0, whole, 1.0) - white) / (walk - white), 0.0, 1.0)
    return part


def _share_below(limit: float, f: Array, density: Array) -> float:
    return float(np.sum(density[f <= limit]) / np.sum(density))


def resonance(signal: Signal, frequency: float | None, passband: tuple[float, float]) -> Entry:
    """Amplification of the interface wrench by the rocking mode above the band: 1 / (1 - (f2 / f0)^2) - 1.

    Exact at the band's upper edge for one undamped mode, too large below it; it concerns what a rigid interface would
    feel. Where the mode lies within the band the amplification is not an error but the signal: the whole signal.
    """
    if frequency is None:
        return Entry("transducer", "resonance next to the band", np.zeros(len(signal.channels)))
    ratio = (passband[1] / frequency) ** 2
    gain = ratio / (1.0 - ratio) if ratio < 0.5 else 1.0
    return Entry("transducer", "resonance next to the band", gain * rms(signal), grows=True)
