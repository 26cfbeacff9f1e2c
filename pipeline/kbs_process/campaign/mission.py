"""From a campaign's mission file to a Mission, the sections of its day, and what they must meet."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from kbs_process.campaign.config import Campaign, PointingRequirement
from kbs_process.campaign.documents import Document, dotted, read
from kbs_process.campaign.formats.faults import checked
from kbs_process.campaign.formats.mission_file import LimitsTable, MissionFile, OrbitTable, SectionEntry
from kbs_process.campaign.formats.tables import Table, quantities
from kbs_process.campaign.modal_file import read_modal
from kbs_process.campaign.problems import Problems
from kbs_process.campaign.quantities import quantity_or_fault
from kbs_process.campaign.requirements import pointing
from kbs_process.errors import ConfigError
from kbs_process.mission.model import Limits, Mission, Orbit, Relay
from kbs_process.mission.planner import Plan
from kbs_process.plant.linear.modal import ModalTable
from kbs_process.rig.model import Quantity


@dataclass(frozen=True, slots=True, eq=False)
class Day:
    """All that a mission file says."""

    path: Path
    mission: Mission
    sections: tuple[SectionEntry, ...]
    requirements: tuple[PointingRequirement, ...]
    lead: float  # s, simulated before the day begins
    smoothing: float  # s
    quantities: tuple[Quantity, ...]
    mast: ModalTable | None = None  # None: rigid


def load_day(campaign: Campaign) -> Day:
    """Read and check the mission file that `campaign` names.

    Raises ConfigError with file, key and remedy of what is wrong.
    """
    description = str(campaign.folder / "campaign.toml")
    if campaign.mission is None:
        remedy = 'name a mission file: [mission] file = "mission.toml"'
        raise ConfigError("this campaign has no mission", where=description, remedy=remedy)
    if campaign.rig.controller is None:
        what = "a mission is flown by commands, and the rig has no controller"
        raise ConfigError(what, where=description, remedy="describe [controller] in a parameter file")
    if campaign.mast is not None and campaign.rig.transducer.stiffness is not None:
        what = "the interface yields by transducer.stiffness, and by [mission] mast once more"
        raise ConfigError(what, where=description, remedy="leave one of the two out")
    document = read(campaign.mission, role="the mission file", remedy="correct [mission] file in campaign.toml")
    problems = Problems(subject=str(campaign.folder))
    file = checked(document, MissionFile, problems)
    reader = _Reader(document, problems, [])
    orbit = _orbit(reader, file.orbit)
    relays = tuple(Relay(name, **reader.numbers(table, "relay", name)) for name, table in file.relay.items())
    mounting = reader.quantities(file.mounting, "mounting")
    limits = _limits(reader, file.limits)
    day = reader.numbers(file.day, "day")
    hand_overs = [reader.numbers(one, "hand_over", index)["begin"] for index, one in enumerate(file.hand_over)]
    requirements = pointing(file.requirement, ("requirement",), document, problems)
    problems.raise_any()
    return Day(
        path=document.path,
        mission=Mission(
            orbit=orbit,
            relays=relays,
            attitude=mounting["attitude"].value,
            yaw_steering=file.mounting.yaw_steering,
            limits=limits,
            grazing_height=float(mounting["grazing_height"]),
            duration=day["duration"],
            cycle=float(campaign.rig.controller.cycle),
            hand_overs=tuple(hand_overs),
        ),
        sections=tuple(file.section),
        requirements=requirements,
        lead=day["lead"],
        smoothing=day["smoothing"],
        quantities=tuple(reader.found),
        mast=None if campaign.mast is None else read_modal(campaign.mast, campaign.rig.joint_names),
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


@dataclass(frozen=True, slots=True)
class _Reader:
    """Quantities of a mission file in SI; what is wrong is noted in `problems`."""

    document: Document
    problems: Problems
    found: list[Quantity]

    def quantities(self, table: Table, *key: str | int) -> dict[str, Quantity]:
        """Return all quantities of the table at `key`, by their names in it."""
        own = {}
        for name, kind, given in quantities(table):
            own[name], fault = quantity_or_fault(dotted((*key, name)), given, kind, self.document.path.parent)
            if fault:
                place = self.document.place((*key, name, fault.where))
                self.problems.add(place, fault.what, fault.remedy)
        self.found.extend(own.values())
        return own

    def numbers(self, table: Table, *key: str | int) -> dict[str, float]:
        """Return them as numbers."""
        return {name: float(quantity) for name, quantity in self.quantities(table, *key).items()}


def _orbit(reader: _Reader, table: OrbitTable) -> Orbit:
    return Orbit(
        epoch=table.epoch,
        repeat_days=table.repeat_days,
        repeat_orbits=table.repeat_orbits,
        **reader.numbers(table, "orbit"),
    )


def _limits(reader: _Reader, table: LimitsTable) -> Limits:
    read = reader.quantities(table, "limits")
    ranges = {axis: read[axis].value for axis in ("azimuth", "elevation")}
    for axis, (low, high) in ranges.items():
        if not low < high and read[axis].source:  # without one it could not be read, which is told already
            reader.problems.add(reader.document.place(("limits", axis)), "is empty", "give the lower limit first")
    return Limits(
        low=np.array([pair[0] for pair in ranges.values()]),
        high=np.array([pair[1] for pair in ranges.values()]),
        rate=float(read["rate"]),
        acceleration=float(read["acceleration"]),
    )
