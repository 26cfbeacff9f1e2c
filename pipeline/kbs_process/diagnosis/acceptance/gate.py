"""The gate: a law is accepted only inside the plant, refitted, and if it predicts recordings that were not used.

No held-out trial's whitened residual may become worse, beyond chance, and all together have to improve, by as much as
chance does not and as what was fitted, or what the law changes there, lets expect; the interval of the law's
coefficients has to exclude zero, by the noise and by the scatter of what parts of the recordings ask for, and the
residual's power has to be no less even along frequency. Where nothing was
held out, each fit trial is left out in turn, to first order.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from kbs_process.diagnosis.acceptance.evenness import evenly, parts
from kbs_process.diagnosis.experiments.thresholds import (
    GATE_FEW,
    GATE_FORETOLD,
    GATE_GAIN,
    GATE_SHARE,
    GATE_SIGMA,
    GATE_WORSE,
    LEAST_RHO,
    SHOWN,
    TOLERATED,
)
from kbs_process.diagnosis.nominal.known import Known
from kbs_process.diagnosis.screening.gls import Background
from kbs_process.estimation.tails import log_tail
from kbs_process.signals.records import Array

_ROUNDING = 1e-12  # of a variance, which a difference of two may lose


@dataclass(frozen=True, slots=True)
class Fold:
    """What a law does for a trial that it was not fitted to."""

    trial: str
    before: float  # whitened sum of squares over its expectation
    after: float
    gain: float  # -2 log likelihood; of a law of each recording's own, beyond what chance could give, see `evenness`


@dataclass(frozen=True, slots=True)
class Gate:
    """Whether a law passes, and why not."""

    passed: bool
    folds: tuple[Fold, ...]
    held_out: bool  # folds are recordings set apart; else fit trials left out in turn
    # By which the coefficients are off zero, as one normal number's: by the noise, or by the scatter of parts.
    sigmas: float
    whiteness: tuple[float, float]  # before and after, see `whiteness`
    reasons: tuple[str, ...]  # of a refusal
    scattered: bool = False  # whether its coefficients are near zero by the scatter of parts, and not by the noise

    @property
    def uneven(self) -> bool:
        """Whether all that speaks against it is how much parts of the recordings differ in what they ask for."""
        return self.scattered and len(self.reasons) == 1

    def but(self, *reasons: str) -> Gate:
        """The same with more reasons to refuse; passed still, where there are none."""
        return replace(self, passed=self.passed and not reasons, reasons=(*self.reasons, *reasons))


def gate(
    before: Known,
    after: Known,
    coefficients: Sequence[int],
    shapes: Sequence[int] = (),
    *,
    least: float = GATE_SIGMA,
    blind: Callable[[], Collection[int]] = frozenset,
) -> Gate:
    """Judge the numbers `coefficients` of `after`, the amplitudes of a law that `before` is without.

    Its `shapes` count as they are: what makes up for an amplitude, as the lever of a force does, says nothing against
    it, and a law of no amplitude has none. By `least` sigmas amplitudes have to be off zero, or by a few of the
    scatter where the law leaves nothing, and much was left before or recordings of another motion ask for its size.
    Held-out trials in which it does nothing (`blind`, asked where they would decide) are no witnesses.
    """
    experiment = after.experiment
    held_out = bool(experiment.held_out)
    folds = _held_out(before, after) if held_out else _left_out(before, after)
    index = np.asarray(coefficients)
    held = _beside(after.covariance, np.asarray(shapes, dtype=np.intp))
    by_noise = sigmas = _sigmas(after.value[index], held[np.ix_(index, index)])
    if np.isfinite(sigmas):
        even = _evenly(after, held, index)
        sigmas = float(np.minimum(sigmas, as_one(max(even, 0.0) ** 2, len(index))))
    white = whiteness(before), whiteness(after)
    reasons = []
    # Written so that what is no number, of a plant that diverged, is refused.
    asked = folds
    if held_out and (worsened(folds) or not sum(fold.gain for fold in folds) >= GATE_GAIN):
        nothing = blind()
        asked = tuple(fold for k, fold in zip(experiment.held_out, folds, strict=True) if k not in nothing)
    gained = sum(fold.gain for fold in asked)
    if worse := worsened(asked):
        reasons.append(f"{', '.join(worse)} predicted worse")
    if not asked:
        reasons.append("no recording that was not used could show it")
    elif not gained >= GATE_GAIN:
        reasons.append("recordings that were not used gain less than chance could give")
    elif held_out and not (
        gained >= GATE_SHARE * _promised(before, after)
        or _as_foretold(gained, _changed(before, after, experiment.held_out))
    ):
        reasons.append("recordings that were not used gain much less than those that it was fitted to")
    few = by_noise >= least and sigmas >= GATE_FEW
    near_zero = not (sigmas >= least or (few and (_all_of_much(before, after) or _elsewhere(before, after, blind))))
    if near_zero:
        size = f"{sigmas:.1f} sigma off zero" if np.isfinite(sigmas) else "not determined"
        reasons.append(f"its coefficients are {size}")
    # In units of the floor: what is left has more of a colour, the less that is.
    if not white[1] * after.level <= white[0] * before.level + _spread(after):
        reasons.append("the residual's power is less even with it")
    scattered = near_zero and by_noise >= least
    return Gate(not reasons, folds, held_out, sigmas, white, tuple(reasons), scattered)


def _all_of_much(before: Known, after: Known) -> bool:
    """Whether a law leaves nothing of so much that known numbers had been pulled: no other minimum of theirs does."""
    return before.gross and after.excess <= TOLERATED * after.fit_rows


def _elsewhere(before: Known, after: Known, blind: Callable[[], Collection[int]]) -> bool:
    """Whether a law that leaves nothing is of the size that recordings ask for which nothing was fitted to.

    All of these that show it gain half at least of the square of what changes in them, one of another motion among
    them: where one window alone shows most of a law, windows that were fitted cannot tell its size from each other.
    What changes in those to which it is `blind` is other numbers' doing.
    """
    experiment = after.experiment
    if after.excess > TOLERATED * after.fit_rows:
        return False
    changes = {k: float(np.sum((before.residual[k] - after.residual[k]) ** 2)) for k in experiment.held_out}
    shown = [k for k, change in changes.items() if change >= SHOWN]
    if not all(before.chi2[k] - after.chi2[k] >= GATE_FORETOLD * changes[k] for k in shown):
        return False
    fitted = {experiment.trials[k].trajectory for k in experiment.fit}
    other = [k for k in shown if experiment.trials[k].trajectory not in fitted]
    return bool(other) and not set(other) <= set(blind())


def worsened(folds: Sequence[Fold]) -> list[str]:
    """Trials that are predicted worse, by more than chance does it and than is little beside what all gain."""
    allowed = max(GATE_WORSE * abs(sum(fold.gain for fold in folds)), GATE_GAIN)
    return [fold.trial for fold in folds if not fold.gain > -allowed]


def _beside(C: Array, held: NDArray[np.intp]) -> Array:
    """Covariance of all numbers where some are `held`: C - C_h C_hh^+ C_h^T."""
    if not len(held) or not np.isfinite(C).all():
        return C
    across = C[:, held]
    size = 1.0 / np.sqrt(np.maximum(np.diag(C)[held], 1e-300))
    scaled = C[np.ix_(held, held)] * np.outer(size, size)
    left = C - (across * size) @ np.linalg.lstsq(scaled, (across * size).T, rcond=1e-10)[0]
    return np.asarray(left + _ROUNDING * np.diag(np.diag(C)))


def _evenly(known: Known, C: Array, index: NDArray[np.intp]) -> float:
    """By how many sigmas the amplitudes `index` together are off zero, by what parts of the recordings ask for.

    C (p, p) is the covariance by the noise: what they do that no other number takes up is J C_i C_ii^-1 a.
    """
    own = C[np.ix_(index, index)]
    size = 1.0 / np.sqrt(np.maximum(np.diag(own), 1e-300))
    a = size * np.linalg.lstsq(own * np.outer(size, size), size * known.value[index], rcond=1e-10)[0]
    steps = (C[:, index] @ a)[:, None]
    experiment = known.experiment
    of_trials = {
        k: parts(experiment, k, known.metric[k], known.along(k, steps)[:, 0], known.residual[k]) for k in experiment.fit
    }
    return evenly(experiment, of_trials)


def _sigmas(a: Array, C: Array) -> float:
    """By how many sigmas of one normal number amplitudes with covariance C are off zero; nan where C is none."""
    variance = np.diag(C)
    if not (np.isfinite(C).all() and (variance > 0.0).all()):
        return float("nan")
    size = 1.0 / np.sqrt(variance)
    wald = float(size * a @ np.linalg.lstsq(C * np.outer(size, size), size * a, rcond=1e-10)[0])
    return as_one(wald, len(a))


def as_one(square: float, count: int) -> float:
    """Sigmas of one normal number that is as far out as the sum of squares of `count` of them."""
    far = log_tail(square, count)
    # Of that two-sided chance; beyond its range the chi-square's own root.
    return float(norm.isf(np.exp(far) / 2.0)) if far > -600.0 else float(np.sqrt(square))


def _promised(before: Known, after: Known) -> float:
    """What held-out recordings would gain if they did as those that were fitted, row by row.

    Calibrations aside: they are of other motions.
    """
    trials = after.experiment.trials
    fit, other = list(after.experiment.fit), list(after.experiment.held_out)
    fit = [k for k in fit if trials[k].role != "calibration"] or fit
    gained = float(np.sum(before.chi2[fit] - after.chi2[fit]))
    return gained * float(after.rows[other].sum() / after.rows[fit].sum())


def _changed(before: Known, after: Known, trials: Sequence[int]) -> float:
    """Whitened square of what changes in the prediction of some recordings."""
    changes = (before.residual[k] - after.residual[k] for k in trials)
    return sum(float(change @ change) for change in changes)


def foretold(before: Known, after: Known, blind: Collection[int] = ()) -> bool:
    """Whether held-out recordings, but those to which a law is `blind`, gain most of what one that is right gains."""
    asked = [k for k in after.experiment.held_out if k not in blind]
    gained = sum(float(before.chi2[k] - after.chi2[k]) for k in asked)
    return _as_foretold(gained, _changed(before, after, asked))


def _as_foretold(gained: float, changed: float) -> bool:
    """Whether recordings gain most of what a law that is right gains: the square of what it changes.

    Motions that excite a law little gain little by it, which is no reason to doubt it.
    """
    return gained >= max(LEAST_RHO**2, GATE_FORETOLD * changed)


def whiteness(known: Known) -> float:
    """Greatest distance of a cumulated periodogram from that of white noise, mean over fit trials and channels seen.

    Kolmogorov's statistic of each channel's whitened power along frequency; 0 is white, a single line gives nearly 1.
    """
    found = []
    for k in known.experiment.fit:
        layout = known.metric[k].layout(known.residual[k])
        power = np.sum(layout**2, axis=0)
        for channel in power.T[known.metric[k].whiten.window.any(axis=0)]:
            total = np.cumsum(channel) / np.sum(channel)
            found.append(float(np.max(np.abs(total - np.arange(1, len(total) + 1) / len(total)))))
    return float(np.mean(found))


def _spread(known: Known) -> float:
    """What `whiteness` may differ by through noise alone: one standard deviation of Kolmogorov's statistic."""
    bins = np.mean([len(known.metric[k].whiten.f) for k in known.experiment.fit])
    return float(0.26 / np.sqrt(bins))


