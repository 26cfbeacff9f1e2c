"""The flight model's disturbance, with the uncertainty of its parameters: many units, one trajectory, in orbit."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from kbs_process.campaign.config import Campaign
from kbs_process.errors import SimulationError
from kbs_process.plant.laws import select
from kbs_process.plant.sampling import draw, uncertain, values
from kbs_process.progress import Progress
from kbs_process.reduction.commands import Commands, of_table, of_trajectory
from kbs_process.report.build import publish
from kbs_process.report.prose import Prose
from kbs_process.results import provenance
from kbs_process.results.outcome import Outcome
from kbs_process.results.parallel import ordered_map
from kbs_process.results.store import writing
from kbs_process.rig.model import Rig, substitute
from kbs_process.stages.to_cog import ASSUMPTION
from kbs_process.studies.flight.files import write_tables
from kbs_process.studies.flight.propagation import by_chance
from kbs_process.studies.flight.report import DOCUMENT
from kbs_process.studies.flight.results import FlightResults
from kbs_process.studies.flight.spread import Flight, conclusion, drivers, requirement, warnings
from kbs_process.studies.flight.unit import Job, fly, in_orbit, judged_by

_SAYS = Prose("kbs_process.studies.flight", "notes")


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
    scheduler: str | None = None,
) -> Outcome:
    """Fly `samples` units that the parameters' uncertainties allow along a trajectory."""
    if commands is not None:
        campaign = replace(campaign, recordings=())  # none is read: they need not be there
    rig, judged = in_orbit(campaign.rig), judged_by(campaign)
    given = of_table(commands, rig) if commands is not None else of_trajectory(campaign, trajectory, progress)
    duration = float(given.schedule.t[-1])
    numbers = uncertain(rig, select(campaign.effects))
    drawn = draw(numbers, samples, seed)
    base = Job(rig, campaign.effects, given.schedule, duration, campaign.bands.working_rate, judged)
    jobs = [base, *(replace(base, rig=substitute(rig, values(rig, numbers, row))) for row in drawn)]
    with progress.task(f"Flying {samples} units along {given.told}") as task:
        nominal, *flown = ordered_map(fly, jobs, task.update, processes=processes, scheduler=scheduler)
    if nominal is None:
        raise SimulationError("the nominal flight unit cannot be simulated", where=campaign.name)
    kept = np.array([unit is not None for unit in flown], dtype=np.bool_)
    units = tuple(unit for unit in flown if unit is not None)
    flight = Flight(given.name, duration, numbers, drawn[kept], nominal, units, int(np.sum(~kept)), seed, judged)
    with progress.task("Writing the report"), writing(target) as folder:
        write_tables(folder, flight)
        return publish(folder, target, _results(campaign, rig, flight, given), DOCUMENT, pdf)


def _results(campaign: Campaign, rig: Rig, flight: Flight, given: Commands) -> FlightResults:
    requirements = tuple(requirement(flight, index) for index in range(len(flight.judged)))
    units = len(flight.units)
    options = f"--samples {units + flight.failed} --seed {flight.seed}"
    return FlightResults(
        name=campaign.name,
        title=campaign.title,
        article=campaign.article,
        verdict=conclusion(requirements),
        provenance=provenance.made("flight", campaign.folder, (*campaign.files, given.source), options),
        trajectory=flight.trajectory,
        duration_s=flight.duration_s,
        samples=units,
        failed=flight.failed,
        seed=flight.seed,
        by_chance=by_chance(units, len(flight.numbers)),
        requirements=requirements,
        drivers=tuple(drivers(rig, flight)),
        warnings=tuple(warnings(flight)),
        parameters=tuple(provenance.constants(rig)),
        notes=(_SAYS("orbit"), _SAYS("spread"), ASSUMPTION),
    )
