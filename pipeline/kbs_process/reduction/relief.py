"""What belongs to the rig and not to the article: the wrench of cords that the model knows, taken from recordings."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from kbs_process.campaign.config import Campaign, RecordingEntry
from kbs_process.plant.effect import Effect
from kbs_process.plant.external import external_efforts, external_wrench, pulls_at_rest
from kbs_process.plant.laws import select
from kbs_process.plant.moved import added_loads
from kbs_process.rig.model import Rig, substitute
from kbs_process.signals.records import Array, Run, Signal
from kbs_process.stages.motion import Motion

_POINTS = 300  # of a recording at which the cords' uncertainty is computed, linear in between
_SHARED = (".origin", ".misalignment", "transducer.tilt", "transducer.stiffness")  # where a cord pulls at what


def forces_in(campaign: Campaign, entry: RecordingEntry) -> tuple[Effect, ...]:
    """Return the forces of the laboratory that acted in a recording, at rest too."""
    return tuple(effect for effect in select(campaign.acting(entry)) if pulls_at_rest(effect))


def relieved(campaign: Campaign, entry: RecordingEntry, run: Run, motion: Motion) -> Run:
    """Return the run less the static wrench of the laboratory's forces at the measured angles."""
    forces = forces_in(campaign, entry)

    def less(signal: Signal | None) -> Signal | None:
        return None if signal is None else without_forces(signal, campaign.rig, forces, motion.q)

    return replace(run, wrench=less(run.wrench), effort=less(run.effort)) if forces else run


def in_motion(campaign: Campaign, entry: RecordingEntry, motion: Motion, channels: Sequence[str], rig: Rig) -> Array:
    """(n, channels) what the model's effects add to the loads of a rig that its motion drives.

    Without what forces of the laboratory exert at rest, which is taken from its recordings; zero of any other rig.
    """
    effects = select(campaign.acting(entry))
    if campaign.drive != "motion" or not effects:
        return np.zeros((len(motion), len(channels)))
    added = added_loads(rig, effects, motion.q, motion.qd, motion.dt)[:, rig.loads.index(channels)]
    forces = forces_in(campaign, entry)
    return added - _pull(rig, forces, motion.q, channels) if forces else added


def without_effects(campaign: Campaign, entry: RecordingEntry, motion: Motion, loads: Signal, rig: Rig) -> Signal:
    """Return loads less what the model's effects add to them along a measured motion, as a rig reads it."""
    added = in_motion(campaign, entry, motion, loads.channels, rig)
    return loads.derive(loads.values - added, "effects of the model removed") if added.any() else loads


def without_forces(loads: Signal, rig: Rig, forces: tuple[Effect, ...], q: Array) -> Signal:
    """Return loads (wrench, efforts) less the static ones of `forces` at angles q (n, joints)."""
    if not forces:
        return loads
    pull = exerted(loads, rig, forces, q)
    return loads.derive(loads.values - pull.values, f"{pull.history[-1]} removed")


def exerted(loads: Signal, rig: Rig, forces: tuple[Effect, ...], q: Array) -> Signal:
    """Return the static loads of `forces` at angles q (n, joints), on the channels of `loads`."""
    names = ", ".join(effect.name for effect in forces)
    return loads.derive(_pull(rig, forces, q, loads.channels), f"static wrench of {names}")


def errors(loads: Signal, rig: Rig, forces: tuple[Effect, ...], q: Array) -> Iterator[Signal]:
    """Yield the histories of one-sigma errors of `forces`, one for each uncertain number that they depend on.

    These are their own, where the joints are, and how the plate gives way. Histories are about their mean: a
    recording's own constant takes that up.
    """
    if not forces:
        return
    at = np.unique(np.linspace(0, len(q) - 1, min(len(q), _POINTS)).astype(np.int64))
    own = tuple(f"external.{effect.name}." for effect in forces)
    nominal = _pull(rig, forces, q[at], loads.channels)
    for name, quantity in rig.quantities().items():
        if not name.startswith(own) and not name.endswith(_SHARED):
            continue
        for element in np.ndindex(quantity.shape):
            if not quantity.sigma[element] > 0.0:
                continue
            moved = quantity.value.copy()
            moved[element] += quantity.sigma[element]
            change = _pull(substitute(rig, {name: moved}), forces, q[at], loads.channels) - nominal
            history = np.stack([np.interp(np.arange(len(q)), at, column) for column in change.T], axis=1)
            yield loads.derive(history - history.mean(axis=0), f"error of {name}")


def _pull(rig: Rig, forces: tuple[Effect, ...], q: Array, channels: Sequence[str]) -> Array:
    """(n, channels) what forces add to the loads at rest: the wrench, and the efforts of joints as these are read."""
    efforts = external_efforts(rig, forces, q, np.zeros_like(q))
    gains = [1.0 if joint.effort is None else float(joint.effort.gain) for joint in rig.joints]
    whole = np.hstack([external_wrench(rig, forces, q), efforts / np.array(gains)])
    return np.asarray(whole[:, rig.loads.index(channels)], dtype=np.float64)
