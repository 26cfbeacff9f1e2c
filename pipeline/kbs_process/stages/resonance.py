"""What the transducer's resonance next to a band's edge does to the torque read in that band.

The unit would load a rigid base with w_r; the transducer reads w = H w_r (see `plant.modal`). In a band the reading
errs by e = band(w - w_r), of which the part below the band's upper edge is amplification of what is there, and the part
above it is the resonance leaking through the low-pass's flank.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import get_window

from kbs_process.plant.linear.modal import ModalModel, ModalTable, respond
from kbs_process.signals.records import Array, Signal
from kbs_process.stages import bandpass
from kbs_process.stages.bandpass import Band

TORQUES = slice(3, 6)


@dataclass(frozen=True, slots=True, eq=False)
class Amplification:
    """|H| of the three torques at one pose and frequency, and how uncertain modes make it."""

    angle: float  # rad
    frequency: float  # Hz
    gain: Array  # (3,)
    sigma: Array  # (3,)


@dataclass(frozen=True, slots=True, eq=False)
class FilterError:
    """A wrench in one band, on a rigid base and on the transducer; every array is (6,), in the signal's units."""

    band: str
    rigid_rms: Array
    rigid_peak: Array
    read_rms: Array
    read_peak: Array
    error_rms: Array  # of transmitted less rigid
    error_rms_sigma: Array
    error_peak: Array
    error_peak_sigma: Array
    leak_rms: Array  # the error's part above the band's upper edge


def amplification(table: ModalTable, angles: Array, frequencies: Sequence[float]) -> Iterator[Amplification]:
    """Yield |H_ii| of Tx, Ty, Tz at each pose and frequency, with the first-order effect of the modes' sigmas."""
    f = np.asarray(frequencies, dtype=float)
    for angle in angles:
        model = table.at(float(angle))
        gain = _gains(model, f)
        changes = [_gains(perturbed, f) - gain for perturbed in perturbations(model)]
        sigma = np.sqrt(np.sum(np.square(changes), axis=0)) if changes else np.zeros_like(gain)
        for index, frequency in enumerate(f):
            yield Amplification(float(angle), float(frequency), gain[index], sigma[index])


def _gains(model: ModalModel, f: Array) -> Array:
    gains: Array = np.abs(np.einsum("nii->ni", model.transfer(f)))[:, TORQUES]
    return gains


def perturbations(model: ModalModel) -> Iterator[ModalModel]:
    """Yield the model with the frequency, then the damping, of one mode after another a sigma higher."""
    for name in ("frequency", "damping"):
        sigma = getattr(model, f"{name}_sigma")
        for mode in np.flatnonzero(sigma > 0.0):
            value = getattr(model, name).copy()
            value[mode] += sigma[mode]
            yield replace(model, **{name: value})


@dataclass(frozen=True, slots=True, eq=False)
class Transmitted:
    """A wrench on a rigid base, what the transducer reads of it, and what it would with one mode a sigma off."""

    rigid: Signal
    read: Signal
    varied: tuple[Signal, ...]

    def moved(self, to: Callable[[Signal], Signal]) -> Transmitted:
        """Return all of it in another frame."""
        return Transmitted(to(self.rigid), to(self.read), tuple(to(signal) for signal in self.varied))


def transmit(load: Signal, angle: Array, table: ModalTable) -> Transmitted:
    """Return what the transducer reads of `load`, six channels on a rigid base; `angle` (n,) rad is the joint's."""

    def through(table: ModalTable) -> Signal:
        values = respond(load.values, load.dt, angle, table)
        return load.derive(values, f"through the transducer's modes: {table.source}")

    return Transmitted(load, through(table), tuple(through(other) for other in _varied(table)))


def filter_errors(found: Transmitted, bands: Sequence[Band]) -> tuple[FilterError, ...]:
    """Return what the transducer's resonance does in each band.

    Sigmas are those of the modes' frequencies and dampings, each taken alone, to first order; the load counts as known.
    """
    return tuple(_error(found.rigid, found.read, found.varied, band) for band in bands)


def _varied(table: ModalTable) -> Iterator[ModalTable]:
    """Yield the table with one property of one mode a sigma higher at all poses."""
    for models in zip(*(list(perturbations(model)) for model in table.models), strict=True):
        yield replace(table, models=tuple(models))


def _error(load: Signal, transmitted: Signal, varied: Sequence[Signal], band: Band) -> FilterError:
    rigid, read = bandpass.apply(load, band), bandpass.apply(transmitted, band)
    valid = rigid.valid & read.valid

    def measures(signal: Signal) -> tuple[Array, Array]:
        error = (bandpass.apply(signal, band).values - rigid.values)[valid]
        return _rms(error), _peak(error)

    rms, peak = measures(transmitted)
    changes = np.array([np.stack(measures(signal)) - np.stack((rms, peak)) for signal in varied])
    sigma = np.sqrt(np.sum(changes**2, axis=0)) if len(changes) else np.zeros((2, 6))
    return FilterError(
        band=band.name,
        rigid_rms=_rms(rigid.values[valid]),
        rigid_peak=_peak(rigid.values[valid]),
        read_rms=_rms(read.values[valid]),
        read_peak=_peak(read.values[valid]),
        error_rms=rms,
        error_rms_sigma=sigma[0],
        error_peak=peak,
        error_peak_sigma=sigma[1],
        leak_rms=_above(read.values - rigid.values, band.low_pass_Hz, load.dt),
    )


def _above(values: Array, edge: float | None, dt: float) -> Array:
    """Rms of what `values` (n, c) hold above `edge` Hz, by their periodogram under a Hann window."""
    if edge is None:
        return np.zeros(values.shape[1])
    window = get_window("hann", len(values))[:, None]
    power = np.abs(np.fft.rfft(values * window, axis=0)) ** 2
    f = np.fft.rfftfreq(len(values), dt)
    rms: Array = np.sqrt(2.0 * power[f > edge].sum(axis=0) / (len(values) * float(np.sum(window**2))))
    return rms


def _rms(values: Array) -> Array:
    rms: Array = np.sqrt(np.mean(values**2, axis=0))
    return rms


def _peak(values: Array) -> Array:
    peak: Array = np.max(np.abs(values), axis=0)
    return peak
