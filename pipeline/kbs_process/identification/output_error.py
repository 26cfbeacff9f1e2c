"""Output error of the non-linear plant: what recordings hold less what the plant says, whitened, for any parameters.

    e_r(theta) = measured_r - (I + X) wrench_r(theta_r) - nuisances,   r a recording

The plant follows what was recorded of the drive (field positions, else encoders through the controller). Wrench and
joint angles are compared in bands, in units of their noise. Not simulated but projected out, for each channel
of each recording: a cubic in time (taring bias and drift), the row of cross-coupling within its sigma, and the delay
of the clock within its sigma. Gravity is not removed beforehand: it is in the plant, and masses, CoGs and tilt are
parameters like all others, with the priors of the parameter files.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from kbs_process.estimation.whittle import StepSpectrum, Whitener, estimated, flat, project, whitener
from kbs_process.plant.predict import Schedule, predict
from kbs_process.rig.model import Rig, substitute
from kbs_process.signals.records import WRENCH_CHANNELS, Array, Mask

_DRIFT_ORDER = 3
_PASS = 0.4  # of a stream's rate: what its resampling leaves whole


@dataclass(frozen=True, slots=True)
class Scalar:
    """One number of the rig: a quantity, or one element of it."""

    quantity: str  # dotted name
    element: tuple[int, ...] = ()

    @property
    def name(self) -> str:
        return self.quantity + "".join(f"[{index}]" for index in self.element)


def values_of(rig: Rig, free: Sequence[Scalar]) -> Array:
    """(p,) some numbers of a rig as they are."""
    quantities = rig.quantities()
    return np.array([float(quantities[one.quantity].value[one.element]) for one in free])


def rig_at(rig: Rig, free: Sequence[Scalar], values: Array) -> Rig:
    """The rig with some numbers set to `values` (p,)."""
    quantities = rig.quantities()
    new: dict[str, Array | float] = {}
    for scalar, value in zip(free, values, strict=True):
        whole = np.array(new.get(scalar.quantity, quantities[scalar.quantity].value))
        whole[scalar.element] = value
        new[scalar.quantity] = whole
    return substitute(rig, new)


@dataclass(frozen=True, slots=True, eq=False)
class Measured:
    """A recording for the fit, on one grid that begins at its time zero."""

    name: str
    dt: float  # s
    wrench: Array  # (n, c) raw
    angle: Array  # (n, joints) rad, encoder readings
    valid: Mask  # (n,)
    schedule: Schedule
    wrench_rate: float  # Hz, as recorded
    angle_rate: float  # Hz
    clock_sigma: float  # s, of the wrench's clock against the drive's
    angle_clock_sigma: float  # s


Spectra = tuple[StepSpectrum, ...]  # of one recording's channels: wrench, then joint angles


@dataclass(frozen=True, slots=True, eq=False)
class Experiment:
    """Recordings, the plant that is to explain them, and its numbers that are free."""

    rig: Rig
    effects: tuple[str, ...]
    free: tuple[Scalar, ...]
    recordings: tuple[Measured, ...]
    lowest_Hz: float
    step_s: float | None = None  # bound on the plant's step; None is the plant's own

    @property
    def channels(self) -> tuple[str, ...]:
        return (*self.rig.transducer.channels, *self.rig.joint_names)

    @property
    def nominal(self) -> Array:
        """(p,) free numbers as in the parameter files."""
        return values_of(self.rig, self.free)

    def rig_at(self, values: Array) -> Rig:
        """The rig with the free numbers set to `values` (p,)."""
        return rig_at(self.rig, self.free, values)

    def bands(self, recording: Measured) -> tuple[tuple[float, float], ...]:
        """Hz, of each channel."""
        highest = [_PASS * min(rate, 1.0 / recording.dt) for rate in (recording.wrench_rate, recording.angle_rate)]
        wrench = (self.lowest_Hz, highest[0])
        angle = (self.lowest_Hz, highest[1])
        return (wrench,) * len(self.rig.transducer.channels) + (angle,) * len(self.rig.joints)


def sensor_spectra(experiment: Experiment, recording: Measured) -> Spectra:
    """White noise of the stated level and the rounding of codes: what is known before any fit."""
    transducer = experiment.rig.transducer
    index = [WRENCH_CHANNELS.index(channel) for channel in transducer.channels]
    wrench = transducer.noise.value[index] ** 2 + transducer.resolution.value[index] ** 2 / 12.0
    angle = [float(joint.encoder.step) ** 2 / 12.0 if joint.encoder else 0.0 for joint in experiment.rig.joints]
    noise = [*(wrench * 2.0 / recording.wrench_rate), *(np.array(angle) * 2.0 / recording.angle_rate)]
    return tuple(flat(max(level, 1e-30)) for level in noise)


@dataclass(frozen=True, slots=True, eq=False)
class Output:
    """What the plant says of a recording, on its grid, as the transducer and the encoders would read it."""

    wrench: Array  # (n, 6), in all six channels, without cross-coupling
    angle: Array  # (n, joints)


def simulate(experiment: Experiment, recording: Measured, values: Array) -> Output:
    """Run the plant over a recording with the free numbers at `values`."""
    rate = 1.0 / recording.dt
    n = len(recording.valid)
    streams: dict[str, list[Array]] = {"wrench": [], "angle": [], "field": []}
    for key, block in predict(
        experiment.rig_at(values),
        experiment.effects,
        recording.schedule,
        rate_Hz=rate,
        angle_rate_Hz=rate,
        duration_s=n * recording.dt,
        step_s=experiment.step_s,
        quantise=False,
    ):
        streams[key].append(block.values)
    return Output(np.concatenate(streams["wrench"])[:n], np.concatenate(streams["angle"])[:n])


def difference(experiment: Experiment, recording: Measured, output: Output) -> Array:
    """Measured less modelled, (n, channels), nuisances still in."""
    coupled = output.wrench @ (np.eye(6) + experiment.rig.transducer.cross_coupling.value).T
    index = [WRENCH_CHANNELS.index(channel) for channel in experiment.rig.transducer.channels]
    return np.hstack([recording.wrench - coupled[:, index], recording.angle - output.angle])


def residual(experiment: Experiment, recording: Measured, values: Array, spectra: Spectra) -> Array:
    """Whitened output error of all channels, nuisances projected out: white with unit variance if all is right."""
    output = simulate(experiment, recording, values)
    left = difference(experiment, recording, output)
    parts = [
        project(whiten(left[:, channel]), whiten(columns), priors)
        for channel, (whiten, (columns, priors)) in enumerate(
            zip(_whiteners(experiment, recording, spectra), _nuisances(experiment, recording, output), strict=True)
        )
    ]
    return np.concatenate(parts)


def unexplained(experiment: Experiment, recording: Measured, values: Array, spectra: Spectra) -> Array:
    """Measured less modelled with the nuisances' best fit taken off, (n, channels)."""
    output = simulate(experiment, recording, values)
    left = difference(experiment, recording, output)
    for channel, (whiten, (columns, priors)) in enumerate(
        zip(_whiteners(experiment, recording, spectra), _nuisances(experiment, recording, output), strict=True)
    ):
        N, z = whiten(columns), whiten(left[:, channel])
        scale = 1.0 / np.sqrt(np.sum(N**2, axis=0) + priors**2 + 1e-300)
        v = np.linalg.lstsq(np.vstack([N, np.diag(priors)]) * scale, np.concatenate([z, 0.0 * priors]))[0]
        left[:, channel] -= columns @ (v * scale)
    return left * recording.valid[:, None]


