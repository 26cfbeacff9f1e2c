"""What makes the loudest torque above the bands: at what frequency it is, and what it is without each effect."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import msgspec
import numpy as np
from scipy.linalg import eigh

from kbs_process.campaign.config import Campaign
from kbs_process.mission.planner import Plan
from kbs_process.plant.laws import select
from kbs_process.plant.linear.linearise import linearise
from kbs_process.rig.model import Rig, substitute
from kbs_process.signals.records import Array, Signal
from kbs_process.studies.reference_day.day import Assessed
from kbs_process.studies.reference_day.results import Cause, Torque, Without
from kbs_process.studies.reference_day.units import Reached

WINDOW = 4.0  # s about the moment
RINGS = 0.1  # a mode responds within this share of its frequency
_FINER = 1000.0  # microsteps, than the rig's


def without_each(campaign: Campaign) -> dict[str, Rig]:
    """Return the rig without each thing that may make a torque, by its name: effects that can be absent, and steps."""
    driven = [joint for joint in campaign.rig.joints if joint.drive is not None]
    changes: dict[str, dict[str, Array | float]] = {"microsteps": {}, "codes of the encoders": {}}
    for joint in driven:
        assert joint.drive is not None
        steps = joint.drive.steps_per_turn
        changes["microsteps"][steps.name] = _FINER * float(steps)
        if joint.encoder is not None:
            changes["codes of the encoders"][joint.encoder.step.name] = 0.0
        for effect in select(campaign.effects):
            has = [joint.drive.parameters[one.name] for one in effect.amplitudes if one.name in joint.drive.parameters]
            for quantity in has:
                changes.setdefault(effect.name.replace("_", " "), {})[quantity.name] = 0.0
    return {name: substitute(campaign.rig, change) for name, change in changes.items() if change}


def with_causes(
    campaign: Campaign, planned: Plan, torque: Signal, found: Assessed, without: Mapping[str, Reached | None]
) -> Assessed:
    """Return the day with the cause of each section's widest torque; `without` has the days of `without_each`."""
    least = 0.4 * found.error.rate  # where the passband of the working rate ends
    sections = []
    for index, section in enumerate(found.sections):
        *narrow, widest = section.torques
        left = {name: day.sections[index].torques[-1].rms for name, day in without.items() if day is not None}
        told = _cause(campaign, planned, torque, widest, least, left)
        sections.append(
            msgspec.structs.replace(section, torques=(*narrow, msgspec.structs.replace(widest, cause=told)))
        )
    return replace(found, sections=tuple(sections))


def _cause(
    campaign: Campaign, planned: Plan, torque: Signal, widest: Torque, least: float, left: Mapping[str, float]
) -> Cause:
    """Return what frequency above `least`, Hz, is strongest about a moment, and what is there."""
    inside = np.abs(torque.t - widest.time_s) <= 0.5 * WINDOW
    x = torque.column(widest.axis)[inside]
    f = np.fft.rfftfreq(len(x), torque.dt)
    power = np.where(f >= least, np.abs(np.fft.rfft(np.hanning(len(x)) * (x - x.mean()))) ** 2, 0.0)
    loudest = float(f[int(np.argmax(power))])
    modes = _modes(campaign, planned.q[int(np.searchsorted(planned.t, widest.time_s).clip(0, len(planned.t) - 1))])
    mode = float(min(modes, key=lambda one: abs(one - loudest)))
    return Cause(
        frequency_Hz=loudest,
        mode_Hz=mode if abs(mode - loudest) <= RINGS * mode else None,
        without=tuple(Without(name=name, value=left[name]) for name in sorted(left, key=lambda name: left[name])),
    )


def _modes(campaign: Campaign, pose: Array) -> Array:
    """Natural frequencies, Hz, of outputs and rotors, the fields held."""
    system = linearise(campaign.rig, select(campaign.effects), pose)
    return np.asarray(np.sqrt(np.abs(eigh(system.K, system.M, eigvals_only=True))) / (2.0 * np.pi))
