"""A trial's rig with its metric: how strong an effect is there, and how large it has to be."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from engine.hardware import Array, Hardware
from engine.laboratory import QUIET, Laboratory
from engine.ports import NONE, Extra
from engine.trajectories import Commands
from proof.concealed import effects as catalogue
from proof.concealed import paths
from proof.concealed.observed import Motion
from proof.concealed.physics import Effect
from proof.concealed.ranges import BEYOND_SIGMAS, LEVELS, Split
from proof.concealed.sensitivity import Named, columns, perturbed
from proof.concealed.strength import Setting, Strength, Whitening, own_columns, strength

_REPEATS = 2  # of each trajectory that models are fitted to
_NEAR = 0.2  # a strength is close enough to its level: its logarithm
_FAR = 0.5  # what does not come near, as friction that sticks or not, may be as far off
_ABSORBED = 0.99  # kappa; beyond, an effect is a change of known parameters by another name
_REALISATIONS = 6  # of a laboratory's noise: with the bins that are averaged, 66 for eight channels
_SEARCH = 7  # amplitudes tried

# Not moved beyond: phases are unknown anyway, the others would not be physical or not be seen.
_KEPT = (".phi_", "misalignment", "body.base", "body.azimuth.inertia")
_LEAST_BEYOND = 60.0  # rho of parameters that are off beyond their uncertainty


@dataclass(frozen=True, slots=True, eq=False)
class Bench:
    """A trial's rig, trajectories and metric."""

    hardware: Hardware
    trajectories: tuple[Commands, ...]  # the last one is held out
    calibration: Commands | None
    rates: tuple[float, float]  # Hz, of wrench and encoders
    settings: tuple[Setting, ...]  # of all that models are fitted to, the calibration last
    readings: tuple[Array, ...]
    columns: tuple[dict[Named, Array], ...]
    laboratory: Laboratory

    @property
    def fitted(self) -> tuple[Commands, ...]:
        """Trajectories that models are fitted to."""
        return self.trajectories[:-1]

    def spans(self) -> Array:
        """Least and greatest reading of each channel, (6, 2), in the trajectory that moves it farthest."""
        readings = self.readings[: len(self.fitted)]
        return paths.farthest([one[:, :6] for one in readings])

    def extra(self, effects: Sequence[Effect], duration: float) -> Extra:
        """What the engine lets act."""
        return catalogue.extra(tuple(effects), self.hardware, self.spans(), duration)

    def strength(self, effects: Sequence[Effect]) -> Strength:
        """Distance of some effects from the floor."""
        changes: list[Array] = []
        for setting, readings in zip(self.settings, self.readings, strict=True):
            duration = float(setting.motion.path.t[-1])
            changes.append(setting.whiten(setting.motion.observed(extra=self.extra(effects, duration)) - readings))
        return strength(self.settings, changes)


def measure(
    hardware: Hardware,
    trajectories: Sequence[Commands],
    rates: tuple[float, float],
    calibration: Commands | None = None,
    laboratory: Laboratory = QUIET,
    rng: np.random.Generator | None = None,
) -> Bench:
    """Work out the metric of a rig along all trajectories but the last, each driven twice, and a calibration.

    A laboratory that is not quiet is realised by `rng`.
    """
    settings, readings, sensitivities = [], [], []
    driven = [(path, _REPEATS) for path in trajectories[:-1]]
    if calibration is not None:
        driven.append((calibration, 1))
    for path, repeats in driven:
        motion = Motion.of(hardware, path)
        seen = motion.observed()
        common, varying = columns(motion)
        disturbed = [] if rng is None or laboratory.quiet else _disturbed(motion, seen, laboratory, rng)
        whiten = Whitening.of(hardware, seen, *rates, disturbed)
        stacked = whiten(np.stack(list(common.values()), axis=2))
        settings.append(Setting(motion, whiten, repeats, stacked, own_columns(whiten, seen, varying)))
        readings.append(seen)
        sensitivities.append(common)
    return Bench(
        hardware,
        tuple(trajectories),
        calibration,
        rates,
        tuple(settings),
        tuple(readings),
        tuple(sensitivities),
        laboratory,
    )


