"""How good the gravity model is: against what is sought, and against each recording."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from kbs_process.signals.records import Array
from kbs_process.stages.gravity.model import GravityModel, Sample, error_of, prepared
from kbs_process.stages.gravity.taring import Taring

_FACTOR = 3.0  # what one sound recording leaves differs from another's by half, through drift and disturbances


@dataclass(frozen=True, slots=True)
class Feasibility:
    """Whether a channel's gravity can be computed well enough: its error next to what is sought."""

    channel: str
    error: float  # rms of the residual and of the encoder's error, N or N m
    limit: float
    ratio: float


def feasibility(model: GravityModel, limits: Mapping[str, float]) -> tuple[Feasibility, ...]:
    """Error of the computed compensation for each channel with a limit: worst recording, residual and encoder."""
    statements = []
    for index, channel in enumerate(model.channels):
        if channel in limits:
            error = max(
                float(np.hypot(model.residual_rms[name][index], model.encoder_error[name][index]))
                for name in model.taring
            )
            statements.append(Feasibility(channel, error, limits[channel], error / limits[channel]))
    return tuple(statements)


@dataclass(frozen=True, slots=True)
class Misfit:
    """A channel of a recording below the fit's low-pass: what the model leaves next to what may be left, rms."""

    channel: str
    unit: str
    left: float  # N or N m
    explained: float  # by the model's and the angles' uncertainty, and by what pseudo-static recordings have left

    @property
    def ratio(self) -> float:
        return self.left / self.explained

    @property
    def ok(self) -> bool:
        """Is the channel described as well as can be expected?"""
        return self.ratio < _FACTOR


def misfits(sample: Sample, model: GravityModel, taring: Taring, others: Array | float = 0.0) -> tuple[Misfit, ...]:
    """Compare what the model leaves of a recording with what its uncertainty lets it leave, channel by channel.

    `others` (c,) is the rms of what else the recording may err by.
    """
    equation = model.equation
    theta = model.fit.value[: equation.size]
    data = prepared(sample, equation, model.settings, model.settings.low_pass_Hz, theta)
    residual = data.wrench - equation.predict(theta, data) - taring.bias
    error = np.hypot(error_of(model, data, taring), equation.encoder_error(theta, data))
    left = np.sqrt(np.mean(residual**2, axis=0))
    explained = np.sqrt(np.mean(error**2, axis=0) + model.unexplained**2 + np.square(others))
    return tuple(
        Misfit(channel, unit, float(rms), float(allowed))
        for channel, unit, rms, allowed in zip(model.channels, model.units, left, explained, strict=True)
    )
