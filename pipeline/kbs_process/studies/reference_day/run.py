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
from kbs_process.plant.linear.modal import ModalTable
from kbs_process.plant.sampling import values
from kbs_process.progress import Progress
from kbs_process.report.build import publish
from kbs_process.report.prose import Prose
from kbs_process.report.text import count
from kbs_process.results import provenance
from kbs_process.results.outcome import Outcome
from kbs_process.results.records import Conclusion, Constant, Notice
from kbs_process.results.store import writing
from kbs_process.rig.model import substitute
from kbs_process.stages.to_cog import ASSUMPTION
from kbs_process.stages.verdict import COVERAGE
from kbs_process.studies.reference_day.causes import with_causes, without_each
from kbs_process.studies.reference_day.day import Assessed, assess
from kbs_process.studies.reference_day.discussion import discussion
from kbs_process.studies.reference_day.files import write_tables
from kbs_process.studies.reference_day.flying import fly
from kbs_process.studies.reference_day.report import DOCUMENT
from kbs_process.studies.reference_day.results import Geometry, Judged, Mast, Phase, ReferenceDayResults
from kbs_process.studies.reference_day.units import Units, draw_units, fly_days, units_of, with_spread
from kbs_process.studies.reference_day.verdicts import judged

_SAYS = Prose("kbs_process.studies.reference_day", "notes")


def simulate_day(
    campaign: Campaign,
    target: Path,
    *,
    samples: int,
    seed: int,
    progress: Progress,
    pdf: bool | None = None,
    processes: int | None = None,
) -> Outcome:
    """Plan, fly and judge the campaign's reference day; put the results in `target`, in one step.

    `samples` units that the parameters' uncertainties allow fly the same day; with them, rigs that lack one effect.
    """
    campaign = replace(campaign, recordings=())  # a day is planned: recordings of a test need not be there
    day = load_day(campaign)
    with writing(target) as folder:
        with progress.task("Planning the trajectory"):
            planned = plan(day.mission, day.lead)
        with progress.task(f"Flying {day.mission.duration:.0f} s") as task:
            flown = fly(campaign, planned, day.mission.duration, task.update)
            nominal = assess(campaign, day, planned, flown)
        numbers, drawn = draw_units(campaign, samples, seed)
        rigs = [substitute(campaign.rig, values(campaign.rig, numbers, row)) for row in drawn]
        changed = without_each(campaign) if rigs else {}
        what = f"Flying {len(rigs)} units, and {len(changed)} without an effect" if rigs else "Flying no other units"
        with progress.task(what) as task:
            reached = fly_days(campaign, day, planned, [*rigs, *changed.values()], task.update, processes)
        units = units_of(numbers, drawn, reached[: len(rigs)])
        with progress.task("Judging pointing and torque"):
            without = dict(zip(changed, reached[len(rigs) :], strict=True))
            assessed = with_spread(with_causes(campaign, planned, flown.torque, nominal, without), units)
        with progress.task("Writing the report"):
            write_tables(folder, planned, assessed, units)
            results = _results(campaign, day, planned, assessed, units, seed)
            return publish(folder, target, results, DOCUMENT, pdf)


def _results(
    campaign: Campaign, day: Day, planned: Plan, found: Assessed, units: Units, seed: int
) -> ReferenceDayResults:
    requirements = judged(campaign, day, found, units)
    samples = len(units.reached)
    options = f"--samples {samples + units.failed} --seed {seed}"
    return ReferenceDayResults(
        name=campaign.name,
        title=campaign.title,
        article=campaign.article,
        verdict=_conclusion(requirements),
        provenance=provenance.made("reference-day", campaign.folder, (*campaign.files, day.path), options),
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
        requirements=requirements,
        boresight=found.whole,
        mast=None if day.mast is None else _mast(day.mast),
        samples=samples,
        failed=units.failed,
        seed=seed,
        warnings=tuple(_warnings(units)),
        discussion=tuple(discussion(campaign.rig, found.sections)),
        parameters=(*_constants(day), *provenance.constants(campaign.rig)),
        notes=(_SAYS("orbit", mast=day.mast), _SAYS("error"), _SAYS("uncertainty", samples=samples), ASSUMPTION),
    )


def _mast(table: ModalTable) -> Mast:
    def ranges(name: str) -> tuple[tuple[float, float], ...]:
        over = np.stack([getattr(model, name) for model in table.models])
        return tuple((float(low), float(high)) for low, high in zip(over.min(axis=0), over.max(axis=0), strict=True))

    return Mast(source=table.source, frequency_Hz=ranges("frequency"), damping=ranges("damping"))


def _warnings(units: Units) -> Iterator[Notice]:
    if units.failed:
        yield Notice(
            severity="warning",
            what=f"{count(units.failed, 'unit')} of {units.failed + len(units.reached)} could not be simulated: "
            "what units differ by leaves them out",
            remedy="check the sigma of the drives' parameters",
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
