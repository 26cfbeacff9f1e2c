"""A suspect in the non-linear plant, refitted together with all known parameters.

The known parameters keep the slopes that they were fitted with; the suspect's own are differences of the plant with the
suspect in it, taken anew at each step. What acts on the readings alone, or is a measured law, has a column of the
prediction for each of its numbers instead. A few Gauss-Newton steps, halved where they do not lower the cost.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from kbs_process.diagnosis.experiment import Experiment
from kbs_process.diagnosis.hypothesis import Hypothesis, Prediction, Simulate
from kbs_process.diagnosis.known import Known
from kbs_process.diagnosis.parameters import Slopes, slopes
from kbs_process.estimation.bounded import bounded_minimum
from kbs_process.estimation.fit import Parameters
from kbs_process.signals.records import Array
from kbs_process.stages.output_error import Scalar

_STEPS = 12
_DIFFERENCE = 0.1  # of a suspect's number, by which the plant's slope is taken
_GAIN = 1.0  # of -2 log likelihood: a step that promises less ends the search
_TRIES, _LESS = 3, 0.2
_FARTHEST = 30.0  # times, up or down, that a shape goes from where the grid had it
_RIDGE = 1e-10  # of unit columns: numbers that nothing shows would leave the equations singular
_SHORTER = (1.0, 0.5, 0.2, 0.05)


@dataclass(frozen=True, slots=True, eq=False)
class Extra:
    """Numbers of one suspect: those of the rig, and those that multiply columns of the prediction."""

    hypothesis: Hypothesis  # with the suspect's effect in its plant, if it has one
    plant: tuple[Scalar, ...]  # numbers of its rig
    start: Array  # (plant + linear,)
    prior: Array  # (plant + linear,) means, and
    sigma: Array  # their standard deviations; inf where nothing is known
    scale: Array  # (plant,) sizes of steps for slopes
    linear: tuple[Scalar, ...] = ()
    columns: Mapping[int, Array] | None = None  # by reference drive, (linear, n, c)


@dataclass(frozen=True, slots=True, eq=False)
class Standing:
    """What is believed at a time: the known parameters with those of all accepted laws, and what they predict."""

    known: Known
    predicted: Mapping[int, Prediction]  # by drive, of all drives, the plant's
    laws: Mapping[str, Mapping[int, Array]]  # columns (n, c) by reference drive, of numbers that are no rig's

    @property
    def hypothesis(self) -> Hypothesis:
        return self.known.hypothesis

    def shown(self, trial: int) -> Array:
        """(n, c) prediction of a trial with all laws in it."""
        known = self.known
        plant = self.predicted[known.experiment.trials[trial].drive].values
        return plant + _linear(known.experiment, self.laws, known.free, known.value, trial)


def with_extra(standing: Standing, extra: Extra, simulate: Simulate, steps: int = _STEPS) -> Standing:
    """Refit all numbers of `standing` with a suspect's beside them."""
    known, experiment = standing.known, standing.known.experiment
    laws = dict(standing.laws)
    for index, scalar in enumerate(extra.linear):
        laws[scalar.name] = {drive: columns[index] for drive, columns in (extra.columns or {}).items()}
    parameters = _extended(known.parameters, extra)
    assert parameters.lower is not None and parameters.upper is not None
    state = _State(
        known=known,
        hypothesis=extra.hypothesis,
        free=(*known.free, *extra.plant, *extra.linear),
        laws=laws,
        precision=np.where(np.isfinite(parameters.sigma), parameters.sigma, np.inf) ** -2.0,
        prior=parameters.value,
        lower=parameters.lower,
        upper=parameters.upper,
    )
    everything = sorted({trial.drive for trial in experiment.trials})
    values = np.concatenate([known.value, extra.start])
    gradients = _gradients(state, extra, values, simulate)
    predicted = _predicted(state, values, everything, simulate)
    cost = state.cost(values, predicted)
    for _ in range(_TRIES):
        if np.isfinite(cost):
            break
        # Too strong for the plant to run: the search then begins with less of it.
        values = np.concatenate(
            [known.value, extra.prior + _LESS * (values[len(known.value) :] - extra.prior)]
        )
        gradients = _gradients(state, extra, values, simulate)
        predicted = _predicted(state, values, everything, simulate)
        cost = state.cost(values, predicted)
    for _ in range(steps):
        if not np.isfinite(cost):
            break
        H, g = state.normal(values, predicted, gradients)
        size = 1.0 / np.sqrt(np.maximum(np.diag(H), 1e-300))
        scaled = H * np.outer(size, size) + _RIDGE * np.eye(len(size))
        low, high = (
            np.where(np.isfinite(end), (end - values) / size, end) for end in (state.lower, state.upper)
        )
        du = size * bounded_minimum(scaled, size * g, np.minimum(low, 0.0), np.maximum(high, 0.0))
        if float(g @ du) < _GAIN:
            break
        moved = _shortened(state, values, du, predicted, cost, everything, simulate)
        if moved is None:
            break
        gained = cost - moved[2]
        state = _updated(state, moved[0] - values, predicted, moved[1], gradients, size)
        values, predicted, cost = moved
        gradients = _gradients(state, extra, values, simulate)
        if gained < _GAIN:
            break
    H, _ = state.normal(values, predicted, gradients)
    size = 1.0 / np.sqrt(np.maximum(np.diag(H), 1e-300))
    covariance = np.full_like(H, np.inf)
    if np.isfinite(H).all():
        covariance = np.linalg.pinv(H * np.outer(size, size), rcond=1e-13, hermitian=True) * np.outer(
            size, size
        )
    found = replace(
        known,
        hypothesis=state.at(values),
        free=state.free,
        parameters=parameters,
        value=values,
        covariance=covariance,
        slopes=gradients,
        residual=tuple(state.residual(k, values, predicted) for k in range(len(experiment.trials))),
    )
    return Standing(found, predicted, laws)


