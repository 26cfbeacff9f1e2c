"""Gravity and centre-of-gravity model: fitted over joint angles, subtracted from the decoupled wrench.

    measured(t) = (I + dX) W(q, qd, qdd; theta) + bias + residual

W is the rig's inverse dynamics, theta the free elements of its masses, CoGs, tilt, misalignments, encoder
offsets (and inertias, where asked), dX what the calibration left of the cross-coupling, and every recording has
a taring bias of its own. All are estimated at once with the rig file's sigmas as priors. Each channel of each
recording is weighted by its own residual, inflated for its colour, so that a recording full of disturbances
counts for what it is worth.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from kbs_process.errors import FitError
from kbs_process.estimation.fit import Fit
from kbs_process.rig.model import Rig
from kbs_process.signals.records import Array, Signal
from kbs_process.signals.smoothing import smooth
from kbs_process.stages.bandpass import Band, bridged
from kbs_process.stages.gravity.equation import Equation, Prepared, at_rest, blocks, prepare
from kbs_process.stages.gravity.parameters import Index
from kbs_process.stages.gravity.solve import Rows, first_sigma, least_sigma, refuse_uninformed, residual_sigma, solve
from kbs_process.stages.gravity.taring import Taring, estimate, of_fit
from kbs_process.stages.motion import Motion

_ROUNDS = 3  # of weights
_SLOWER = 0.5  # part of the fit's low-pass below which gravity's loads are, and a line across a gap tells of them
STILL = 10.0  # sigma of the angle within which a joint has not moved
_ERROR_POINTS = 1000  # of a recording at which the model's error is evaluated, linear in between


@dataclass(frozen=True, slots=True, eq=False)
class Sample:
    """A recording for the fit: its motion and its loads, the wrench decoupled, on one grid."""

    name: str
    motion: Motion
    wrench: Signal
    calibration: bool = False  # pseudo-static: fitted first, and sets the first weights
    lost: str = ""  # what most of it was lost by
    gaps: Array = field(default_factory=lambda: np.zeros((0, 2)))  # s, from when to when samples are made up
    reach: float = 0.0  # s beside these in which filters lean on them


@dataclass(frozen=True, slots=True)
class GravitySettings:
    """`response` adds a delay and the rig's own resonance, seen from below, to a motion-driven rig.

    Recordings that are not fitted are tared below `taring_Hz`: a load that comes and goes, such as pushes of a hand,
    has to do so within that band to be told from a bias.
    """

    low_pass_Hz: float = 1.0
    taring_Hz: float = 2.0
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
    settings: GravitySettings
    taring: dict[str, Taring]  # of each fitted recording
    reference: tuple[str, ...]  # recordings fitted first: the calibrations, or all where there is none
    residual_rms: dict[str, Array]  # (c,) of each recording, low-passed
    taring_spread: Array  # (c,) rms of what the model leaves of them below `taring_Hz`, N and N m
    encoder_error: dict[str, Array]  # (c,) rms of (dW/dq sigma_q) over each recording

    @property
    def channels(self) -> tuple[str, ...]:
        return self.equation.channels

    @property
    def units(self) -> tuple[str, ...]:
        return self.equation.units

    @property
    def unexplained(self) -> Array:
        """What the model leaves (c,) of the recordings fitted first, below the fit's low-pass, rms, N and N m."""
        mean: Array = np.sqrt(np.mean([self.residual_rms[name] ** 2 for name in self.reference], axis=0))
        return mean

    def without_coupling(self, residual: Array) -> Array:
        """Undo the fitted rest of the cross-coupling on a residual (n, c): (I + dX)^-1."""
        index = self.equation.index
        dX = self.equation.whole_coupling(self.fit.value[: self.equation.size])[np.ix_(index, index)]
        undone = np.linalg.solve(np.eye(len(index)) + dX, residual.T).T
        return np.ascontiguousarray(undone, dtype=np.float64)


@dataclass(frozen=True, slots=True, eq=False)
class Static:
    """The modelled wrench of a recording and its standard deviation by origin, (n, c) each."""

    wrench: Signal
    sigma_parameters: Array
    sigma_encoder: Array
    taring: Taring

    @property
    def sigma(self) -> Array:
        total: Array = np.hypot(self.sigma_parameters, self.sigma_encoder)
        return total


