"""Gravity and centre-of-gravity model: fitted over joint angles, subtracted from the decoupled wrench.

    measured(t) = (I + dX) W(q, qd, qdd; theta) + bias + residual

W is the rig's inverse dynamics, theta the free elements of its masses, CoGs, tilt, misalignments, encoder
offsets (and inertias, where asked), dX what the calibration left of the cross-coupling, and every recording has
a taring bias of its own. All are estimated at once with the rig file's sigmas as priors. Each channel of each
recording is weighted by its own residual, inflated for its colour, so that a recording full of disturbances
counts for what it is worth.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from kbs_process.errors import FitError
from kbs_process.estimation.fit import Fit, Parameters, combination, fit_map
from kbs_process.estimation.longrun import variance_inflation
from kbs_process.rig.model import Rig
from kbs_process.signals.records import WRENCH_CHANNELS, WRENCH_UNITS, Array, Signal
from kbs_process.stages.gravity_equation import Equation, Prepared, at_rest, prepare
from kbs_process.stages.gravity_parameters import Index
from kbs_process.stages.motion import Motion

_ROUNDS = 3  # of weights
_STILL = 10.0  # sigma of the angle within which a joint has not moved
_ERROR_POINTS = 1000  # of a recording at which the model's error is evaluated, linear in between
_CHUNK = 65536  # samples a step, which bounds memory


@dataclass(frozen=True, slots=True, eq=False)
class Sample:
    """A recording for the fit: its motion and its decoupled wrench, on one grid."""

    name: str
    motion: Motion
    wrench: Signal
    calibration: bool = False  # pseudo-static: fitted first, and sets the first weights


@dataclass(frozen=True, slots=True)
class GravitySettings:
    """`response` adds a delay and the rig's own resonance, seen from below, to a motion-driven rig."""

    low_pass_Hz: float = 1.0
    cross_coupling: bool = True
    response: bool = False
    delay_sigma: float = 0.02  # s
    resonance_Hz: float = 10.0  # prior sigma of the response's second-order term is that of this resonance


@dataclass(frozen=True, slots=True, eq=False)
class GravityModel:
    """The fitted model. `rig` holds the new values and sigmas; `fit` the joint covariance and the checks."""

    rig: Rig
    fit: Fit
    equation: Equation
    bias: dict[str, Array]  # (c,) of each recording, N and N m
    residual_rms: dict[str, Array]  # (c,) of each recording, low-passed
    encoder_error: dict[str, Array]  # (c,) rms of (dW/dq sigma_q) over each recording

    @property
    def channels(self) -> tuple[str, ...]:
        return self.equation.channels

    def without_coupling(self, residual: Array) -> Array:
        """Undo the fitted rest of the cross-coupling on a residual (n, c): (I + dX)^-1."""
        index = self.equation.index
        dX = self.equation.coupling(self.fit.value[: self.equation.size])[np.ix_(index, index)]
        undone = np.linalg.solve(np.eye(len(index)) + dX, residual.T).T
        return np.ascontiguousarray(undone, dtype=np.float64)


@dataclass(frozen=True, slots=True, eq=False)
class Static:
    """The modelled wrench of a recording and its standard deviation by origin, (n, c) each."""

    wrench: Signal
    sigma_parameters: Array
    sigma_encoder: Array

    @property
    def sigma(self) -> Array:
        total: Array = np.hypot(self.sigma_parameters, self.sigma_encoder)
        return total


@dataclass(frozen=True, slots=True)
class Feasibility:
    """Whether a channel's gravity can be computed well enough: its error next to what is sought."""

    channel: str
    error: float  # rms of the residual and of the encoder's error, N or N m
    limit: float
    ratio: float