def estimated_spectra(experiment: Experiment, recording: Measured, left: Array) -> Spectra:
    """Noise spectra out of what no parameter explains, (n, channels).

    An encoder's is no less than that of its rounding: a joint at rest shows one code, which is no lack of noise.
    """
    found = tuple(
        estimated(column, recording.valid, recording.dt, band)
        for column, band in zip(left.T, experiment.bands(recording), strict=True)
    )
    wrench = len(experiment.rig.transducer.channels)
    rounding = sensor_spectra(experiment, recording)[wrench:]
    angles = (
        replace(angle, density=np.maximum(angle.density, least.density[0]))
        for angle, least in zip(found[wrench:], rounding, strict=True)
    )
    return (*found[:wrench], *angles)


def _whiteners(experiment: Experiment, recording: Measured, spectra: Spectra) -> list[Whitener]:
    return [
        whitener(recording.valid, recording.dt, band, spectrum)
        for band, spectrum in zip(experiment.bands(recording), spectra, strict=True)
    ]


def _nuisances(experiment: Experiment, recording: Measured, output: Output) -> Sequence[tuple[Array, Array]]:
    """For each channel the columns (n, m), and one over their amplitudes' standard deviations (m,)."""
    transducer = experiment.rig.transducer
    time = np.linspace(-1.0, 1.0, len(recording.valid))
    drift = np.polynomial.legendre.legvander(time, _DRIFT_ORDER)
    free = np.zeros(_DRIFT_ORDER + 1)
    found = []
    for channel in transducer.channels:
        row = WRENCH_CHANNELS.index(channel)
        coupling = output.wrench * transducer.cross_coupling.sigma[row]
        late = np.gradient(output.wrench[:, row], recording.dt) * recording.clock_sigma
        found.append((np.column_stack([drift, coupling, late]), np.concatenate([free, np.ones(7)])))
    for joint in range(len(experiment.rig.joints)):
        late = np.gradient(output.angle[:, joint], recording.dt) * recording.angle_clock_sigma
        found.append((np.column_stack([drift[:, :1], late]), np.array([0.0, 1.0])))
    return found
