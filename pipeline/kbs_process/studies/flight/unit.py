"""One flight unit in orbit: the rig as it flies, its run along commands, and the statistics that it is judged by."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from kbs_process.campaign.config import Campaign, PointingRequirement, Requirement
from kbs_process.errors import ConfigError, SimulationError
from kbs_process.plant.predict import Schedule, predict
from kbs_process.reduction.analysis import bands_of
from kbs_process.reduction.judging import band_of
from kbs_process.rig.model import Amplifier, Quantity, Rig
from kbs_process.signals.records import WRENCH_CHANNELS, Array, Run
from kbs_process.stages import bandpass, pointing
from kbs_process.stages.align.condense import CondenseSettings, condense
from kbs_process.stages.bandpass import Band
from kbs_process.stages.gravity.equation import encoder_offsets
from kbs_process.stages.to_cog import to_spacecraft

BINS = 400  # of the histories' envelopes
_RATE = 100.0  # Hz, of the simulated wrench: its amplifier lets nothing alias into the bands


@dataclass(frozen=True, slots=True)
class Judged:
    """A requirement on the disturbance in a band, or without a band on pointing, and the channels it is judged on."""

    requirement: Requirement | PointingRequirement
    band: Band | None
    channels: tuple[str, ...]

    @property
    def unit(self) -> str:
        """Of statistics, histories and limit; pointing is specified in degrees."""
        return "deg" if isinstance(self.requirement, PointingRequirement) else self.requirement.unit

    @property
    def limit(self) -> float:
        limit = self.requirement.limit
        return float(np.degrees(limit)) if isinstance(self.requirement, PointingRequirement) else limit

    @property
    def frame(self) -> str:
        return "joint" if isinstance(self.requirement, PointingRequirement) else self.requirement.frame


@dataclass(frozen=True, slots=True, eq=False)
class Job:
    """One unit to be flown."""

    rig: Rig
    effects: tuple[str, ...]
    schedule: Schedule
    duration_s: float
    working_rate_Hz: float
    judged: tuple[Judged, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Flown:
    """What is kept of one unit."""

    statistics: tuple[Array, ...]  # a requirement each: (channels,)
    envelopes: tuple[Array, ...]  # likewise: (BINS, 2, channels), least and greatest in each stretch of time


def in_orbit(rig: Rig) -> Rig:
    """Return the rig as it flies: weightless, its base rigid in a spacecraft that does not yield.

    The low-pass before the samples stays what it was in the test, or is a second-order one at a fifth of the rate.
    """
    bench = rig.transducer
    weightless = replace(rig.gravity, value=np.zeros(()), sigma=np.zeros(()), source="in orbit")
    upright = replace(bench.tilt, value=np.zeros(2), sigma=np.zeros(2), source="in orbit")
    corner = Quantity("transducer.amplifier.corner", np.array(0.2 * _RATE), "Hz", np.zeros(()), "sampling")
    return replace(
        rig,
        gravity=weightless,
        transducer=replace(
            bench, stiffness=None, damping=None, tilt=upright, amplifier=bench.amplifier or Amplifier(2, corner)
        ),
    )


def fly(job: Job) -> Flown | None:
    """Simulate one unit; None where its equations have no finite solution."""
    corner = job.rig.transducer.amplifier.corner if job.rig.transducer.amplifier else None
    rate = max(_RATE, 5.0 * float(corner)) if corner is not None else _RATE
    try:
        blocks = predict(
            job.rig,
            job.effects,
            job.schedule,
            rate_Hz=rate,
            angle_rate_Hz=rate,
            duration_s=job.duration_s,
            quantise=False,
        )
        streams = ((key, block) for key, block in blocks if key != "field")
        channels = {"wrench": WRENCH_CHANNELS, "angle": job.rig.joint_names}
        run = condense(
            "flight", streams, channels, CondenseSettings(working_rate_Hz=job.working_rate_Hz), keep_spikes=True
        )
    except SimulationError:
        return None
    found = [_found(job, run, one) for one in job.judged]
    return Flown(tuple(statistic for statistic, _ in found), tuple(_envelope(x) for _, x in found))


def _found(job: Job, run: Run, one: Judged) -> tuple[Array, Array]:
    """Return a requirement's statistic (channels,) and the history (n, channels) that it is one of."""
    if isinstance(one.requirement, PointingRequirement):
        return _pointing(job, run, one.requirement)
    assert run.wrench is not None and one.band is not None
    signal = bandpass.apply(run.wrench, one.band)
    if one.requirement.frame == "S":
        assert job.rig.spacecraft is not None  # or the requirement would have been refused
        signal = to_spacecraft(signal, job.rig.spacecraft)
    columns = [signal.channels.index(channel) for channel in one.channels]
    x = np.where(signal.valid[:, None], signal.values[:, columns], 0.0)
    if one.requirement.statistic == "rms":
        return np.asarray(np.sqrt(np.sum(x**2, axis=0) / signal.valid.sum())), x
    return np.asarray(np.max(np.abs(x), axis=0)), x


def _pointing(job: Job, run: Run, requirement: PointingRequirement) -> tuple[Array, Array]:
    """True angle less the desired one, deg: what the encoder's offset hides from the loop is in it."""
    assert run.angle is not None
    true = run.angle.derive(run.angle.values - encoder_offsets(job.rig), "encoder's offset taken out")
    error = pointing.error(true, job.schedule.t, job.schedule.position)
    every = pointing.statistics(error, period=job.duration_s, smoothing=job.duration_s)
    statistic = np.abs([getattr(one, requirement.statistic) for one in every])
    return np.degrees(statistic), np.degrees(np.where(error.valid[:, None], error.values, 0.0))


def _envelope(x: Array) -> Array:
    edges = np.linspace(0, len(x), min(BINS, len(x)) + 1).astype(np.int64)[:-1]
    return np.stack([np.minimum.reduceat(x, edges), np.maximum.reduceat(x, edges)], axis=1)


def judged_by(campaign: Campaign) -> tuple[Judged, ...]:
    """Return the campaign's requirements on the disturbance, then those on the flight model's pointing.

    Raises ConfigError where there is none, or where one has to be met in a place that nobody knows.
    """
    judged = tuple(_judged(campaign, requirement) for requirement in campaign.requirements)
    judged += tuple(Judged(requirement, None, campaign.rig.joint_names) for requirement in campaign.flight_pointing)
    if not judged:
        raise ConfigError("the campaign states no requirement", where=campaign.name, remedy="add [[requirement]]")
    return judged


def _judged(campaign: Campaign, requirement: Requirement) -> Judged:
    if requirement.frame == "S" and campaign.rig.spacecraft is None:
        raise ConfigError(
            "is stated at the spacecraft's centre of mass, and nothing says where that is",
            where=f"{campaign.name}: {requirement.name}",
            remedy="give [spacecraft] in the parameter files",
        )
    return Judged(requirement, band_of(requirement, bands_of(campaign.bands)), requirement.channels)
