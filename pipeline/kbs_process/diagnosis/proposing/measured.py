"""A measured law in the plant: the effect that a curve's coefficients are the parameters of."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from kbs_process.diagnosis.experiments.hypothesis import Hypothesis
from kbs_process.diagnosis.nominal.joint import Extra, Standing
from kbs_process.diagnosis.proposing.curves import CurveSuspect
from kbs_process.diagnosis.screening.gls import Score
from kbs_process.diagnosis.screening.suspects import next_action
from kbs_process.identification.output_error import Scalar
from kbs_process.plant.attach import attach
from kbs_process.plant.laws import select
from kbs_process.plant.laws.position.measured_law import COEFFICIENTS, SLIDES, Measured
from kbs_process.rig.model import Joint
from kbs_process.signals.records import Array


def inserted(
    hypothesis: Hypothesis, law: Measured, joint: str, ends: tuple[float, float], coefficients: Array, sigma: Array
) -> tuple[Hypothesis, tuple[Scalar, ...]]:
    """Return a hypothesis with a measured law in its plant, and the rig's numbers that its coefficients are.

    `ends` are the range of its regressor, `coefficients` those of `curves.basis` (COEFFICIENTS,), `sigma` theirs. A
    joint that has such a law already gets one more action of it.
    """
    effect = next_action(law.effect, hypothesis.rig, joint, hypothesis.effects)
    names = [entry.name for entry in effect.parameters]
    shape = (*ends, SLIDES[law.opposed]) if law.opposed else ends
    values = dict(zip(names, (*map(float, coefficients), *shape), strict=True))
    rig = attach(hypothesis.rig, effect, values, joints=[joint])
    spread = dict(zip(names, (*map(float, sigma), *(0.0 for _ in shape)), strict=True))
    new = {one.name for one in hypothesis.rig.joints if one.drive is None or names[0] not in one.drive.parameters}
    rig = replace(
        rig,
        joints=tuple(
            _stated(one, spread if one.name == joint else dict.fromkeys(names, 0.0))
            if one.name in {joint, *new}
            else one
            for one in rig.joints
        ),
    )
    effects = tuple(one.name for one in select([*dict.fromkeys([*hypothesis.effects, effect.name])]))
    path = f"joint.{joint}.drive"
    return Hypothesis(rig, effects), tuple(Scalar(f"{path}.{name}") for name in names[:COEFFICIENTS])


def _stated(joint: Joint, spread: Mapping[str, float]) -> Joint:
    """A joint with the law's sigmas; where the law does not act, its numbers are exact."""
    assert joint.drive is not None  # that of the law
    parameters = {
        name: replace(quantity, sigma=np.asarray(spread[name]), source="measured law") if name in spread else quantity
        for name, quantity in joint.drive.parameters.items()
    }
    return replace(joint, drive=replace(joint.drive, parameters=parameters))


def extra(suspect: CurveSuspect, score: Score, standing: Standing) -> Extra:
    """A curve in the non-linear plant at the screen's coefficients, these with a prior of ten times their size."""
    size = np.sqrt(np.maximum(np.diag(score.covariance), 0.0))
    largest = max(float(np.abs(score.amplitude).max()), 5.0 * float(size.min()))
    hypothesis, scalars = inserted(
        standing.hypothesis, suspect.law, suspect.joint, suspect.ends, score.amplitude, size
    )  # fmt: skip
    return Extra(
        hypothesis=hypothesis,
        plant=scalars,
        start=score.amplitude,
        prior=0.0 * score.amplitude,
        sigma=np.full(COEFFICIENTS, 10.0 * largest),
        # One size for all: a coefficient that is zero by chance has a slope as well.
        scale=np.full(COEFFICIENTS, largest),
        lower=np.full(COEFFICIENTS, -np.inf),
        upper=np.full(COEFFICIENTS, np.inf),
    )
