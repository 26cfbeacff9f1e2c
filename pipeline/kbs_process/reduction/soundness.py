"""Is the model of the rig right? What was fitted against what was known, before anything is judged by it.

`validate` and processing ask the same here: every fitted number against its prior, each recording's zero, the slope of
what is read against computed gravity, and what a calibration leaves. Where one of them is beyond what chance allows,
no requirement is judged; what a simple fault would explain is said first.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import msgspec
import numpy as np

from kbs_process.campaign.config import Campaign
from kbs_process.reduction.preparing import Prepared, gravity_samples, tare
from kbs_process.reduction.relief import relieved
from kbs_process.results.judged import Beyond, Soundness
from kbs_process.rig.model import Rig
from kbs_process.signals.records import WRENCH_CHANNELS, Array
from kbs_process.stages.conventions import SignCheck, check_encoder_sense, check_gravity_sign, check_weight
from kbs_process.stages.gravity import equation
from kbs_process.stages.gravity.equation import Equation
from kbs_process.stages.gravity.hypotheses import Explained, explanations
from kbs_process.stages.gravity.model import GravityModel, Sample, prepared
from kbs_process.stages.gravity.solve import zero_basis, zero_sigma
from kbs_process.stages.gravity.taring import Taring
from kbs_process.stages.gravity.tension import BY_CHANCE, Moved, tension
from kbs_process.stages.repeats import commanded

LEFT = 0.1  # of the weight, and of the torque that it can make: a calibration leaves less, whatever rubs or pulls
_LIKE = 0.03  # relative: a gain this near to a unit's factor is that unit's
_SHOWN = 6
_UNITS = {
    "N": {"pound-force": 4.4482216, "kilogram-force": 9.80665, "gram-force": 9.80665e-3, "kN": 1e3, "mN": 1e-3},
    "N m": {
        "N mm": 1e-3,
        "N cm": 1e-2,
        "pound-force foot": 1.3558179,
        "pound-force inch": 0.1129848,
        "kilogram-force metre": 9.80665,
        "kN m": 1e3,
    },
}


@dataclass(frozen=True, slots=True)
class Checked:
    """What was found of the model of the rig, and the self-tests of signs behind it."""

    soundness: Soundness
    conventions: tuple[SignCheck, ...]


def check_model(campaign: Campaign, recordings: Sequence[Prepared], model: GravityModel) -> Checked:
    """Compare what was fitted with what was known, and look for what would explain a difference."""
    samples = gravity_samples(campaign, recordings)
    conventions = tuple(_conventions(campaign, recordings, samples, model))
    tarings = {
        one.entry.name: tare(campaign, one.entry, relieved(campaign, one.entry, one.run, one.motion), one.motion, model)
        for one in recordings
    }
    found = tension(model, {name: taring for name, (_, taring) in tarings.items()})
    beyond = tuple(map(_unitless(campaign.rig, model), found.beyond))
    most = _most(campaign.rig, model.equation)
    left = tuple(_left(model, most))
    broken = tuple(check for check in conventions if not check.ok)
    together = () if found.probability >= BY_CHANCE or beyond else (found.probability,)
    reasons = (
        *(_moved(one) for one in beyond[:_SHOWN]),
        *([f"{len(beyond) - _SHOWN} more"] if len(beyond) > _SHOWN else []),
        *(f"all fitted numbers together are as far from their priors by chance once in {1 / p:.2g}" for p in together),
        *(f"{check.check} is {check.found}, expected {check.expected}" for check in broken),
        *left,
    )
    if not reasons:
        return Checked(Soundness(sound=True, probability=found.probability), conventions)
    data = [prepared(sample, model.equation, model.settings, model.settings.low_pass_Hz) for sample in samples]
    named = tuple(_in_words(one, model) for one in explanations(model.equation, data, most))
    return Checked(
        Soundness(
            sound=False, probability=found.probability, beyond=beyond, reasons=reasons, suggestions=named
        ),
        conventions,
    )


def _unitless(rig: Rig, model: GravityModel) -> _Named:
    return _Named(rig, model)


def _left(model: GravityModel, most: Array) -> Iterator[str]:
    """Channels of which gravity explains too little in the recordings that are there for it."""
    for name in model.reference:
        for channel, unit, rms, limit in zip(model.channels, model.units, model.residual_rms[name], most, strict=True):
            if rms > limit:
                yield f"gravity leaves {rms:.3g} {unit} rms of {channel} in {name}"


def _most(rig: Rig, equation: Equation) -> Array:
    """What may be left (c,) of a calibration, rms: a part of the weight, and of the torque that it can make."""
    bodies = [body for body in rig.bodies if float(body.mass) > 0.0]
    weight = float(rig.gravity) * sum(float(body.mass) for body in bodies)
    arms = [float(np.linalg.norm(joint.origin.value)) for joint in rig.joints]
    reach = sum(arms) + max((float(np.linalg.norm(body.cog.value)) for body in bodies), default=0.0)
    scale = [
        weight if channel[0] == "F" else weight * reach if channel in WRENCH_CHANNELS else 0.0
        for channel in equation.channels
    ]
    most: Array = np.where(np.array(scale) > 0.0, LEFT * np.array(scale), np.inf)
    return most
