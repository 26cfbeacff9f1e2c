"""Suspects of the catalogue against the residual of a rig that its motion drives.

The effort of a joint is its port: a suspect's torque along the measured motion is its signature, over the gain. Known
parameters are free beside every suspect; all are fitted to the campaign's fit recordings, and scored on the
held-out ones.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from kbs_process.plant.along import signals_of
from kbs_process.plant.effect import Port
from kbs_process.plant.laws import CATALOGUE
from kbs_process.plant.moved import reading, unit_torques
from kbs_process.plant.rigid import loads
from kbs_process.reduction.analysis import bands_of
from kbs_process.reduction.reading import read_run
from kbs_process.reduction.settings import motion_settings
from kbs_process.rig.model import substitute
from kbs_process.signals.averages import instants
from kbs_process.signals.records import Signal
from kbs_process.stages import bandpass, motion


@dataclass(frozen=True)
class Trial:
    """A recording of one joint: its motion, its effort, and the known parameters' sensitivities, all in one band."""

    role: str
    q: np.ndarray  # (n,)
    dt: float
    measured: np.ndarray  # (valid,) less the nominal rig's
    known: np.ndarray  # (valid, p)
    keep: np.ndarray  # (n,) valid samples


@dataclass(frozen=True)
class Law:
    """A suspect with its shape."""

    effect: object
    shape: tuple


class Screen:
    """A campaign's recordings in one of its bands."""

    def __init__(self, campaign, band, known):
        """`known`: (quantity, element) of the parameters that are refitted."""
        self.rig, (self.joint,) = campaign.rig, campaign.rig.joints
        self.band = next(one for one in bands_of(campaign.bands) if one.name == band)
        self.trials = [self._trial(campaign, entry, known) for entry in campaign.recordings]
        self._columns = {}

    def _trial(self, campaign, entry, known):
        run = read_run(campaign, entry)
        moved = motion.estimate(run, self.rig, motion_settings(campaign))

        def effort(rig):
            return loads(rig, moved.q, moved.qd, moved.qdd)[:, 6]

        nominal, slopes = effort(self.rig), []
        for name, element in known:
            quantity = self.rig.quantities()[name]
            value = quantity.value.copy()
            value[element] += quantity.sigma[element]
            slopes.append(effort(substitute(self.rig, {name: value})) - nominal)
        cut = self._cut(np.column_stack([run.effort.values[:, 0] - nominal, *slopes]), moved.dt)
        valid = run.effort.valid & moved.valid & cut.valid
        return Trial(entry.role, moved.q[:, 0], moved.dt, cut.values[valid, 0], cut.values[valid, 1:], valid)

    def _cut(self, values, dt):
        names = tuple(map(str, range(values.shape[1])))
        signal = Signal(0.0, dt, values, names, ("1",) * len(names), "joint", np.ones(len(values), bool))
        return bandpass.apply(signal, self.band)

    def columns(self, law):
        """Signature of a law in every trial, (valid, amplitudes)."""
        if law not in self._columns:
            self._columns[law] = [self._signature(law, trial) for trial in self.trials]
        return self._columns[law]

    def _signature(self, law, trial):
        torque = unit_torques(law.effect, self.joint, trial.q, dict(law.shape), trial.dt)
        return self._cut(reading(self.joint, law.effect.port) * instants(torque), trial.dt).values[trial.keep]

    def fit(self, laws):
        """Amplitudes of known parameters and laws over the trials to be fitted, and what is left: by role, rms."""
        A = [np.hstack([t.known, *(self.columns(law)[k] for law in laws)]) for k, t in enumerate(self.trials)]
        used = [k for k, trial in enumerate(self.trials) if trial.role == "fit"]
        x = np.linalg.lstsq(np.vstack([A[k] for k in used]), np.concatenate([self.trials[k].measured for k in used]))[0]
        left = {role: [] for role in ("fit", "held-out")}
        for trial, columns in zip(self.trials, A, strict=True):
            left[trial.role].append(float(np.sqrt(np.mean((trial.measured - columns @ x) ** 2))))
        return x, left

    def best(self, laws, taken):
        """Of several laws, the one that leaves least of the fitted trials beside those that are taken."""
        return min((law for law in laws if law not in taken), key=lambda law: self.fit([*taken, law])[1]["fit"][0])


def suspects(joint_order=(), **shapes):
    """Every law of the catalogue that acts within a joint and asks for its coordinate alone.

    `joint_order` are the orders to be tried, `shapes` other choices for parameters by name.
    """
    choices = {"joint_order": joint_order, **shapes}
    found = []
    for effect in CATALOGUE:
        if effect.port is not Port.JOINT_TORQUE or not set(signals_of(effect)) <= {"joint_angle"}:
            continue
        free = [entry for entry in effect.parameters if entry.role != "amplitude"]
        if any(entry.role == "shared" or (entry.over and entry.name not in choices) for entry in free):
            continue
        grids = [choices.get(entry.name) or entry.grid or (entry.prior.middle,) for entry in free]
        names = [entry.name for entry in free]
        found += [Law(effect, tuple(zip(names, point, strict=True))) for point in product(*grids)]
    return found
