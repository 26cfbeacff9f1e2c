"""What was fitted against what was known: every fitted number, and each recording's zero, next to its prior.

Where the model of the rig is right, an estimate differs from its prior by chance, with the covariance that the fit
states (`Fit.moved_covariance`): not by the posterior's alone, which the prior is part of. What lies beyond says that
the model, a unit or a sign is wrong, or a stated sigma too small.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import chi2

from kbs_process.estimation.longrun import longrun_covariance
from kbs_process.rig.model import Joint
from kbs_process.signals.records import WRENCH_CHANNELS, Array
from kbs_process.stages.gravity.equation import Prepared
from kbs_process.stages.gravity.model import GravityModel, taring_error
from kbs_process.stages.gravity.solve import ZERO, least_sigma
from kbs_process.stages.gravity.taring import Taring

BEYOND = 4.0  # sigma
BY_CHANCE = 1e-4
KNOWN_S = 0.02  # to which a delay between two recorders can be known at best
TAKEN = 0.25  # part of the power of what is left that a lag explains, or something else may follow the rates
ALONE = 0.8  # the same of what is misread in one recording, or something else may follow the angles
_ABOUT = 0.4  # of -1, a sign or an order that is reversed
_LINEAR = 45.0  # degrees, to which an angle's zero is found in one step
_ROUNDS = 4  # of weights
_INFORMED = 0.1  # part of the prior's variance that the data take away: less says nothing of the prior


@dataclass(frozen=True, slots=True)
class Moved:
    """A number before and after the fit, and by how much it may move by chance."""

    name: str
    prior: float
    prior_sigma: float
    value: float
    chance: float  # standard deviation of value - prior, where all is right

    @property
    def distance(self) -> float:
        """How far it has moved, in standard deviations of such moves."""
        return (self.value - self.prior) / self.chance


@dataclass(frozen=True, slots=True)
class Shift:
    """What is off in one recording, by what the model leaves of it: in time, or in a joint's angle."""

    what: str
    recording: str
    channel: str  # that has another gain, or none
    value: float
    chance: float  # standard deviation, by what coloured residuals leave uncertain
    taken: float  # part of the power of what is left that it explains
    right: float = 0.0  # value where nothing is off
    zeros: tuple[str, ...] = ()  # of channels, which it moves as well

    def moved(self, known: float) -> Moved:
        """The same, of what is known to `known`."""
        name = f"{self.what} in {self.recording}"
        return Moved(name, self.right, known, self.value, float(np.hypot(known, self.chance)))


@dataclass(frozen=True, slots=True)
class Tension:
    """Everything fitted next to what was known of it, and how likely chance moves it all so far together."""

    moved: tuple[Moved, ...]
    probability: float

    @property
    def beyond(self) -> tuple[Moved, ...]:
        """What is further off than chance allows, the farthest first."""
        far = [one for one in self.moved if abs(one.distance) > BEYOND]
        return tuple(sorted(far, key=lambda one: -abs(one.distance)))

    @property
    def sound(self) -> bool:
        return not self.beyond and self.probability >= BY_CHANCE


def tension(model: GravityModel, tarings: Mapping[str, Taring], lags: Sequence[Moved] = ()) -> Tension:
    """Compare a fit with its priors, and the zeros of recordings that were not fitted with that of the bias.

    `lags` are numbers that were fitted to what the fit leaves, see `lag`.

    How a zero drifts is assumed rather than known: it is not compared.
    """
    fit = model.fit
    known = np.array([not name.startswith(ZERO[1]) for name in fit.names], dtype=np.bool_)
    scale = fit.prior_sigma[known]
    C = fit.moved_covariance[np.ix_(known, known)] / np.outer(scale, scale)
    names = [name for name, prior in zip(fit.names, known, strict=True) if prior]
    prior = (fit.value - fit.moved)[known]
    moved = by_chance(names, prior, fit.value[known], scale, C)
    return Tension((*moved, *_zeros(model, tarings), *lags), together(fit.moved[known] / scale, C))


def lag(model: GravityModel, data: Prepared) -> Shift | None:
    """The lag of a recording's wrench, beyond what the model has, by what gravity leaves; None where no wrench is."""
    expected = model.equation.predict(model.fit.value[: model.equation.size], data)
    return _shift(model, data, "the wrench's lag (s) behind the angles", -np.gradient(expected, data.t, axis=0))