def fit(
    samples: Sequence[Sample], rig: Rig, *, include_inertia: bool, settings: GravitySettings = GravitySettings()
) -> GravityModel:
    """Fit the model to all samples, calibrations first.

    With `include_inertia` inertial forces are in the equation, their parameters are free, and `apply` removes them.
    Without it they are taken off the data as the rig's own numbers say, and `apply` removes gravity alone.
    Raises FitError where nothing moves, or where the data say nothing that the priors did not.
    """
    _refuse_no_motion(samples, rig)
    equation = Equation.of(
        rig,
        include_inertia=include_inertia,
        cross_coupling=settings.cross_coupling,
        response_sigma=(settings.delay_sigma, (2 * np.pi * settings.resonance_Hz) ** -2.0)
        if settings.response
        else None,
    )
    theta = equation.start()
    data = [prepared(sample, equation, settings, settings.low_pass_Hz, theta) for sample in samples]
    rows = Rows(equation, data)
    refuse_uninformed(rows)
    first = [p for p, s in zip(data, samples, strict=True) if s.calibration] or data
    theta = solve(Rows(equation, first), [first_sigma(p, rig) for p in first], theta).theta
    for _ in range(_ROUNDS):
        if include_inertia:  # else instants at rest, which no parameter changes
            data = [prepared(sample, equation, settings, settings.low_pass_Hz, theta) for sample in samples]
            rows = Rows(equation, data)
        solution = solve(rows, [residual_sigma(equation, theta, p, rig) for p in data], theta)
        theta = solution.theta
    result, biases = solution.stated(settings.low_pass_Hz), solution.zeros[:, 0]
    each = zip(data, biases, rows.mean_slopes(theta), solution.sigmas, strict=True)
    taring = {p.name: of_fit(equation, slope, p, bias, sigma) for p, bias, slope, sigma in each}
    return GravityModel(
        rig=equation.rig_at(theta, result.sigma[: equation.size]),
        fit=result,
        equation=equation,
        settings=settings,
        taring=taring,
        reference=tuple(p.name for p in first),
        residual_rms={
            p.name: np.sqrt(np.mean((p.wrench - equation.predict(theta, p) - bias) ** 2, axis=0))
            for p, bias in zip(data, biases, strict=True)
        },
        taring_spread=_spread(samples, equation, settings, theta, list(biases)),
        encoder_error={p.name: np.sqrt(np.mean(equation.encoder_error(theta, p) ** 2, axis=0)) for p in data},
    )


def _spread(
    samples: Sequence[Sample], equation: Equation, settings: GravitySettings, theta: Array, biases: Sequence[Array]
) -> Array:
    """Rms (c,) of what the model leaves of all samples below `taring_Hz`, each weighing the same."""
    powers = []
    for sample, bias in zip(samples, biases, strict=True):
        p = prepared(sample, equation, settings, settings.taring_Hz, theta)
        powers.append(np.mean((p.wrench - equation.predict(theta, p) - bias) ** 2, axis=0))
    spread: Array = np.sqrt(np.mean(powers, axis=0))
    return spread


def prepared(
    sample: Sample, equation: Equation, settings: GravitySettings, low_pass_Hz: float, theta: Array
) -> Prepared:
    """The instants of a recording that the equation is compared with; see `at_rest` for a model without inertia.

    A low-passed wrench is not that of the low-passed motion, where products of angles and rates lie beyond the corner.
    By how much they differ is computed with the rig's parameters `theta`, and taken off. Gaps that are short below
    `low_pass_Hz` are no gaps.
    """
    read = replace(sample.wrench, valid=sample.wrench.valid & sample.motion.valid)
    known = bridged(read, sample.gaps, Band("", None, _SLOWER * low_pass_Hz), sample.reach)
    parts = sample.name, sample.motion, known, low_pass_Hz
    data = prepare(*parts, with_neighbours=settings.response, lost=sample.lost)
    if not equation.include_inertia:
        return at_rest(data, equation.elements.rig)
    whole = np.concatenate([equation.predict(theta, part) for part in blocks(_from_motion(sample.motion, equation))])
    at = np.rint(data.t / data.dt).astype(np.intp)
    products = smooth(whole, data.dt, low_pass_Hz)[at] - equation.predict(theta, data)
    return replace(data, wrench=data.wrench - products)