def cost_of(known: Known) -> float:
    """-2 log posterior over the fit trials, less a constant."""
    return float(sum(known.residual[k] @ known.residual[k] for k in known.experiment.fit)) + known.prior_chi2


@dataclass(frozen=True, slots=True, eq=False)
class _State:
    known: Known
    hypothesis: Hypothesis
    free: tuple[Scalar, ...]
    laws: Mapping[str, Mapping[int, Array]]
    precision: Array
    prior: Array
    lower: Array
    upper: Array

    def at(self, values: Array) -> Hypothesis:
        inside = [k for k, scalar in enumerate(self.free) if scalar.name not in self.laws]
        return self.hypothesis.at([self.free[k] for k in inside], values[inside])

    def residual(self, k: int, values: Array, predicted: Mapping[int, Prediction]) -> Array:
        experiment = self.known.experiment
        trial = experiment.trials[k]
        added = _linear(experiment, self.laws, self.free, values, k)
        return self.known.metric[k](trial.measured - predicted[trial.drive].values - added)

    def cost(self, values: Array, predicted: Mapping[int, Prediction]) -> float:
        parts = [self.residual(k, values, predicted) for k in self.known.experiment.fit]
        return float(sum(z @ z for z in parts) + np.sum(self.precision * (values - self.prior) ** 2))

    def normal(
        self, values: Array, predicted: Mapping[int, Prediction], gradients: Mapping[int, Slopes]
    ) -> tuple[Array, Array]:
        experiment = self.known.experiment
        H = np.diag(self.precision)
        g = -self.precision * (values - self.prior)
        for k in experiment.fit:
            reference = experiment.reference(experiment.trials[k].trajectory)
            J = self.known.metric[k](np.moveaxis(gradients[reference].columns, 0, 2))
            H = H + J.T @ J
            g = g + J.T @ self.residual(k, values, predicted)
        return H, g


