"""How are the pointing errors distributed?"""

from __future__ import annotations

import numpy as np

from kbs_process.report import distributions as pointing
from kbs_process.report.panel import Block, Caption, Figure, Fold, Panel, Picture
from kbs_process.report.tables import Table, Tables
from kbs_process.studies.reference_day import figures
from kbs_process.studies.reference_day.results import ReferenceDayResults, Section

_DENSITY = Caption(
    shown="Density of the error about its bias in the first section, with the normal density of the same standard "
    "deviation; between the dashed lines lie 95 %.",
    good="One hump about zero, narrower than the limit.",
    bad="Two humps or flat shoulders: a limit cycle over one encoder code. Long tails: rare events, which a standard "
    "deviation does not tell.",
    do="Compare the width with one code of the encoder; look for the events in the history below.",
)
_HISTORY = Caption(
    shown="Pointing error of either axis over the day: the range within each stretch of time, with the limit on 95 %.",
    good="A band of even width about zero.",
    bad="A drift or a step: slow variation, which counts against the limit over one orbit.",
    do="Match it with the trajectory: errors that come with rate are the loop's, those at rest the encoder's.",
)


def panel(results: ReferenceDayResults, tables: Tables) -> Panel:
    """Densities of the first section, those of the others on demand, and the histories."""
    blocks: list[Block] = []
    table = tables.read("day", "error")
    if table is not None:
        first, *rest = results.sections
        title = f"Distribution of the pointing error, section {first.name}"
        blocks.append(Figure(title, _densities(table, first), _DENSITY))
        limits = [one.limit for one in results.requirements if one.statistic == "percentile"]
        history = figures.errors(table, min(limits, default=0.0))
        blocks.append(Figure("Pointing error over the day", (history,), _HISTORY))
        others = tuple(
            Figure(f"Distribution of the pointing error, section {one.name}", _densities(table, one), _DENSITY)
            for one in rest
        )
        if others:
            blocks.append(Fold("Distributions in the other sections", others))
    return Panel("errors", "Pointing errors", "How are the pointing errors distributed?", tuple(blocks))


def _densities(table: Table, section: Section) -> tuple[Picture, ...]:
    t = table.columns["t"]
    inside = np.logical_and(table.valid, (t >= section.start_s) & (t < section.end_s))
    found = (("azimuth", "az", section.azimuth), ("elevation", "el", section.elevation))
    return (pointing.distributions([(name, table.columns[column][inside], one) for name, column, one in found]),)
