"""The flight model's disturbance, with the uncertainty of its parameters: many units, one trajectory, in orbit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from kbs_process.campaign.config import Campaign, PointingRequirement, Requirement
from kbs_process.errors import ConfigError, SimulationError, did_you_mean
from kbs_process.plant.laws import select
from kbs_process.plant.predict import Schedule, predict
from kbs_process.plant.sampling import Uncertain, draw, uncertain, values
from kbs_process.progress import Progress
from kbs_process.reduction.analysis import bands_of
from kbs_process.reduction.commands import read_commands
from kbs_process.reduction.judging import band_of
from kbs_process.reduction.predicting import approached, schedule_of
from kbs_process.reduction.reading import read_run
from kbs_process.results.outcome import Outcome
from kbs_process.results.parallel import ordered_map
from kbs_process.rig.model import Amplifier, Quantity, Rig, substitute
from kbs_process.signals.records import WRENCH_CHANNELS, Array, Run
from kbs_process.stages import bandpass, pointing
from kbs_process.stages.align.condense import CondenseSettings, condense
from kbs_process.stages.bandpass import Band
from kbs_process.stages.to_cog import to_spacecraft
from kbs_process.studies.flight.files import write_flight

SAMPLES = 200
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


@dataclass(frozen=True, slots=True, eq=False)
class Flight:
    """All units: the nominal one, and one a row of `drawn` that could be simulated."""

    trajectory: str
    duration_s: float
    numbers: tuple[Uncertain, ...]
    drawn: Array  # (units, numbers)
    nominal: Flown
    units: tuple[Flown, ...]
    failed: int
    seed: int
    judged: tuple[Judged, ...]


def predict_flight(
    campaign: Campaign,
    trajectory: str | None,
    commands: Path | None,
    target: Path,
    *,
    samples: int,
    seed: int,
    progress: Progress,
    pdf: bool | None = None,
    processes: int | None = None,
) -> Outcome:
    """Fly `samples` units that the parameters' uncertainties allow along a trajectory."""
    if commands is not None:
        campaign = replace(campaign, recordings=())  # none is read: they need not be there
    rig = in_orbit(campaign.rig)
    judged = (
        *(_judged(campaign, requirement) for requirement in campaign.requirements),
        *(Judged(requirement, None, rig.joint_names) for requirement in campaign.flight_pointing),
    )
    if not judged:
        raise ConfigError("the campaign states no requirement", where=campaign.name, remedy="add [[requirement]]")
    name, schedule, sources = _commanded(campaign, trajectory, commands, progress)
    duration = float(schedule.t[-1])
    numbers = uncertain(rig, select(campaign.effects))
    drawn = draw(numbers, samples, seed)
    base = Job(rig, campaign.effects, schedule, duration, campaign.bands.working_rate, judged)
    jobs = [base, *(replace(base, rig=substitute(rig, values(rig, numbers, row))) for row in drawn)]
    with progress.task(f"Flying {samples} units along {name}") as task:
        nominal, *flown = ordered_map(fly, jobs, task.update, processes=processes)
    if nominal is None:
        raise SimulationError("the nominal flight unit cannot be simulated", where=campaign.name)
    kept = np.array([unit is not None for unit in flown], dtype=np.bool_)
    units = tuple(unit for unit in flown if unit is not None)
    flight = Flight(name, duration, numbers, drawn[kept], nominal, units, int(np.sum(~kept)), seed, judged)
    with progress.task("Writing the report"):
        return write_flight(campaign, rig, flight, sources, target, pdf)


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
        run = condense("flight", streams, channels, CondenseSettings(working_rate_Hz=job.working_rate_Hz))
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
    offset = np.array([float(joint.encoder.offset) if joint.encoder else 0.0 for joint in job.rig.joints])
    true = run.angle.derive(run.angle.values - offset, "encoder's offset taken out")
    error = pointing.error(true, job.schedule.t, job.schedule.position)
    every = pointing.statistics(error, period=job.duration_s, smoothing=job.duration_s)
    statistic = np.abs([getattr(one, requirement.statistic) for one in every])
    return np.degrees(statistic), np.degrees(np.where(error.valid[:, None], error.values, 0.0))


def _envelope(x: Array) -> Array:
    edges = np.linspace(0, len(x), min(BINS, len(x)) + 1).astype(np.int64)[:-1]
    return np.stack([np.minimum.reduceat(x, edges), np.maximum.reduceat(x, edges)], axis=1)


def _judged(campaign: Campaign, requirement: Requirement) -> Judged:
    if requirement.frame == "S" and campaign.rig.spacecraft is None:
        raise ConfigError(
            "is stated at the spacecraft's centre of mass, and nothing says where that is",
            where=f"{campaign.name}: {requirement.name}",
            remedy="give [spacecraft] in the parameter files",
        )
    prefix = "T" if requirement.quantity == "torque" else "F"
    channels = tuple(channel for channel in WRENCH_CHANNELS if channel.startswith(prefix))
    return Judged(requirement, band_of(requirement, bands_of(campaign.bands)), channels)


def _commanded(
    campaign: Campaign, trajectory: str | None, commands: Path | None, progress: Progress
) -> tuple[str, Schedule, Sequence[Path]]:
    """Return the trajectory's name and commands, from time zero on, and the file that they come from."""
    if commands is not None:
        schedule = read_commands(commands, campaign.rig.joint_names)
        return commands.stem, replace(schedule, t=schedule.t - schedule.t[0]), (commands,)
    first = {entry.trajectory: entry for entry in reversed(campaign.recordings)}
    name = trajectory or campaign.recordings[-1].trajectory
    if name not in first:
        raise ConfigError(f"there is no trajectory '{name}'", where=campaign.name, remedy=did_you_mean(name, first))
    with progress.task(f"Reading {first[name].name}"):
        run = read_run(campaign, first[name])
    schedule = schedule_of(run, campaign.rig)
    return name, approached(replace(schedule, field=None, encoder=None)), (first[name].path,)
