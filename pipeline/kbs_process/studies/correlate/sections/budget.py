"""The uncertainty budget: what every stage adds to a channel's uncertainty."""

from __future__ import annotations

from kbs_process.report.panel import Block, Caption, Figure, Fold, Grid, Panel, Text
from kbs_process.report.tables import Tables
from kbs_process.report.text import frame_label, number, unit
from kbs_process.studies.correlate.figures import bars
from kbs_process.studies.correlate.results import Budget, Results
from kbs_process.studies.correlate.sections.choose import band_label, main_band, main_frame

_CAPTION = Caption(
    shown="Each stage's share of the variance of every channel in one recording; the total standard deviation stands "
    "at the bar's end.",
    good="A total well below the limit's margin, shared by several stages.",
    bad="One stage that makes nearly all of a bar while the verdict is undecided.",
    do="Improve that stage: encoder through gravity, a better angle or a smaller imbalance; "
    "cross-coupling, a calibration; noise, more repeats; band edge, a longer recording.",
)


def panel(results: Results, tables: Tables) -> Panel:
    """Shares and a table for the judged recording in the requirement's band and frame; the others on demand."""
    question = "How well is each figure known, and what limits it?"
    if not results.budget:
        return Panel("budget", "Uncertainty", question, (Text("No uncertainty budget was made."),))
    band, frame = main_band(results), main_frame(results)
    here = tuple(row for row in results.budget if (row.band, row.frame) == (band, frame)) or results.budget
    recording = _shown(results, here)
    first = tuple(row for row in here if row.recording == recording)
    title = f"Shares of the variance, {_label(results, first[0])}"
    alt = "Share of each stage in each channel's variance"
    blocks: list[Block] = [Figure(title, (bars.variance_shares(first, alt),), _CAPTION)]
    blocks.append(_table(results, first))
    elsewhere = tuple(row for row in results.budget if row.recording == recording and row not in first)
    others = tuple(row for row in here if row.recording != recording)
    for name, rows in (("Other bands and frames", elsewhere), ("Other recordings", others)):
        if rows:
            blocks.append(Fold(name, _tables(results, rows)))
    return Panel("budget", "Uncertainty", question, tuple(blocks))


def _shown(results: Results, rows: tuple[Budget, ...]) -> str | None:
    """The recording that decided the requirement, or the one with the largest total where nothing is required."""
    for requirement in results.requirements:
        if any(row.recording == requirement.recording for row in rows):
            return requirement.recording
    return max(rows, key=lambda row: row.total).recording


def _label(results: Results, row: Budget) -> str:
    parts = (row.recording, band_label(results, row.band), frame_label(row.frame))
    return ", ".join(part for part in parts if part)


def _tables(results: Results, rows: tuple[Budget, ...]) -> tuple[Grid, ...]:
    groups: dict[tuple[str | None, str, str], list[Budget]] = {}
    for row in rows:
        groups.setdefault((row.recording, row.band, row.frame), []).append(row)
    return tuple(_table(results, tuple(group)) for group in groups.values())


def _table(results: Results, rows: tuple[Budget, ...]) -> Grid:
    """One row a stage, one column a channel."""
    stages = dict.fromkeys((item.stage, item.source) for row in rows for item in row.contributions)
    body = [(stage, source, *(number(_sigma(row, stage, source), 2) for row in rows)) for stage, source in stages]
    body.append(("Total", "root sum of squares", *(number(row.total, 2) for row in rows)))
    head = ("Stage", "Source", *(f"{row.channel} / {unit(row.unit)}" for row in rows))
    title = f"Standard uncertainties, {_label(results, rows[0])}"
    return Grid(title, head, tuple(body), "ll" + "r" * len(rows))


def _sigma(row: Budget, stage: str, source: str) -> float | None:
    return next((item.sigma for item in row.contributions if (item.stage, item.source) == (stage, source)), None)