def misread(model: GravityModel, data: Prepared) -> Iterator[Shift]:
    """What alone makes a recording one like those that were fitted, where it takes most of what gravity leaves of it.

    A channel may read another share of what acts, an encoder count from another zero (degrees), or the other way, or
    be taken for that of another joint.
    """
    equation, joints = model.equation, model.rig.joints
    theta = model.fit.value[: equation.size]
    expected, slopes = equation.predict(theta, data), equation.angle_slopes(theta, data)
    found = []
    for index, channel in enumerate(equation.channels):
        own = np.where(np.arange(len(equation.channels)) == index, expected, 0.0)
        found.append(_shift(model, data, f"the gain of {channel}", own, right=1.0, channel=channel))
    for index, joint in enumerate(joints):
        zero = _shift(model, data, f"the zero of {joint.name}'s angle (degrees)", -np.radians(slopes[:, :, index]))
        found += [zero] if zero and abs(zero.value) < _LINEAR else []
    readings = [(f"the sign of {joint}'s angle", matrix) for joint, matrix in reversals(joints)]
    readings += [(f"the order of the angles of {pair}", matrix) for pair, matrix in exchanges(joints)]
    for what, matrix in readings:
        q, qd, qdd = (each @ matrix for each in (data.q, data.qd, data.qdd))
        other = equation.predict(theta, replace(data, q=q, qd=qd, qdd=qdd, before=None, after=None))
        turned = _shift(model, data, what, 0.5 * (expected - other), right=1.0)
        found += [turned] if turned and abs(turned.value + 1.0) < _ABOUT else []
    yield from sorted((one for one in found if one and one.taken > ALONE), key=lambda one: -one.taken)[:1]


def reversals(joints: Sequence[Joint]) -> Iterator[tuple[str, Array]]:
    """Each joint, and the matrix (joints, joints) that turns its angle the other way."""
    unit = np.eye(len(joints))
    yield from ((joint.name, unit - 2.0 * np.outer(own, own)) for joint, own in zip(joints, unit, strict=True))


def exchanges(joints: Sequence[Joint]) -> Iterator[tuple[str, Array]]:
    """Each pair of joints of one type, and the matrix (joints, joints) that exchanges their angles."""
    unit = np.eye(len(joints))
    for (a, one), (b, other) in itertools.combinations(enumerate(joints), 2):
        if one.type == other.type:
            between = unit[a] - unit[b]
            yield f"{one.name} and {other.name}", unit - np.outer(between, between)


def _shift(
    model: GravityModel, data: Prepared, what: str, shape: Array, right: float = 0.0, channel: str = ""
) -> Shift | None:
    """How much of a shape (n, c) the wrench holds that gravity leaves of a recording, beyond what is `right`."""
    equation = model.equation
    wrench = [at for at, channel in enumerate(equation.channels) if channel in WRENCH_CHANNELS]
    if not wrench:
        return None
    expected = equation.predict(model.fit.value[: equation.size], data)
    left, shape = (data.wrench - expected)[:, wrench], shape[:, wrench]
    rest = left = left - left.mean(axis=0)
    middle = shape.mean(axis=0)
    shape = shape - middle
    floor = least_sigma(data, equation.elements.rig)[wrench]
    for _ in range(_ROUNDS):
        weight = np.maximum(rest.std(axis=0), floor) ** -2
        power = max(float(np.sum(shape**2 * weight)), 1e-300)
        value = float(np.sum(shape * left * weight)) / power
        rest = left - value * shape
    scores = np.sum(shape * rest * weight, axis=1, keepdims=True)
    chance = float(np.sqrt(longrun_covariance(scores)[0, 0])) / power
    taken = 1.0 - float(np.sum(rest**2 * weight)) / max(float(np.sum(left**2 * weight)), 1e-300)
    moved = np.flatnonzero(np.abs(value * middle) > floor)
    zeros = tuple(f"{ZERO[0]}[{data.name}].{equation.channels[wrench[at]]}" for at in moved)
    return Shift(what, data.name, channel, right + value, chance, taken, right, zeros)


def by_chance(names: Sequence[str], prior: Array, value: Array, sigma: Array, covariance: Array) -> tuple[Moved, ...]:
    """Numbers that the data inform; `covariance` is that of their moves over their priors' sigmas."""
    chance = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    return tuple(
        Moved(name, float(a), float(scale), float(b), float(share * scale))
        for name, a, b, scale, share in zip(names, prior, value, sigma, chance, strict=True)
        if share**2 > _INFORMED
    )


def together(moved: Array, covariance: Array) -> float:
    """Probability that chance moves all numbers as far, in the directions that the data inform; in prior sigmas."""
    if len(moved) == 0:
        return 1.0
    variance, directions = np.linalg.eigh(covariance)
    informed = variance > _INFORMED
    squares = (directions.T @ moved)[informed] ** 2 / variance[informed]
    return float(chi2.sf(squares.sum(), informed.sum())) if informed.any() else 1.0


def _zeros(model: GravityModel, tarings: Mapping[str, Taring]) -> Iterator[Moved]:
    """The constants of recordings that were tared by themselves."""
    prior = model.equation.bias_sigma
    for name, taring in tarings.items():
        if taring.fitted:
            continue
        chance = np.hypot(prior, taring_error(model, taring))
        for channel, value, sigma, own in zip(model.channels, taring.bias, prior, chance, strict=True):
            if sigma > 0.0:
                yield Moved(f"bias[{name}].{channel}", 0.0, float(sigma), float(value), float(own))
