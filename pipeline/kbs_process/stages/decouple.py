"""Cross-coupling undone: raw = (I + X) w + bias, so w = (I + X)^-1 (raw - bias), over the recorded channels."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from kbs_process.rig.model import Rig
from kbs_process.signals.records import WRENCH_CHANNELS, Array, Envelope, Run, Signal, Spectrum


@dataclass(frozen=True, slots=True, eq=False)
class Decoupling:
    """The calibrated matrix, inverted over the channels that the rig records.

    Components without a channel are taken as zero: what they leak into the others stays there.
    """

    channels: tuple[str, ...]
    matrix: Array  # (c, c) (I + X)^-1
    bias: Array  # (c,) nominal, N and N m
    sigma: Array  # (c, c) of X


def fit(rig: Rig) -> Decoupling:
    """Invert the rig's cross-coupling over its channels."""
    transducer = rig.transducer
    index = [WRENCH_CHANNELS.index(channel) for channel in transducer.channels]
    X = transducer.cross_coupling.value[np.ix_(index, index)]
    matrix = np.linalg.inv(np.eye(len(index)) + X).astype(np.float64)
    return Decoupling(
        channels=transducer.channels,
        matrix=matrix,
        bias=transducer.bias.value[index],
        sigma=transducer.cross_coupling.sigma[np.ix_(index, index)],
    )


def apply(run: Run, model: Decoupling) -> Run:
    """Return the run with wrench, spectrum and envelope decoupled; other streams as they were."""
    wrench = None
    if run.wrench is not None:
        values = (run.wrench.values - model.bias) @ model.matrix.T
        wrench = run.wrench.derive(values, "cross-coupling removed by the calibrated matrix")
    if wrench is None:  # spectrum and envelope are of something else
        return run
    spectrum = None if run.spectrum is None else _spectrum(run.spectrum, model)
    envelope = None if run.envelope is None else _envelope(run.envelope, model)
    return replace(run, wrench=wrench, spectrum=spectrum, envelope=envelope)


def error(wrench: Signal, model: Decoupling) -> Array:
    """Standard deviation (n, c) left by the calibration's own uncertainty: |M| (sigma_X w), elements independent.

    First order in sigma_X. Its constant part is a taring bias and goes with that.
    """
    leaked = wrench.values**2 @ (model.sigma**2).T
    sigma: Array = np.sqrt(leaked @ (model.matrix**2).T)
    return sigma


def _spectrum(spectrum: Spectrum, model: Decoupling) -> Spectrum:
    return replace(spectrum, S=model.matrix @ spectrum.S @ model.matrix.T)


def _envelope(envelope: Envelope, model: Decoupling) -> Envelope:
    """Outer bounds: the extremes of the raw channels are taken as if they fell together."""
    low, high = envelope.low - model.bias, envelope.high - model.bias
    positive, negative = np.maximum(model.matrix, 0.0), np.minimum(model.matrix, 0.0)
    return replace(envelope, low=low @ positive.T + high @ negative.T, high=high @ positive.T + low @ negative.T)