def _held_out(before: Known, after: Known) -> tuple[Fold, ...]:
    return tuple(
        _fold(after, k, float(before.residual[k] @ before.residual[k]), float(after.residual[k] @ after.residual[k]))
        for k in after.experiment.held_out
    )


def _fold(known: Known, k: int, before: float, after: float) -> Fold:
    rows = float(known.rows[k])
    return Fold(known.experiment.trials[k].name, before / rows, after / rows, before - after)


def _left_out(before: Known, after: Known) -> tuple[Fold, ...]:
    """Each fit trial that is no calibration left out in turn: both models' numbers step to where the others pull."""
    experiment = after.experiment
    chosen = [k for k in experiment.fit if experiment.trials[k].role == "fit"] or list(experiment.fit)
    if len(chosen) < 2:
        # One recording alone: its first half says nothing about its second that a taper would not mix.
        return ()
    parts = []
    for known in (before, after):
        J = {k: known.jacobian(k) for k in experiment.fit}
        parts.append({k: _without(known, J, k) for k in chosen})
    return tuple(_fold(after, k, parts[0][k], parts[1][k]) for k in chosen)


def _without(known: Known, J: dict[int, Array], out: int) -> float:
    others = {k: j for k, j in J.items() if k != out}
    rest = Background.of({k: known.residual[k] for k in others}, others, known.precision, known.offset)
    left = known.residual[out] - J[out] @ (rest.scale * rest.shift)
    return float(left @ left)