def _shortened(
    state: _State,
    values: Array,
    du: Array,
    predicted: Mapping[int, Prediction],
    cost: float,
    drives: Sequence[int],
    simulate: Simulate,
) -> tuple[Array, dict[int, Prediction], float] | None:
    """The longest of some steps that lowers the cost: values, predictions and cost after it."""
    for share in _SHORTER:
        candidate = np.clip(values + share * du, state.lower, state.upper)
        found = _predicted(state, candidate, drives, simulate)
        lower = state.cost(candidate, found)
        if lower < cost:
            return candidate, found, lower
    return None


def _updated(
    state: _State,
    moved: Array,
    before: Mapping[int, Prediction],
    after: Mapping[int, Prediction],
    gradients: Mapping[int, Slopes],
    size: Array,
) -> _State:
    """The known parameters' slopes, corrected by what a step did beyond what all slopes promised (Broyden)."""
    known = state.known
    plant = np.array([scalar.name not in state.laws for scalar in state.free])
    # In units of what each number shows.
    weight = plant * moved / np.maximum(size, 1e-300) ** 2
    length = float(weight @ moved)
    if length <= 0.0:
        return state
    share = weight[: len(known.value)] / length
    corrected = {}
    for drive, kept in known.slopes.items():
        promised = np.tensordot(plant * moved, gradients[drive].columns, axes=1)
        miss = after[drive].values - before[drive].values - promised
        corrected[drive] = Slopes(kept.base, kept.columns + np.multiply.outer(share, miss))
    return replace(state, known=replace(known, slopes=corrected))


def _linear(
    experiment: Experiment,
    laws: Mapping[str, Mapping[int, Array]],
    free: Sequence[Scalar],
    values: Array,
    k: int,
) -> Array:
    """(n, c) what laws that are columns of the prediction add to a trial's."""
    trial = experiment.trials[k]
    reference = experiment.reference(trial.trajectory)
    added = np.zeros_like(trial.measured)
    for scalar, value in zip(free, values, strict=True):
        if scalar.name in laws:
            added += value * laws[scalar.name][reference]
    return added


def _predicted(
    state: _State, values: Array, drives: Sequence[int], simulate: Simulate
) -> dict[int, Prediction]:
    here = state.at(values)
    return dict(zip(drives, simulate([(drive, here) for drive in drives]), strict=True))


def _gradients(state: _State, extra: Extra, values: Array, simulate: Simulate) -> dict[int, Slopes]:
    known, experiment = state.known, state.known.experiment
    begin, count = len(known.free), len(extra.plant)
    references = sorted(known.slopes)
    found: dict[int, Slopes] = {}
    fresh: dict[int, Slopes] = {}
    if count:
        own = values[begin : begin + count]
        differences = np.maximum(_DIFFERENCE * np.abs(own), _DIFFERENCE * extra.scale)
        fresh = slopes(experiment, state.at(values), extra.plant, differences, references, simulate)
    for drive in references:
        parts = [known.slopes[drive].columns]
        if count:
            parts.append(fresh[drive].columns)
        if extra.linear:
            parts.append(np.stack([state.laws[scalar.name][drive] for scalar in extra.linear]))
        found[drive] = Slopes(known.slopes[drive].base, np.concatenate(parts))
    return found


def _extended(parameters: Parameters, extra: Extra) -> Parameters:
    # A shape stays within what a search by slopes can be trusted over; amplitudes are free.
    shape = np.isfinite(extra.sigma)
    lower = np.where(shape, extra.prior / _FARTHEST, -np.inf)
    upper = np.where(shape, extra.prior * _FARTHEST, np.inf)
    assert parameters.lower is not None and parameters.upper is not None
    names = tuple(scalar.name for scalar in (*extra.plant, *extra.linear))
    return replace(
        parameters,
        names=(*parameters.names, *names),
        value=np.concatenate([parameters.value, extra.prior]),
        sigma=np.concatenate([parameters.sigma, extra.sigma]),
        lower=np.concatenate([parameters.lower, lower]),
        upper=np.concatenate([parameters.upper, upper]),
    )
