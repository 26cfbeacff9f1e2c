"""How do the sections of the day compare, with each other and with the published table?"""

from __future__ import annotations

import numpy as np

from kbs_process.report.panel import Block, Caption, Figure, Grid, Panel, Text
from kbs_process.report.tables import Tables
from kbs_process.report.text import MISSING, measure, number
from kbs_process.results.pointing import PointingEstimate
from kbs_process.studies.reference_day import figures
from kbs_process.studies.reference_day.results import ReferenceDayResults, Section

_COMPARED = Caption(
    shown="95 % of the magnitude of each axis' error in each section, with two standard deviations, beside the "
    "published figures.",
    good="Both well below 44 mdeg, and of like size.",
    bad="A section that stands out in one and not in the other: a cause that one of the models lacks.",
    do="Read the discussion under the table; look at that section's error over time.",
)


def panel(results: ReferenceDayResults, tables: Tables) -> Panel:
    """Table of the sections with the published figures, and the discussion."""
    blocks: list[Block] = [_compared(results)]
    if any(section.published for section in results.sections):
        figure = figures.against_published(results.sections)
        blocks.append(Figure("95 % of the pointing error, simulated and published", (figure,), _COMPARED))
    if results.discussion:
        blocks.append(Text("Where they differ, and why:", results.discussion))
    blocks.append(_statistics(results))
    question = "How do the sections of the day compare, with each other and with the published table?"
    return Panel("sections", "Sections", question, tuple(blocks))


def _compared(results: ReferenceDayResults) -> Grid:
    bands = tuple(torque.label for torque in results.sections[0].torques)
    head = (
        "Section", "Time / s", "(publ.)", "Mode", "az 95 % / mdeg", "(publ.)", "el 95 % / mdeg", "(publ.)",
        *(f"Torque {band} / N\u00a0m" for band in bands), "(publ.)", "Published comment",
    )  # fmt: skip
    rows = tuple(_row(section) for section in results.sections)
    note = (
        "± is one standard deviation, from the length of the section and the correlation of its error. Torque: "
        "greatest over the axes, at the spacecraft's centre of mass."
    )
    return Grid("Sections of the reference day", head, rows, "krrlrrrr" + "r" * len(bands) + "rl", note)


def _row(section: Section) -> tuple[str, ...]:
    published = section.published
    return (
        section.name,
        f"{section.start_s:.0f}–{section.end_s:.0f}",
        MISSING if published is None else f"to {published.end_s:.0f}",
        ", ".join(section.modes),
        _mdeg(section.azimuth.percentile, section.azimuth.percentile_sigma),
        MISSING if published is None else f"{published.azimuth_mdeg:.1f}",
        _mdeg(section.elevation.percentile, section.elevation.percentile_sigma),
        MISSING if published is None else f"{published.elevation_mdeg:.1f}",
        *(number(torque.value, 2) for torque in section.torques),
        MISSING if published is None else published.torque,
        "" if published is None else published.comment,
    )


def _mdeg(value: float, sigma: float) -> str:
    return measure(1e3 * float(np.degrees(value)), 1e3 * float(np.degrees(sigma)))


def _statistics(results: ReferenceDayResults) -> Grid:
    head = ("Section", "Axis", "Bias / mdeg", "Random, 2 σ / mdeg", "95 % / mdeg", "Greatest / mdeg")
    rows = [
        _line(section.name, name, one)
        for section in results.sections
        for name, one in (("azimuth", section.azimuth), ("elevation", section.elevation))
    ]
    rows += [_line("whole day", one.axis, one) for one in results.boresight]
    note = "Whole day: in the boresight's own frame; the line of sight is the resultant, whose mean is no bias."
    return Grid("Statistics of the pointing error", head, tuple(rows), "kkrrrr", note)


def _line(where: str, name: str, one: PointingEstimate) -> tuple[str, ...]:
    return (
        where,
        name,
        _mdeg(one.bias, one.bias_sigma),
        _mdeg(one.random, one.random_sigma),
        _mdeg(one.percentile, one.percentile_sigma),
        number(1e3 * float(np.degrees(one.greatest))),
    )