def tare(sample: Sample, model: GravityModel) -> Taring:
    """The recording's constant: the fit's own where it was fitted, else estimated with the model held."""
    if sample.name in model.taring:
        return model.taring[sample.name]
    equation = model.equation
    theta = model.fit.value[: equation.size]
    data = prepared(sample, equation, model.settings, model.settings.taring_Hz, theta)
    spread = np.maximum(model.taring_spread, least_sigma(data, model.rig))
    return estimate(equation, theta, data, spread)


def apply(motion: Motion, model: GravityModel, taring: Taring | None = None) -> Static:
    """The wrench to be subtracted from a decoupled recording, its taring included where given.

    Errors are first order in the parameters' covariance, with the taring's share in it, and in `motion.sigma_q`.
    """
    equation, c = model.equation, len(model.channels)
    theta = model.fit.value[: equation.size]
    taring = taring or Taring.none(c, equation.size)
    whole = _from_motion(motion, equation)
    values = np.concatenate([equation.predict(theta, part) + taring.bias for part in blocks(whole)])
    count = min(len(motion), _ERROR_POINTS)
    at = np.arange(count, dtype=np.intp) * (len(motion) - 1) // max(count - 1, 1)
    sparse = whole.rows(at)
    parameters = error_of(model, sparse, taring)
    encoder = equation.encoder_error(theta, sparse)
    t = np.arange(len(motion))
    kind = "rigid-body wrench" if equation.include_inertia else "static wrench"
    wrench = Signal(
        t0=motion.t0,
        dt=motion.dt,
        values=values,
        channels=model.channels,
        units=model.units,
        frame=model.rig.frame,
        valid=motion.valid,
        history=(*motion.history, f"{kind} of the fitted gravity model"),
    )
    return Static(
        wrench,
        np.stack([np.interp(t, at, column) for column in parameters.T], axis=1),
        np.stack([np.interp(t, at, column) for column in encoder.T], axis=1),
        taring,
    )


def error_of(model: GravityModel, data: Prepared, taring: Taring) -> Array:
    """Standard deviation (n, c) of the modelled wrench, the recording's constant included, at its instants."""
    equation = model.equation
    theta = model.fit.value[: equation.size]
    J = equation.jacobian(theta, data).reshape(len(data.q), len(equation.channels), equation.size)
    J = J + taring.slope
    C = model.fit.covariance[: equation.size, : equation.size]
    error: Array = np.sqrt(np.maximum(np.einsum("nci,ij,ncj->nc", J, C, J), 0.0) + taring.noise**2)
    return error


def taring_error(model: GravityModel, taring: Taring) -> Array:
    """Standard deviation (c,) of a recording's constant, N and N m."""
    size = model.equation.size
    variance = np.einsum("ci,ij,cj->c", taring.slope, model.fit.covariance[:size, :size], taring.slope)
    error: Array = np.sqrt(np.maximum(variance, 0.0) + taring.noise**2)
    return error


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


def _from_motion(motion: Motion, equation: Equation) -> Prepared:
    """A recording's full grid; rates are zero where only gravity is to be removed."""
    rest = np.zeros_like(motion.q)
    moving = equation.include_inertia
    return Prepared(
        name="",
        dt=motion.dt,
        t=motion.dt * np.arange(len(motion), dtype=np.float64),
        q=motion.q + motion.offset,
        qd=motion.qd if moving else rest,
        qdd=motion.qdd if moving else rest,
        before=None if equation.response_sigma is None else Prepared.neighbour(motion, -1),
        after=None if equation.response_sigma is None else Prepared.neighbour(motion, 1),
        sigma_q=motion.sigma_q,
        rounding=motion.sigma_rounding,
        wrench=np.zeros((len(motion), len(equation.channels))),
    )


def _refuse_no_motion(samples: Sequence[Sample], rig: Rig) -> None:
    if not samples:
        raise FitError(
            "no recording to fit gravity to", remedy="give a recording the role 'calibration' or 'fit' in campaign.toml"
        )
    for sample in samples:
        noise = STILL * np.maximum(sample.motion.sigma_q.max(axis=0), 1e-6)
        if np.any(np.ptp(sample.motion.q, axis=0) > noise):
            return
    bodies = ", ".join(f"{body.cog.name}, {body.mass.name}" for body in rig.bodies)
    raise FitError(
        f"no joint moves in {', '.join(s.name for s in samples)}: {bodies} and the tilt "
        "cannot be told apart from the zeros of the readings",
        remedy="add a recording that turns the joints, such as a pseudo-static calibration",
    )
