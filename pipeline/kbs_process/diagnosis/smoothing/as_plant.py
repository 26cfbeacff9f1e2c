"""The numbers of a fit as the plant has them: amplitudes and phases in place of sines and cosines, edges of contact."""

from __future__ import annotations

import numpy as np

from kbs_process.diagnosis.experiments.hypothesis import Hypothesis
from kbs_process.diagnosis.smoothing.drive import NUMBERS
from kbs_process.diagnosis.smoothing.problem import Problem
from kbs_process.plant.effect import Effect
from kbs_process.rig.model import substitute
from kbs_process.signals.records import Array

_NARROWEST = 0.05  # rad, of a tooth's contact


def hypothesis_of(problem: Problem, x: Array) -> Hypothesis:
    """The rig's numbers at unknowns `x`, and the effects that the model has: those that were found are left out."""
    rig = problem.rig_at(x)
    values: dict[str, Array | float] = {}
    for joint, own in zip(rig.joints, x[problem.numbers].reshape(len(rig.joints), -1), strict=True):
        values |= {f"joint.{joint.name}.drive.{name}": value for name, value in of_drive(own).items()}
    coupling = rig.transducer.cross_coupling
    coupled = coupling.value.copy()
    for place, value in zip(problem.coupled, x[problem.coupling], strict=True):
        coupled[place] += value
    values[coupling.name] = coupled
    known = [(one, entry) for one in problem.given for entry in one.amplitudes]
    for (one, entry), value in zip(known, x[problem.amplitudes[0]], strict=False):
        assert isinstance(one.effect, Effect)
        path = f"joint.{one.site}.drive" if one.effect.port.of_drive else f"external.{one.name}"
        values[f"{path}.{entry.name}"] = float(value)
    quantities = rig.quantities()
    inside = {name: np.maximum(value, quantities[name].low) for name, value in values.items()}
    return Hypothesis(substitute(rig, inside), problem.experiment.effects)


def of_drive(numbers: Array) -> dict[str, float]:
    r"""A drive's parameters of its NUMBERS (numbers,).

    Equation: contact of half width $\delta$ is $T_{s0} (\delta/\pi + \sum_k 2 \sin(k\delta)/(k\pi) \cos k\alpha)$, so
        that its first term over its mean is $2 \sin\delta / \delta$.
    Units: N m, rad.
    Validity: the width is that of mean and first term; of what is no contact at all, the narrowest or the whole turn.
    """
    own = dict(zip(NUMBERS, map(float, numbers), strict=True))
    first, mean = np.hypot(own["stat s"], own["stat c"]), max(own["stat"], 1e-12)
    widths = np.linspace(_NARROWEST, np.pi, 1000)
    delta = float(widths[np.argmin(np.abs(2.0 * np.sin(widths) / widths - first / mean))])
    return {
        "b_m": own["b_m"],
        "d0": own["d0"],
        "tcog": float(np.hypot(own["cog s"], own["cog c"])),
        "phi_cog": float(np.arctan2(own["cog c"], own["cog s"])),
        "d1": float(np.hypot(own["dyn s"], own["dyn c"])),
        "phi_dyn": float(np.arctan2(own["dyn c"], own["dyn s"])),
        "Ts0": mean * np.pi / delta,
        "delta": delta,
        "phi_stat": float(np.arctan2(-own["stat s"], own["stat c"])),
    }
