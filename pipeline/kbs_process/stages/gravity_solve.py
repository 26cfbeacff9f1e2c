"""The gravity equation solved for the rig and every recording's taring bias at once, with the weights it takes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kbs_process.errors import FitError
from kbs_process.estimation.fit import Fit, Parameters, combination, fit_map
from kbs_process.estimation.longrun import variance_inflation
from kbs_process.rig.model import Rig
from kbs_process.signals.records import WRENCH_CHANNELS, Array
from kbs_process.stages.gravity_equation import Equation, Prepared


def solve(equation: Equation, prepared: Sequence[Prepared], sigmas: Sequence[Array], theta: Array) -> Fit:
    c, k = len(equation.channels), len(prepared)

    def residual(full: Array) -> Array:
        biases = full[equation.size :].reshape(k, c)
        parts = [
            (equation.predict(full[: equation.size], p) + bias - p.wrench) / sigma
            for p, bias, sigma in zip(prepared, biases, sigmas, strict=True)
        ]
        return np.concatenate([part.ravel() for part in parts])

    def jacobian(full: Array) -> Array:
        blocks = []
        for index, (p, sigma) in enumerate(zip(prepared, sigmas, strict=True)):
            block = np.zeros((len(p.q), c, len(full)))
            block[:, :, : equation.size] = equation.jacobian(full[: equation.size], p).reshape(
                len(p.q), c, -1
            )
            at = equation.size + c * index
            block[:, :, at : at + c] = np.eye(c)
            blocks.append((block / sigma[:, None]).reshape(len(p.q) * c, -1))
        return np.concatenate(blocks)

    bias_names = tuple(f"bias[{p.name}].{channel}" for p in prepared for channel in equation.channels)
    prior = equation.start()
    zero = np.zeros(k * c)
    parameters = Parameters(
        names=equation.names + bias_names,
        value=np.concatenate([prior, zero]),
        sigma=np.concatenate([equation.sigma(), np.tile(equation.bias_sigma, k)]),
        lower=np.concatenate([equation.lower(), np.full(k * c, -np.inf)]),
    )
    first_bias = [np.mean(p.wrench - equation.predict(theta, p), axis=0) for p in prepared]
    return fit_map(
        residual,
        parameters,
        jacobian=jacobian,
        series=[(len(p.q), c) for p in prepared],
        start=np.concatenate([theta, *first_bias]),
    )


def first_sigma(p: Prepared, rig: Rig) -> Array:
    """Before there is a residual: a hundredth of the range that the channel shows, the sensor's noise at least.

    Channels that hold nothing but noise would bend all parameters to it otherwise, far from where the equation is
    nearly linear.
    """
    sigma: Array = np.maximum(0.01 * np.ptp(p.wrench, axis=0), 10.0 * least_sigma(p, rig))
    return sigma


def residual_sigma(equation: Equation, theta: Array, p: Prepared, rig: Rig) -> Array:
    """Standard deviation (c,) of white noise that would leave the parameters as uncertain as this residual."""
    residual = p.wrench - equation.predict(theta, p)
    residual = residual - residual.mean(axis=0)
    coloured = np.sqrt(np.mean(residual**2, axis=0) * variance_inflation(residual))
    sigma: Array = np.maximum(coloured, least_sigma(p, rig))
    return sigma


def least_sigma(p: Prepared, rig: Rig) -> Array:
    index = [WRENCH_CHANNELS.index(channel) for channel in rig.transducer.channels]
    floor: Array = np.maximum(
        0.1 * rig.transducer.noise.value[index], 1e-9 * (1.0 + np.ptp(p.wrench, axis=0))
    )
    return floor


def refuse_uninformed(
    equation: Equation, prepared: Sequence[Prepared], sigmas: Sequence[Array], theta: Array
) -> None:
    """Refuse data whose strongest message about the rig, bias aside, is weaker than the prior."""
    blocks = []
    for p, sigma in zip(prepared, sigmas, strict=True):
        J = equation.jacobian(theta, p).reshape(len(p.q), len(equation.channels), -1)
        blocks.append(((J - J.mean(axis=0)) / sigma[:, None]).reshape(-1, equation.size))
    _, s, Vt = np.linalg.svd(np.concatenate(blocks) * equation.sigma(), full_matrices=False)
    if s[0] < 1.0:
        direction = combination(Vt[0], equation.names)
        raise FitError(
            "the recordings say less about the rig than its parameter files do; the best that they hold, "
            f"{direction} (in prior sigmas), cannot be told apart from the transducer's bias",
            remedy="add a recording that turns the joints further",
        )
