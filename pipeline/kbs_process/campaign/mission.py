"""From a campaign's mission file to a Mission, the sections of its day, and what they must meet."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Literal

import numpy as np

from kbs_process.campaign.config import Campaign, PointingRequirement
from kbs_process.campaign.documents import Document, check_finite, read
from kbs_process.campaign.problems import Problems
from kbs_process.campaign.quantities import Kind, read_quantity
from kbs_process.campaign.requirements import pointing
from kbs_process.campaign.schema import violations
from kbs_process.errors import ConfigError
from kbs_process.mission.model import Limits, Mission, Orbit, Relay
from kbs_process.rig.model import Quantity

_ANGLE = Kind("rad", ())
_PAIR = Kind("rad", (2,))


@dataclass(frozen=True, slots=True)
class Published:
    """A published table's figures for one section, in the units that it is printed in."""

    azimuth_mdeg: float
    elevation_mdeg: float
    torque_Nm: float
    torque: str
    comment: str


@dataclass(frozen=True, slots=True)
class SectionEntry:
    """A section of the day: from the end of the one before to an event."""

    name: str
    until: Literal["loss", "acquisition", "azimuth-extreme", "elevation-extreme", "end"]
    near: float  # s
    published: Published | None


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


def load_day(campaign: Campaign) -> Day:
    """Read and check the mission file that `campaign` names.

    Raises ConfigError with file, key and remedy of what is wrong.
    """
    if campaign.mission is None:
        raise ConfigError(
            "this campaign has no mission",
            where=str(campaign.folder / "campaign.toml"),
            remedy='name a mission file: [mission] file = "mission.toml"',
        )
    if campaign.rig.controller is None:
        raise ConfigError(
            "a mission is flown by commands, and the rig has no controller",
            where=str(campaign.folder / "campaign.toml"),
            remedy="describe [controller] in a parameter file",
        )
    document = read(campaign.mission, role="the mission file", remedy="correct [mission] file in campaign.toml")
    problems = Problems(subject=str(campaign.folder))
    check_finite(document, problems)
    for violation in violations(document.tree, "mission"):
        problems.add(document.place(violation.key), violation.what, violation.remedy)
    problems.raise_any()
    reader = _Reader(document, problems, {})
    day = _day(reader, float(campaign.rig.controller.cycle))
    problems.raise_any()
    return day


@dataclass(frozen=True, slots=True)
class _Reader:
    """Quantities of a mission file by their keys; what is wrong is noted in `problems`."""

    document: Document
    problems: Problems
    found: dict[str, Quantity]

    def quantity(self, kind: Kind, *key: str) -> Quantity:
        node: Any = self.document.tree
        for part in key:
            node = node[part]
        name = ".".join(key)
        try:
            quantity = read_quantity(name, node, kind, self.document.path.parent)
        except ConfigError as error:
            self.problems.add(self.document.place((*key, *filter(None, [error.where]))), error.what, error.remedy)
            quantity = Quantity(name, np.ones(kind.shape), kind.unit, np.zeros(kind.shape), "")
        self.found[name] = quantity
        return quantity

    def number(self, kind: Kind, *key: str) -> float:
        return float(self.quantity(kind, *key))


def _day(reader: _Reader, cycle: float) -> Day:
    tree = reader.document.tree
    positive = Kind("s", (), low=0.0, strict=True)
    mission = Mission(
        orbit=_orbit(reader),
        relays=tuple(Relay(name, reader.number(_ANGLE, "relay", name, "longitude")) for name in tree["relay"]),
        attitude=reader.quantity(Kind("rad", (3,)), "mounting", "attitude").value,
        yaw_steering=tree["mounting"]["yaw_steering"],
        limits=_limits(reader),
        grazing_height=reader.number(Kind("m", (), low=0.0), "mounting", "grazing_height"),
        duration=reader.number(positive, "day", "duration"),
        cycle=cycle,
    )
    return Day(
        path=reader.document.path,
        mission=mission,
        sections=tuple(_section(table) for table in tree["section"]),
        requirements=tuple(
            pointing(table, ("requirement", index), reader.document, reader.problems)
            for index, table in enumerate(tree.get("requirement", []))
        ),
        lead=reader.number(Kind("s", (), low=0.0), "day", "lead"),
        smoothing=reader.number(positive, "day", "smoothing"),
        quantities=tuple(reader.found.values()),
    )


def _orbit(reader: _Reader) -> Orbit:
    table = reader.document.tree["orbit"]
    epoch = table["epoch"]
    if not isinstance(epoch, datetime) or epoch.tzinfo is None:
        reader.problems.add(
            reader.document.place(("orbit", "epoch")),
            "is no date and time with its offset from UTC",
            "write it as 1999-12-01T15:30:00Z",
        )
        epoch = datetime(2000, 1, 1, tzinfo=UTC)
    return Orbit(
        epoch=epoch.astimezone(UTC),
        repeat_days=table["repeat_days"],
        repeat_orbits=table["repeat_orbits"],
        inclination=reader.number(_ANGLE, "orbit", "inclination"),
        eccentricity=reader.number(Kind("1", (), low=0.0), "orbit", "eccentricity"),
        argument_of_perigee=reader.number(_ANGLE, "orbit", "argument_of_perigee"),
        ascending_node_time=reader.number(Kind("s", (), low=0.0), "orbit", "ascending_node_time"),
        argument_of_latitude=reader.number(_ANGLE, "orbit", "argument_of_latitude"),
    )


def _limits(reader: _Reader) -> Limits:
    ranges = {axis: reader.quantity(_PAIR, "limits", axis).value for axis in ("azimuth", "elevation")}
    for axis, (low, high) in ranges.items():
        if not low < high:
            reader.problems.add(reader.document.place(("limits", axis)), "is empty", "give the lower limit first")
    return Limits(
        low=np.array([pair[0] for pair in ranges.values()]),
        high=np.array([pair[1] for pair in ranges.values()]),
        rate=reader.number(Kind("rad/s", (), low=0.0, strict=True), "limits", "rate"),
        acceleration=reader.number(Kind("rad/s^2", (), low=0.0, strict=True), "limits", "acceleration"),
    )


def _section(table: Mapping[str, Any]) -> SectionEntry:
    published = table.get("published")
    return SectionEntry(
        name=table["name"],
        until=table["until"],
        near=float(table["near_s"]),
        published=Published(**published) if published else None,
    )
