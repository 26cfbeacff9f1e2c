"""Days of units that the parameters' uncertainties allow: what each reaches, and what they differ by."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import msgspec
import numpy as np

from kbs_process.campaign.config import Campaign
from kbs_process.campaign.mission import Day
from kbs_process.errors import SimulationError
from kbs_process.mission.planner import Plan
from kbs_process.plant.laws import select
from kbs_process.plant.sampling import Uncertain, draw, uncertain
from kbs_process.results.parallel import ordered_map
from kbs_process.rig.model import Rig
from kbs_process.signals.records import Array
from kbs_process.stages.pointing import PointingStatistics
from kbs_process.studies.reference_day.day import Assessed, assess
from kbs_process.studies.reference_day.flying import fly
from kbs_process.studies.reference_day.results import Section, Spread

_ALIGNMENT = ".encoder.offset"  # turns the antenna by as much: an uncertainty of the bias, whichever unit it is


@dataclass(frozen=True, slots=True, eq=False)
class Reached:
    """What is kept of one unit's day."""

    sections: tuple[Section, ...]
    joints: tuple[PointingStatistics, ...]  # over the day


@dataclass(frozen=True, slots=True, eq=False)
class Units:
    """Units drawn, those that could be simulated."""

    numbers: tuple[Uncertain, ...]
    drawn: Array  # (units, numbers)
    reached: tuple[Reached, ...]
    failed: int


def spread(found: Sequence[float]) -> Spread | None:
    """Return what units differ by in a figure; None of fewer than two."""
    if len(found) < 2:
        return None
    return Spread(mean=float(np.mean(found)), sigma=float(np.std(found, ddof=1)), least=min(found), greatest=max(found))


def deviation(found: Sequence[float]) -> float:
    """Return the standard deviation of a figure over units; zero of fewer than two."""
    among = spread(found)
    return 0.0 if among is None else among.sigma


@dataclass(frozen=True, slots=True, eq=False)
class _Job:
    campaign: Campaign
    day: Day
    planned: Plan


def draw_units(campaign: Campaign, samples: int, seed: int) -> tuple[tuple[Uncertain, ...], Array]:
    """Return the numbers that are uncertain, and a row of them for each of `samples` units; the same for the same seed.

    The alignment of encoders is not drawn.
    """
    every = uncertain(campaign.rig, select(campaign.effects))
    numbers = tuple(one for one in every if not one.quantity.endswith(_ALIGNMENT))
    return numbers, draw(numbers, samples, seed) if samples > 1 and numbers else np.zeros((0, len(numbers)))


def fly_days(
    campaign: Campaign,
    day: Day,
    planned: Plan,
    rigs: Sequence[Rig],
    update: Callable[[float], None],
    processes: int | None = None,
) -> list[Reached | None]:
    """Fly each rig along the same commands, the same on any number of processes; None of what diverges."""
    jobs = [_Job(replace(campaign, rig=rig), day, planned) for rig in rigs]
    return list(ordered_map(_reached, jobs, update, processes=processes))


def units_of(numbers: tuple[Uncertain, ...], drawn: Array, reached: Sequence[Reached | None]) -> Units:
    """Return the units that could be simulated."""
    kept = np.array([one is not None for one in reached], dtype=np.bool_)
    return Units(numbers, drawn[kept], tuple(one for one in reached if one is not None), int(np.sum(~kept)))


def _reached(job: _Job) -> Reached | None:
    """Fly one unit; None where its equations have no finite solution."""
    try:
        flown = fly(job.campaign, job.planned, job.day.mission.duration)
    except SimulationError:
        return None
    found = assess(job.campaign, job.day, job.planned, flown)
    return Reached(found.sections, found.joints)


def with_spread(found: Assessed, units: Units) -> Assessed:
    """Return the nominal day with what the units differ by beside each figure of its sections."""
    return replace(found, sections=tuple(_sections(found.sections, units)))


def _sections(sections: Sequence[Section], units: Units) -> Iterator[Section]:
    for i, section in enumerate(sections):
        every = [one.sections[i] for one in units.reached]
        yield msgspec.structs.replace(
            section,
            azimuth_units=spread([one.azimuth.percentile for one in every]),
            elevation_units=spread([one.elevation.percentile for one in every]),
            torques=tuple(
                msgspec.structs.replace(torque, units=spread([one.torques[j].value for one in every]))
                for j, torque in enumerate(section.torques)
            ),
        )