def fit(
    samples: Sequence[Sample],
    rig: Rig,
    *,
    include_inertia: bool,
    settings: GravitySettings = GravitySettings(),
) -> GravityModel:
    """Fit the model to all samples, calibrations first.

    With `include_inertia` inertial forces are in the equation, their parameters are free, and `apply` removes them.
    Without it they are taken off the data as the rig's own numbers say, and `apply` removes gravity alone.
    Raises FitError where nothing moves, or where the data say nothing that the priors did not.
    """
    _refuse_no_motion(samples, rig)
    prepared = [
        prepare(s.name, s.motion, s.wrench, settings.low_pass_Hz, with_neighbours=settings.response)
        for s in samples
    ]
    if not include_inertia:
        prepared = [at_rest(p, rig) for p in prepared]
    first = [p for p, s in zip(prepared, samples, strict=True) if s.calibration] or prepared
    equation = Equation.of(
        rig,
        include_inertia=include_inertia,
        cross_coupling=settings.cross_coupling,
        response_sigma=(settings.delay_sigma, (2 * np.pi * settings.resonance_Hz) ** -2.0)
        if settings.response
        else None,
    )
    theta = equation.start()
    sigmas = [_first_sigma(p, rig) for p in first]
    for used in [first] + [prepared] * _ROUNDS:
        if len(sigmas) != len(used):
            sigmas = [_sigma(equation, theta, p, rig) for p in used]
        result = _fit_once(equation, used, sigmas, theta)
        theta = result.value[: equation.size]
        sigmas = [_sigma(equation, theta, p, rig) for p in used]
    _refuse_uninformed(equation, prepared, sigmas, theta)
    biases = result.value[equation.size :].reshape(len(prepared), -1)
    return GravityModel(
        rig=equation.rig_at(theta, result.sigma[: equation.size]),
        fit=result,
        equation=equation,
        bias={p.name: bias for p, bias in zip(prepared, biases, strict=True)},
        residual_rms={
            p.name: np.sqrt(np.mean((p.wrench - equation.predict(theta, p) - bias) ** 2, axis=0))
            for p, bias in zip(prepared, biases, strict=True)
        },
        encoder_error={
            p.name: np.sqrt(np.mean(equation.encoder_error(theta, p) ** 2, axis=0)) for p in prepared
        },
    )


def apply(motion: Motion, model: GravityModel, recording: str | None = None) -> Static:
    """The wrench to be subtracted from a decoupled recording, its taring bias included.

    A recording that was not fitted gets the mean of the fitted biases and, in its sigma, the prior's spread of a
    taring bias. Errors are first order in the parameters' covariance and in `motion.sigma_q`.
    """
    equation, c = model.equation, len(model.channels)
    theta = model.fit.value[: equation.size]
    known = recording in model.bias
    bias = model.bias[recording] if recording in model.bias else np.mean(list(model.bias.values()), axis=0)
    prepared = _from_motion(motion, equation)
    values = np.empty((len(motion), c))
    for start in range(0, len(motion), _CHUNK):
        rows = slice(start, min(start + _CHUNK, len(motion)))
        values[rows] = equation.predict(theta, prepared.rows(rows)) + bias
    count = min(len(motion), _ERROR_POINTS)
    at = np.arange(count, dtype=np.intp) * (len(motion) - 1) // max(count - 1, 1)
    sparse = prepared.rows(at)
    J = equation.jacobian(theta, sparse).reshape(len(at), c, equation.size)
    columns = list(range(equation.size))
    spread = np.zeros(c)
    if known:
        position = equation.size + c * list(model.bias).index(str(recording))
        columns += range(position, position + c)
        J = np.concatenate([J, np.broadcast_to(np.eye(c), (len(at), c, c))], axis=2)
    else:
        spread = equation.bias_sigma
    C = model.fit.covariance[np.ix_(columns, columns)]
    parameters = np.sqrt(np.einsum("nci,ij,ncj->nc", J, C, J) + spread**2)
    encoder = equation.encoder_error(theta, sparse)
    t = np.arange(len(motion))
    inertia = "rigid-body wrench" if equation.include_inertia else "static wrench"
    wrench = Signal(
        t0=motion.t0,
        dt=motion.dt,
        values=values,
        channels=model.channels,
        units=tuple(WRENCH_UNITS[WRENCH_CHANNELS.index(channel)] for channel in model.channels),
        frame="T",
        valid=motion.valid,
        history=(*motion.history, f"{inertia} of the fitted gravity model"),
    )
    return Static(
        wrench,
        np.stack([np.interp(t, at, column) for column in parameters.T], axis=1),
        np.stack([np.interp(t, at, column) for column in encoder.T], axis=1),
    )


