"""Does the unit point well enough, and quietly enough, over the day?"""

from __future__ import annotations

import numpy as np

from kbs_process.report.panel import Block, Cell, Grid, Panel, Text, notices
from kbs_process.report.tables import Tables
from kbs_process.report.text import exact, measure, number, percent, unit
from kbs_process.studies.reference_day.results import Judged, ReferenceDayResults


def panel(results: ReferenceDayResults, tables: Tables) -> Panel:
    """A row a requirement, and what is assumed."""
    head = ("Requirement", "Found", "Limit", "Margin", "Worst case", "Verdict")
    note = "± is one standard deviation. Each axis has to meet each pointing requirement in every section."
    sources = "; ".join(dict.fromkeys(one.source for one in results.requirements))
    rows = tuple(_row(one) for one in results.requirements)
    blocks: tuple[Block, ...] = (
        Grid("Compliance", head, rows, "lrrrlc", f"{note} Source: {sources}."),
        *notices(results.warnings),
        Text("Assumptions behind these figures:", results.notes),
    )
    question = "Does the unit point well enough, and turn quietly enough, over the day?"
    return Panel("compliance", "Compliance", question, blocks)


def _row(one: Judged) -> tuple[str | Cell, ...]:
    scale, name = (float(np.degrees(1.0)), "°") if one.unit == "rad" else (1.0, unit(one.unit))
    value, sigma, limit = scale * one.value, scale * one.sigma, round(scale * one.limit, 9)
    shown = measure(value, sigma) if sigma else number(value)
    return (
        one.name,
        f"{shown} {name}",
        f"{exact(limit)} {name}",
        f"{number(limit - value)} {name} ({percent(1.0 - value / limit, 2)})",
        one.where,
        Cell(one.verdict, "" if one.verdict == "none" else one.verdict),
    )
