"""What each part of the gravity model is worth: the fit made again with its first parts, then one more each time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from kbs_process.rig.model import substitute
from kbs_process.signals.records import Array
from kbs_process.signals.smoothing import smooth
from kbs_process.stages.gravity.equation import Equation, Prepared
from kbs_process.stages.gravity.model import GravityModel, Sample, prepared
from kbs_process.stages.gravity.solve import Rows, residual_sigma, solve

LOW_HZ = 0.3  # below which errors of the fit are looked at
THINNED = 3  # one of so many instants counts in a rung's fit
STEPS = 2  # of each rung's fit, which begins where the whole model ends: the loads are nearly linear
MASSES, SAG, COUPLING = "masses and CoGs", "sag", "cross-coupling"
# What each rung frees of the rig beside those before it, by the ends of names; what is not named is in the first.
_FREED = {MASSES: (), "tilt": ("tilt",), "misalignment": ("misalignment", "origin", "offset"), SAG: ("stiffness",)}


@dataclass(frozen=True, slots=True, eq=False)
class Rung:
    """What a model with this part, and all before it, leaves of the fitted recordings below `LOW_HZ`."""

    name: str
    rms: Array  # (c,) N and N m, of all recordings alike
    peak: Array  # (c,)


def ladder(samples: Sequence[Sample], model: GravityModel) -> tuple[Rung, ...]:
    """Return the rungs from masses and CoGs up to the whole model, less those that free nothing.

    What a rung does not free is as the parameter files say; before `SAG` the transducer is rigid. Recordings weigh as
    they do for the whole model, and zeros are those of each rung.
    """
    whole = model.equation
    theta = model.fit.value[: whole.size]
    data = [prepared(sample, whole, model.settings, model.settings.low_pass_Hz, theta) for sample in samples]
    fewer = [p.rows(slice(None, None, THINNED)) for p in data]
    sigmas = [residual_sigma(whole, theta, p, model.rig) for p in data]
    known = dict(zip(whole.names, theta, strict=True))
    found: list[Rung] = []
    last = (0, True)
    for name in (*_FREED, COUPLING):
        equation = _up_to(name, whole)
        shape = equation.size, equation.elements.rig.transducer.stiffness is None
        if shape == last:
            continue
        last = shape
        near = np.array([known[each] for each in equation.names])
        solution = solve(Rows(equation, fewer), sigmas, near, STEPS)
        left = [
            _slow(p, p.wrench - equation.predict(solution.theta, p) - zero)
            for p, zero in zip(data, solution.zeros[:, 0], strict=True)
        ]
        rms = np.sqrt(np.mean([np.mean(one**2, axis=0) for one in left], axis=0))
        found.append(Rung(name, rms, np.max([np.abs(one).max(axis=0) for one in left], axis=0)))
    return tuple(found)


def _slow(p: Prepared, left: Array) -> Array:
    """Below `LOW_HZ`, at steady instants; a gap is bridged."""
    t = np.arange(p.t[0], p.t[-1], float(np.median(np.diff(p.t))))
    return smooth(np.stack([np.interp(t, p.t, column) for column in left.T], axis=1), t[1] - t[0], LOW_HZ)


def _up_to(name: str, whole: Equation) -> Equation:
    """The equation of a rung: what later ones free is held, and their physics left out."""
    if name == COUPLING:
        return whole
    rungs, rig = list(_FREED), whole.elements.rig
    later = tuple(end for rung in rungs[rungs.index(name) + 1 :] for end in _FREED[rung])
    held = {key: quantity.value for key, quantity in rig.quantities().items() if later and key.endswith(later)}
    rig = substitute(rig, dict(held), {key: np.zeros(value.shape) for key, value in held.items()})
    if name != SAG:
        rig = replace(rig, transducer=replace(rig.transducer, stiffness=None, damping=None))
    return Equation.of(
        rig, include_inertia=whole.include_inertia, cross_coupling=False, response_sigma=whole.response_sigma
    )
