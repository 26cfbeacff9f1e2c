"""The day held against its limits, with what units differ by."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from kbs_process.campaign.config import Campaign, PointingRequirement
from kbs_process.campaign.mission import Day
from kbs_process.stages.verdict import judge
from kbs_process.studies.reference_day.day import Assessed
from kbs_process.studies.reference_day.results import Judged, Section
from kbs_process.studies.reference_day.units import Units, deviation

_OF_THE_BIAS = ("bias", "percentile")  # in which the encoder's alignment counts


def judged(campaign: Campaign, day: Day, found: Assessed, units: Units) -> tuple[Judged, ...]:
    """Judge every requirement on pointing, and those on the peak of the torque at the spacecraft."""
    offsets = [float(joint.encoder.offset.sigma) if joint.encoder else 0.0 for joint in campaign.rig.joints]
    return (
        *(_pointing(one, found, units, offsets) for one in day.requirements),
        *_torque(campaign, found.sections, units),
    )


def _pointing(requirement: PointingRequirement, found: Assessed, units: Units, offsets: Sequence[float]) -> Judged:
    """Judge the worst section and axis; slow variation over an orbit needs the whole day.

    Sigma holds the length of the section, what units differ by, and what the encoder's alignment leaves unknown: as
    much of the bias, and at most that of 95 %.
    """
    statistic = requirement.statistic
    candidates: list[tuple[float, float, str]] = []
    for j, offset in enumerate(offsets):
        whole = found.joints[j]
        if statistic == "orbit":
            among = deviation([one.joints[j].orbit for one in units.reached])
            candidates.append((whole.orbit, float(np.hypot(whole.orbit_sigma, among)), f"{whole.axis}, whole day"))
            continue
        for i, section in enumerate(found.sections):
            own = section.axes[j]
            among = deviation([getattr(one.sections[i].axes[j], statistic) for one in units.reached])
            unknown = offset if statistic in _OF_THE_BIAS else 0.0
            sigma = float(np.linalg.norm([getattr(own, f"{statistic}_sigma"), among, unknown]))
            candidates.append((abs(getattr(own, statistic)), sigma, f"{own.axis}, section {section.name}"))
    value, sigma, where = max(candidates)
    return Judged(
        name=requirement.name,
        statistic=statistic,
        limit=requirement.limit,
        unit="rad",
        value=value,
        sigma=sigma,
        verdict=judge(value, sigma, requirement.limit),
        where=where,
        source=requirement.source,
    )


def _torque(campaign: Campaign, sections: Sequence[Section], units: Units) -> Iterator[Judged]:
    """Judge peaks of torque in the narrowest band; the campaign's other requirements are not about a day's peaks."""
    for requirement in campaign.requirements:
        if (requirement.quantity, requirement.frame, requirement.statistic) != ("torque", "S", "peak"):
            continue
        section = max(sections, key=lambda one: one.torques[0].value)
        worst = section.torques[0]
        sigma = deviation([max(part.torques[0].value for part in one.sections) for one in units.reached])
        yield Judged(
            name=requirement.name,
            statistic=f"peak, {worst.label}",
            limit=requirement.limit,
            unit=requirement.unit,
            value=worst.value,
            sigma=sigma,
            verdict=judge(worst.value, sigma, requirement.limit),
            where=f"{worst.axis}, section {section.name}, {worst.time_s:.1f} s",
            source=requirement.source,
        )