def derivatives(motion: Motion, model: GravityModel, at: Index) -> Array:
    """Derivatives (m, c, p) of the modelled wrench by the rig's fitted parameters, at samples `at` (m,)."""
    equation = model.equation
    theta = model.fit.value[: equation.size]
    J = equation.jacobian(theta, _from_motion(motion, equation).rows(at))
    return J.reshape(len(at), len(equation.channels), equation.size)


def angle_slopes(motion: Motion, model: GravityModel, at: Index) -> Array:
    """Derivatives (m, c, joints) of the modelled wrench by the joints' angles, at samples `at` (m,)."""
    equation = model.equation
    return equation.angle_slopes(model.fit.value[: equation.size], _from_motion(motion, equation).rows(at))


def feasibility(model: GravityModel, limits: Mapping[str, float]) -> tuple[Feasibility, ...]:
    """Error of the computed compensation for each channel with a limit: worst recording, residual and encoder."""
    statements = []
    for index, channel in enumerate(model.channels):
        if channel in limits:
            error = max(
                float(np.hypot(model.residual_rms[name][index], model.encoder_error[name][index]))
                for name in model.bias
            )
            statements.append(Feasibility(channel, error, limits[channel], error / limits[channel]))
    return tuple(statements)


def _from_motion(motion: Motion, equation: Equation) -> Prepared:
    """A recording's full grid; rates are zero where only gravity is to be removed."""
    rest = np.zeros_like(motion.q)
    moving = equation.include_inertia
    return Prepared(
        name="",
        dt=motion.dt,
        q=motion.q + motion.offset,
        qd=motion.qd if moving else rest,
        qdd=motion.qdd if moving else rest,
        before=None if equation.response_sigma is None else Prepared.neighbour(motion, -1),
        after=None if equation.response_sigma is None else Prepared.neighbour(motion, 1),
        sigma_q=motion.sigma_q,
        wrench=np.zeros((len(motion), len(equation.channels))),
    )


def _fit_once(equation: Equation, prepared: Sequence[Prepared], sigmas: Sequence[Array], theta: Array) -> Fit:
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


def _first_sigma(p: Prepared, rig: Rig) -> Array:
    """Before there is a residual: a hundredth of the range that the channel shows, the sensor's noise at least.

    Channels that hold nothing but noise would bend all parameters to it otherwise, far from where the equation is
    nearly linear.
    """
    sigma: Array = np.maximum(0.01 * np.ptp(p.wrench, axis=0), 10.0 * _least_sigma(p, rig))
    return sigma


def _sigma(equation: Equation, theta: Array, p: Prepared, rig: Rig) -> Array:
    """Standard deviation (c,) of white noise that would leave the parameters as uncertain as this residual."""
    residual = p.wrench - equation.predict(theta, p)
    residual = residual - residual.mean(axis=0)
    coloured = np.sqrt(np.mean(residual**2, axis=0) * variance_inflation(residual))
    sigma: Array = np.maximum(coloured, _least_sigma(p, rig))
    return sigma


def _least_sigma(p: Prepared, rig: Rig) -> Array:
    index = [WRENCH_CHANNELS.index(channel) for channel in rig.transducer.channels]
    floor: Array = np.maximum(
        0.1 * rig.transducer.noise.value[index], 1e-9 * (1.0 + np.ptp(p.wrench, axis=0))
    )
    return floor


def _refuse_no_motion(samples: Sequence[Sample], rig: Rig) -> None:
    if not samples:
        raise FitError(
            "no recording to fit gravity to",
            remedy="give a recording the role 'calibration' or 'fit' in campaign.toml",
        )
    for sample in samples:
        noise = _STILL * np.maximum(sample.motion.sigma_q.max(axis=0), 1e-6)
        if np.any(np.ptp(sample.motion.q, axis=0) > noise):
            return
    bodies = ", ".join(f"{body.cog.name}, {body.mass.name}" for body in rig.bodies)
    raise FitError(
        f"no joint moves in {', '.join(s.name for s in samples)}: {bodies} and the tilt "
        "cannot be told apart from the transducer's bias",
        remedy="add a recording that turns the joints, such as a pseudo-static calibration",
    )


def _refuse_uninformed(
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