def _disturbed(motion: Motion, seen: Array, laboratory: Laboratory, rng: np.random.Generator) -> list[Array]:
    """What realisations of a laboratory's noise change in the readings."""
    duration = float(motion.path.t[-1])
    drawn = (laboratory.disturbance(duration, rng) for _ in range(_REALISATIONS))
    return [motion.observed(extra=replace(NONE, disturbance=one)) - seen for one in drawn]


def beyond(
    bench: Bench, nominal: Hardware, rng: np.random.Generator, split: Split
) -> tuple[Hardware, list[dict[str, Any]]]:
    """Move one to three parameters beyond their uncertainty, far enough to be seen."""
    scale = {name: _sigma(nominal, name) for name in bench.columns[0]}
    names = [name for name, sigma in scale.items() if not any(word in name[0] for word in _KEPT)]
    for _ in range(100):
        count = int(rng.integers(1, 4))
        hardware, moved = bench.hardware, []
        total = [np.zeros_like(readings) for readings in bench.readings]
        for k in rng.permutation(len(names))[:count]:
            name = names[k]
            value = float(np.ravel(nominal[name[0]])[name[1]])
            sigmas = BEYOND_SIGMAS.draw(rng, split) * float(rng.choice([-1.0, 1.0]))
            if value > 0 and value + sigmas * scale[name] < 0.3 * value:
                sigmas = abs(sigmas)
            hardware = perturbed(
                hardware, name, value + sigmas * scale[name] - float(np.ravel(hardware[name[0]])[name[1]])
            )
            element = f"[{name[1]}]" if np.ndim(nominal[name[0]]) else ""
            moved.append({"name": f"{_dotted(name[0])}{element}", "sigmas": sigmas})
            total = [part + sigmas * c[name] for part, c in zip(total, bench.columns, strict=True)]
        seen = strength(bench.settings, [s.whiten(part) for s, part in zip(bench.settings, total, strict=True)])
        if seen.rho > _LEAST_BEYOND:
            return hardware, moved
    raise ValueError("no parameter of this rig can be seen to be off")


def _sigma(hardware: Hardware, name: Named) -> float:
    return float(np.ravel(hardware.sigmas[name[0]])[name[1]])


def _dotted(name: str) -> str:
    """The name that the campaign's parameter files give."""
    head, dot, last = name.rpartition(".drive.")
    return f"{head}.drive.parameters.{last}" if dot else name


def scaled(bench: Bench, effect: Effect, level: float) -> tuple[Effect, Strength, float] | None:
    """Find the amplitude at which an effect has the strength asked for, or else a weaker one of LEVELS.

    Returns effect, strength and level; None where the effect stays below the weakest level, or known parameters
    absorb it.
    """
    most = effect.physics.most
    amplitude, low, high = effect.physics.first, 0.0, np.inf
    nearest: tuple[Effect, Strength] | None = None
    power, tried = 1.0, (0.0, 0.0)  # rho_eff goes with this power of the amplitude
    for _ in range(_SEARCH):
        effect = effect.scaled(amplitude)
        try:
            found = bench.strength([effect])
        except FloatingPointError:
            # More than the rig can stand with.
            most = amplitude = 0.5 * amplitude
            continue
        if amplitude >= most and found.rho_eff < level:
            reached = [weaker for weaker in LEVELS if weaker < found.rho_eff]
            if not reached:
                return None
            level, low = max(reached), 0.0
        ratio = level / max(found.rho_eff, 1e-3)
        if found.kappa > _ABSORBED:
            return None
        if abs(np.log(ratio)) < _NEAR:
            return effect, found, level
        if nearest is None or abs(np.log(level / found.rho_eff)) < abs(np.log(level / nearest[1].rho_eff)):
            nearest = effect, found
        if ratio > 1:
            low = max(low, amplitude)
        else:
            high = min(high, amplitude)
        if min(tried) > 0 and amplitude != tried[0]:
            power = np.log(found.rho_eff / tried[1]) / np.log(amplitude / tried[0])
        tried = (amplitude, found.rho_eff)
        amplitude = min(float(amplitude * ratio ** (1 / np.clip(power, 0.4, 3.0))), most)
        if not low < amplitude < high:
            amplitude = most if np.isinf(high) else float(np.sqrt(max(low, 0.1 * high) * high))
    if nearest is None or abs(np.log(level / nearest[1].rho_eff)) > _FAR:
        return None
    return *nearest, level
