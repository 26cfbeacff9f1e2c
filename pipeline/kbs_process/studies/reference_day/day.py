"""The day judged: where its sections end, and how well the antenna points and how quietly it turns in each."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from kbs_process.campaign.config import Campaign, PointingRequirement
from kbs_process.campaign.mission import Day, boundaries
from kbs_process.errors import ConfigError
from kbs_process.mission.planner import Plan
from kbs_process.reduction.analysis import bands_of, passband
from kbs_process.reduction.pointing import estimate
from kbs_process.results.pointing import PointingEstimate
from kbs_process.signals.grid import overlap
from kbs_process.signals.records import Mask, Signal
from kbs_process.stages import bandpass, pointing
from kbs_process.stages.bandpass import Band
from kbs_process.stages.pointing import PointingStatistics
from kbs_process.stages.to_cog import to_spacecraft
from kbs_process.stages.verdict import judge
from kbs_process.studies.reference_day.results import Judged, PublishedSection, Section, Torque

TORQUES = ("Tx", "Ty", "Tz")


@dataclass(frozen=True, slots=True, eq=False)
class Assessed:
    """The day as it is judged."""

    error: Signal  # joint angles less desired ones
    boresight: Signal  # cross-elevation, elevation, line of sight
    torques: dict[str, Signal]  # at the spacecraft's centre of mass, by the band's name, narrowest first
    sections: tuple[Section, ...]
    requirements: tuple[Judged, ...]
    whole: tuple[PointingEstimate, ...]  # of the boresight, over the day


def assess(campaign: Campaign, day: Day, planned: Plan, angle: Signal, wrench: Signal) -> Assessed:
    """Cut the day into its sections, take the statistics of each, and hold them against the limits."""
    angle, wrench = overlap(angle, wrench)
    error = pointing.error(angle, planned.t, planned.q)
    boresight = pointing.line_of_sight(error, angle.values[:, 1])
    torques = _torques(campaign, wrench)
    period = day.mission.orbit.nodal_period
    sections = []
    for entry, start, end in boundaries(day, planned):
        inside = (error.t >= start) & (error.t < end)
        azimuth, elevation = map(estimate, pointing.statistics(error, period, day.smoothing, inside))
        sections.append(
            Section(
                name=entry.name,
                start_s=start,
                end_s=end,
                ends_with=entry.until,
                modes=_modes(planned, start, end),
                greatest_rate=_rate(planned, start, end),
                azimuth=azimuth,
                elevation=elevation,
                torques=tuple(_greatest(band, signal, inside) for band, signal in torques.items()),
                published=PublishedSection(**entry.published.model_dump(), end_s=entry.near)
                if entry.published
                else None,
            )
        )
    joints = pointing.statistics(error, period, day.smoothing)
    offsets = [float(joint.encoder.offset.sigma) if joint.encoder else 0.0 for joint in campaign.rig.joints]
    return Assessed(
        error=error,
        boresight=boresight,
        torques={band.name: signal for band, signal in torques.items()},
        sections=tuple(sections),
        requirements=(
            *(_pointing_judged(one, sections, joints, offsets) for one in day.requirements),
            *_torque_judged(campaign, sections),
        ),
        whole=tuple(map(estimate, pointing.statistics(boresight, period, day.smoothing))),
    )


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


def _greatest(band: Band, signal: Signal, inside: Mask) -> Torque:
    columns = [signal.channels.index(channel) for channel in TORQUES]
    x = np.where((signal.valid & inside)[:, None], np.abs(signal.values[:, columns]), 0.0)
    row, column = np.unravel_index(int(np.argmax(x)), x.shape)
    return Torque(
        band=band.name,
        label=f"up to {passband(band, signal.rate)[1]:g} Hz",
        value=float(x[row, column]),
        axis=TORQUES[int(column)],
        time_s=float(signal.t[row]),
    )


def _pointing_judged(
    requirement: PointingRequirement,
    sections: Sequence[Section],
    joints: Sequence[PointingStatistics],
    offsets: Sequence[float],
) -> Judged:
    """Judge the worst section and axis; slow variation over an orbit needs the whole day.

    What the encoder's alignment leaves unknown counts as uncertainty of the bias.
    """
    candidates: list[tuple[float, float, str]] = []
    if requirement.statistic == "orbit":
        candidates = [(one.orbit, one.orbit_sigma, f"{one.axis}, whole day") for one in joints]
    else:
        for section in sections:
            for one, offset in zip((section.azimuth, section.elevation), offsets, strict=True):
                value, sigma = getattr(one, requirement.statistic), getattr(one, f"{requirement.statistic}_sigma")
                sigma = float(np.hypot(sigma, offset if requirement.statistic == "bias" else 0.0))
                candidates.append((abs(value), sigma, f"{one.axis}, section {section.name}"))
    value, sigma, where = max(candidates)
    return Judged(
        name=requirement.name,
        statistic=requirement.statistic,
        limit=requirement.limit,
        unit="rad",
        value=value,
        sigma=sigma,
        verdict=judge(value, sigma, requirement.limit),
        where=where,
        source=requirement.source,
    )


def _torque_judged(campaign: Campaign, sections: Sequence[Section]) -> Iterator[Judged]:
    """Judge peaks of torque in the narrowest band; the campaign's other requirements are not about a day's peaks."""
    for requirement in campaign.requirements:
        if (requirement.quantity, requirement.frame, requirement.statistic) != ("torque", "S", "peak"):
            continue
        section = max(sections, key=lambda one: one.torques[0].value)
        worst = section.torques[0]
        yield Judged(
            name=requirement.name,
            statistic=f"peak, {worst.label}",
            limit=requirement.limit,
            unit=requirement.unit,
            value=worst.value,
            sigma=0.0,
            verdict=judge(worst.value, 0.0, requirement.limit),
            where=f"{worst.axis}, section {section.name}, {worst.time_s:.1f} s",
            source=requirement.source,
        )
