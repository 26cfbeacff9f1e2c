"""The numbers of a fit as the plant has them: amplitudes and phases in place of sines and cosines, edges of contact."""

from __future__ import annotations

import numpy as np
from scipy.optimize import least_squares

from kbs_process.diagnosis.experiments.hypothesis import Hypothesis
from kbs_process.diagnosis.smoothing.drive import NUMBERS, priors
from kbs_process.diagnosis.smoothing.fit import Fitted
from kbs_process.plant.effect import Effect
from kbs_process.rig.model import Drive, substitute
from kbs_process.signals.records import Array

_OF_PLANT = ("b_m", "d0", "tcog", "phi_cog", "d1", "phi_dyn", "Ts0", "delta", "phi_stat")
_PHASES = {  # the numbers whose ratio, times a sign, is a phase's tangent
    "phi_cog": ("cog c", "cog s", 1.0),
    "phi_dyn": ("dyn c", "dyn s", 1.0),
    "phi_stat": ("stat s", "stat c", -1.0),
}
_EXACT = 1e-6  # of a number that is known exactly: its sigma, of itself
_NARROWEST = 1e-3  # rad, of a tooth's contact


def hypothesis_of(fit: Fitted) -> Hypothesis:
    """The rig's numbers of a fit, and the effects that the model has: those that were found are left out."""
    problem = fit.problem
    drives = [joint.drive for joint in problem.rig.joints if joint.drive is not None]
    across, x = fit.covariance[:, problem.numbers], fit.state.x.copy()
    covariance, fitted, count = across[problem.numbers], x[problem.numbers], len(NUMBERS)
    blocks = [slice(k * count, (k + 1) * count) for k in range(len(drives))]
    of_drives = [
        parameters_of(drive, fitted[own], covariance[own, own]) for drive, own in zip(drives, blocks, strict=True)
    ]
    # All others go to where they are likeliest beside numbers that such parameters have.
    moved = np.concatenate([numbers_of(own) for own in of_drives]) - fitted
    x[: len(across)] += across @ np.linalg.solve(covariance, moved)
    rig = problem.rig_at(x)
    values: dict[str, Array | float] = {}
    for joint, own in zip(rig.joints, of_drives, strict=True):
        values |= {f"joint.{joint.name}.drive.{name}": float(v) for name, v in zip(_OF_PLANT, own, strict=True)}
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


def parameters_of(drive: Drive, numbers: Array, covariance: Array) -> Array:
    r"""A drive's parameters (parameters,) of its NUMBERS (numbers,) and their covariance (numbers, numbers).

    Equation: $\min_p (n(p) - y)^T (C^{-1} - P) (n(p) - y) + \sum ((p - p_0) / \sigma_0)^2$: the numbers y were fitted
        with covariance C as if priors of their own, of precision P, were all that is known of them. Those are taken
        out, and the parameters' put in their place.
    Units: as the numbers'.
    Validity: numbers near their best, about which the cost is a square; parameters of which nothing is told are where
        files have them.
    """
    mean, spread = priors(drive)
    spread = np.where(spread > 0.0, spread, _EXACT**2)  # as they were fitted
    inverse = np.linalg.inv(covariance)
    told, directions = np.linalg.eigh(inverse - np.diag(spread**-2.0))
    told = np.sqrt(np.maximum(told, 0.0))
    pull = directions.T @ (inverse @ numbers - mean / spread**2)
    seen = np.divide(pull, told, out=np.zeros_like(pull), where=told > 0.0)
    given = [drive.parameters.get(name) for name in _OF_PLANT]
    value = np.array([0.0 if one is None else float(one) for one in given])
    sigma = np.array([np.inf if one is None else float(one.sigma) for one in given])
    sigma[[name in _PHASES for name in _OF_PLANT]] = np.inf
    sigma = np.maximum(sigma, np.maximum(_EXACT * np.abs(value), _EXACT**2))

    def left(p: Array) -> Array:
        return np.concatenate([told * (directions.T @ numbers_of(p)) - seen, (p - value) / sigma])

    there = dict(zip(NUMBERS, numbers, strict=True))
    phases = {name: float(np.arctan2(sign * there[s], there[c])) for name, (s, c, sign) in _PHASES.items()}
    begin = np.array([phases.get(name, v) for name, v in zip(_OF_PLANT, value, strict=True)])
    width = np.array([name == "delta" for name in _OF_PLANT])
    low, high = np.where(width, _NARROWEST, -np.inf), np.where(width, np.pi, np.inf)
    size = np.minimum(sigma, 1.0)
    return np.asarray(least_squares(left, np.clip(begin, low, high), bounds=(low, high), x_scale=size).x)


def numbers_of(parameters: Array) -> Array:
    r"""A drive's NUMBERS (numbers,) of its parameters.

    Equation: contact of half width $\delta$ is $T_{s0} (\delta/\pi + \sum_k 2 \sin(k\delta)/(k\pi) \cos k\alpha)$.
    Units: N m, rad.
    """
    own = dict(zip(_OF_PLANT, parameters, strict=True))
    delta, phase = own["delta"], own["phi_stat"]
    first, second = own["Ts0"] * 2.0 * np.sin(delta) / np.pi, own["Ts0"] * np.sin(2.0 * delta) / np.pi
    numbers = {
        "b_m": own["b_m"],
        "d0": own["d0"],
        "cog s": own["tcog"] * np.cos(own["phi_cog"]),
        "cog c": own["tcog"] * np.sin(own["phi_cog"]),
        "dyn s": own["d1"] * np.cos(own["phi_dyn"]),
        "dyn c": own["d1"] * np.sin(own["phi_dyn"]),
        "stat s": -first * np.sin(phase),
        "stat c": first * np.cos(phase),
        "stat 2s": -second * np.sin(2.0 * phase),
        "stat 2c": second * np.cos(2.0 * phase),
        "stat": own["Ts0"] * delta / np.pi,
    }
    return np.array([numbers[name] for name in NUMBERS])
