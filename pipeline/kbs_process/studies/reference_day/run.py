"""The reference day: plan it from the orbit, fly it with the plant, and hold pointing and torque against the limits."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from kbs_process.campaign.config import Campaign
from kbs_process.campaign.mission import Day, load_day
from kbs_process.mission import orbit
from kbs_process.mission.planner import Plan, plan
from kbs_process.progress import Progress
from kbs_process.report.build import publish
from kbs_process.report.prose import Prose
from kbs_process.results import provenance
from kbs_process.results.outcome import Outcome
from kbs_process.results.records import Conclusion, Constant
from kbs_process.results.store import writing
from kbs_process.stages.to_cog import ASSUMPTION
from kbs_process.stages.verdict import COVERAGE
from kbs_process.studies.reference_day.day import Assessed, assess
from kbs_process.studies.reference_day.discussion import discussion
from kbs_process.studies.reference_day.files import write_tables
from kbs_process.studies.reference_day.flying import fly
from kbs_process.studies.reference_day.report import DOCUMENT
from kbs_process.studies.reference_day.results import Geometry, Judged, Phase, ReferenceDayResults

_SAYS = Prose("kbs_process.studies.reference_day", "notes")


def simulate_day(campaign: Campaign, target: Path, *, progress: Progress, pdf: bool | None = None) -> Outcome:
    """Plan, fly and judge the campaign's reference day; put the results in `target`, in one step."""
    campaign = replace(campaign, recordings=())  # a day is planned: recordings of a test need not be there
    day = load_day(campaign)
    with writing(target) as folder:
        with progress.task("Planning the trajectory"):
            planned = plan(day.mission, day.lead)
        with progress.task(f"Flying {day.mission.duration:.0f} s") as task:
            flown = fly(campaign, planned, day.mission.duration, task.update)
        with progress.task("Judging pointing and torque"):
            assessed = assess(campaign, day, planned, flown.angle, flown.wrench)
        with progress.task("Writing the report"):
            write_tables(folder, planned, assessed)
            return publish(folder, target, _results(campaign, day, planned, assessed), DOCUMENT, pdf)


def _results(campaign: Campaign, day: Day, planned: Plan, found: Assessed) -> ReferenceDayResults:
    return ReferenceDayResults(
        name=campaign.name,
        title=campaign.title,
        article=campaign.article,
        verdict=_conclusion(found.requirements),
        provenance=provenance.made("reference-day", campaign.folder, (*campaign.files, day.path)),
        geometry=_geometry(day, planned),
        phases=tuple(
            Phase(
                mode=phase.mode,
                relay=phase.relay,
                start_s=float(planned.t[phase.start]),
                end_s=float(planned.t[phase.end - 1]),
            )
            for phase in planned.phases
        ),
        sections=found.sections,
        requirements=found.requirements,
        boresight=found.whole,
        discussion=tuple(discussion(campaign.rig, found.sections)),
        parameters=(*_constants(day), *provenance.constants(campaign.rig)),
        notes=(*map(_SAYS, ("orbit", "error", "uncertainty", "peaks")), ASSUMPTION),
    )


def _conclusion(judged: Sequence[Judged]) -> Conclusion:
    if not judged:
        return Conclusion(status="none", sentence="The mission states no requirement.")
    words = {"pass": "All requirements are met", "undecided": "Undecided", "fail": "A requirement is not met"}
    worst = max(judged, key=lambda one: ([*words].index(one.verdict), one.value / one.limit))
    value, sigma, limit, unit = _shown(worst)
    sentence = (
        f"{words[worst.verdict]}. Nearest to its limit: {worst.name}, {value:.4g} +- {COVERAGE * sigma:.2g} {unit} "
        f"(k = {COVERAGE:g}; {worst.where}); limit {limit:g} {unit}."
    )
    return Conclusion(status=worst.verdict, sentence=sentence)


def _shown(one: Judged) -> tuple[float, float, float, str]:
    """Value, sigma and limit in the unit that requirements on pointing are written in."""
    if one.unit != "rad":
        return one.value, one.sigma, one.limit, one.unit
    return (float(np.degrees(one.value)), float(np.degrees(one.sigma)), round(float(np.degrees(one.limit)), 9), "deg")


def _geometry(day: Day, planned: Plan) -> Geometry:
    rate, acceleration = planned.extremes(day.mission.cycle)
    satellite = orbit.satellite(day.mission.orbit)
    azimuth, elevation = ((float(q.min()), float(q.max())) for q in planned.q.T)
    return Geometry(
        epoch=day.mission.orbit.epoch.isoformat(),
        nodal_period_s=day.mission.orbit.nodal_period,
        semi_major_axis_m=float(satellite.a) * orbit.EARTH_RADIUS,
        node_rate=float(satellite.nodedot) / 60.0,
        greatest_rate=float(rate.max()),
        greatest_acceleration=float(acceleration.max()),
        rate_limit=day.mission.limits.rate,
        acceleration_limit=day.mission.limits.acceleration,
        azimuth=azimuth,
        elevation=elevation,
    )


def _constants(day: Day) -> Iterator[Constant]:
    for one in day.quantities:
        yield Constant(
            name=f"mission.{one.name}",
            value=", ".join(f"{x:.9g}" for x in np.ravel(one.value)),
            unit=one.unit,
            sigma=", ".join(f"{x:.3g}" for x in np.ravel(one.sigma)),
            source=one.source,
        )
