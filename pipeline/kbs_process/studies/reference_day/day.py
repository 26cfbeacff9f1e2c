"""The sections of a reference day: where they end, and how well the antenna points and how quietly it turns in each."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kbs_process.campaign.config import Campaign, PointingRequirement
from kbs_process.campaign.formats.mission_file import SectionEntry
from kbs_process.campaign.mission import Day
from kbs_process.errors import ConfigError
from kbs_process.mission.planner import Plan
from kbs_process.reduction.analysis import bands_of, passband
from kbs_process.signals.grid import overlap
from kbs_process.signals.records import Mask, Signal
from kbs_process.stages import bandpass, pointing
from kbs_process.stages.bandpass import Band
from kbs_process.stages.pointing import PointingStatistics
from kbs_process.stages.to_cog import to_spacecraft
from kbs_process.stages.verdict import Judgement, judge

TORQUES = ("Tx", "Ty", "Tz")


@dataclass(frozen=True, slots=True)
class Extreme:
    """Greatest torque of a section in one band."""

    band: Band
    label: str
    value: float
    axis: str
    time: float


@dataclass(frozen=True, slots=True)
class Section:
    """A section, from `start` to `end` s, and what was found in it."""

    entry: SectionEntry
    start: float
    end: float
    modes: tuple[str, ...]
    greatest_rate: float  # rad/s
    statistics: tuple[PointingStatistics, ...]  # azimuth, elevation
    torques: tuple[Extreme, ...]  # narrowest band first


@dataclass(frozen=True, slots=True)
class Verdict:
    """The worst value of a statistic over sections and axes, against its limit."""

    requirement: PointingRequirement
    value: float  # rad
    sigma: float
    verdict: Judgement
    where: str


@dataclass(frozen=True, slots=True, eq=False)
class Assessed:
    """The day as it is judged."""

    error: Signal  # joint angles less desired ones
    boresight: Signal  # cross-elevation, elevation, line of sight
    torques: tuple[Signal, ...]  # at the spacecraft's centre of mass, a band each, narrowest first
    sections: tuple[Section, ...]
    verdicts: tuple[Verdict, ...]
    whole: tuple[PointingStatistics, ...]  # of the boresight, over the day
    joints: tuple[PointingStatistics, ...]  # of the joints, over the day


def assess(campaign: Campaign, day: Day, planned: Plan, angle: Signal, wrench: Signal) -> Assessed:
    """Cut the day into its sections and take the statistics of each."""
    angle, wrench = overlap(angle, wrench)
    error = pointing.error(angle, planned.t, planned.q)
    boresight = pointing.line_of_sight(error, angle.values[:, 1])
    torques = _torques(campaign, wrench)
    period = day.mission.orbit.nodal_period
    sections = []
    for entry, start, end in boundaries(day, planned):
        inside = (error.t >= start) & (error.t < end)
        sections.append(
            Section(
                entry=entry,
                start=start,
                end=end,
                modes=_modes(planned, start, end),
                greatest_rate=_rate(planned, start, end),
                statistics=pointing.statistics(error, period, day.smoothing, inside),
                torques=tuple(_extreme(band, signal, inside) for band, signal in torques.items()),
            )
        )
    joints = pointing.statistics(error, period, day.smoothing)
    offsets = [float(joint.encoder.offset.sigma) if joint.encoder else 0.0 for joint in campaign.rig.joints]
    return Assessed(
        error=error,
        boresight=boresight,
        torques=tuple(torques.values()),
        sections=tuple(sections),
        verdicts=tuple(_verdict(one, sections, joints, offsets) for one in day.requirements),
        whole=pointing.statistics(boresight, period, day.smoothing),
        joints=joints,
    )


def boundaries(day: Day, planned: Plan) -> list[tuple[SectionEntry, float, float]]:
    """Return each section with its start and end: the event of its kind that is nearest to the time it is given.

    Raises ConfigError where there is no such event after the section's start.
    """
    found: list[tuple[SectionEntry, float, float]] = []
    start = 0.0
    for index, entry in enumerate(day.sections):
        times = [event.t for event in planned.events if event.kind == entry.until and event.t > start]
        if entry.until == "end":
            times = [day.mission.duration]
        if not times:
            raise ConfigError(
                f"section {entry.name} ends with '{entry.until}', and after {start:.0f} s there is none",
                where=f"{day.path}: section[{index + 1}].until",
                remedy="choose another event: the trajectory has "
                + ", ".join(f"{event.kind} at {event.t:.0f} s" for event in planned.events),
            )
        end = min(times, key=lambda t: abs(t - entry.near))
        found.append((entry, start, end))
        start = end
    return found


def _modes(planned: Plan, start: float, end: float) -> tuple[str, ...]:
    inside = [
        f"{phase.mode} {phase.relay}"
        for phase in planned.phases
        if planned.t[phase.start] < end - 1.0 and planned.t[phase.end - 1] > start + 1.0
    ]
    return tuple(name for name, _ in itertools.groupby(inside))


def _rate(planned: Plan, start: float, end: float) -> float:
    inside = (planned.t >= start) & (planned.t <= end)
    t, q = planned.t[inside], planned.q[inside]
    return float(np.abs(np.diff(q, axis=0) / np.diff(t)[:, None]).max())


def _torques(campaign: Campaign, wrench: Signal) -> dict[Band, Signal]:
    """Return the wrench at the spacecraft's centre of mass in every band, narrowest first."""
    spacecraft = campaign.rig.spacecraft
    if spacecraft is None:
        raise ConfigError(
            "nothing says where the spacecraft's centre of mass is",
            where=campaign.name,
            remedy="describe [spacecraft] in a parameter file",
        )
    unfiltered, *bands = bands_of(campaign.bands)
    return {band: to_spacecraft(bandpass.apply(wrench, band), spacecraft) for band in (*bands, unfiltered)}


def _extreme(band: Band, signal: Signal, inside: Mask) -> Extreme:
    columns = [signal.channels.index(channel) for channel in TORQUES]
    x = np.where((signal.valid & inside)[:, None], np.abs(signal.values[:, columns]), 0.0)
    row, column = np.unravel_index(int(np.argmax(x)), x.shape)
    label = f"up to {passband(band, signal.rate)[1]:g} Hz"
    return Extreme(band, label, float(x[row, column]), TORQUES[int(column)], float(signal.t[row]))


def _verdict(
    requirement: PointingRequirement,
    sections: Sequence[Section],
    joints: Sequence[PointingStatistics],
    offsets: Sequence[float],
) -> Verdict:
    """Judge the worst section and axis; slow variation over an orbit needs the whole day.

    What the encoder's alignment leaves unknown counts as uncertainty of the bias.
    """
    candidates: list[tuple[float, float, str]] = []
    if requirement.statistic == "orbit":
        candidates = [(one.orbit, one.orbit_sigma, f"{one.axis}, whole day") for one in joints]
    else:
        for section in sections:
            for one, offset in zip(section.statistics, offsets, strict=True):
                value, sigma = {
                    "bias": (abs(one.bias), float(np.hypot(one.bias_sigma, offset))),
                    "random": (one.random, one.random_sigma),
                    "percentile": (one.percentile, one.percentile_sigma),
                }[requirement.statistic]
                candidates.append((value, sigma, f"{one.axis}, section {section.entry.name}"))
    value, sigma, where = max(candidates)
    return Verdict(requirement, value, sigma, judge(value, sigma, requirement.limit), where)
