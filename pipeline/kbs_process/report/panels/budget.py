"""The uncertainty budget: what every stage adds to a channel's uncertainty."""

from __future__ import annotations

from kbs_process.report.figures import bars
from kbs_process.report.panel import Block, Caption, Figure, Fold, Grid, Panel, Text
from kbs_process.report.panels.choose import band_label, frame_label, main_band, main_frame
from kbs_process.report.results import Budget, Results
from kbs_process.report.tables import Tables
from kbs_process.report.text import number, unit

_CAPTION = Caption(
    shown="Each stage's share of the variance of every channel; the total standard deviation stands at "
    "the bar's end.",
    good="A total well below the limit's margin, shared by several stages.",
    bad="One stage that makes nearly all of a bar while the verdict is undecided.",
    do="Improve that stage: encoder through gravity, a better angle or a smaller imbalance; "
    "cross-coupling, a calibration; noise, more repeats; band edge, a longer recording.",
)


def panel(results: Results, tables: Tables) -> Panel:
    """Shares and a table for the requirement's band and frame; the others on demand."""
    question = "How well is each figure known, and what limits it?"
    if not results.budget:
        return Panel("budget", "Uncertainty", question, (Text("No uncertainty budget was made."),))
    band, frame = main_band(results), main_frame(results)
    first = tuple(row for row in results.budget if (row.band, row.frame) == (band, frame)) or results.budget
    rest = tuple(row for row in results.budget if row not in first)
    title = f"Shares of the variance, {band_label(results, first[0].band)}, {frame_label(first[0].frame)}"
    alt = "Share of each stage in each channel's variance"
    blocks: list[Block] = [Figure(title, (bars.variance_shares(first, alt),), _CAPTION)]
    blocks.append(_table(results, first))
    if rest:
        groups = dict.fromkeys((row.band, row.frame) for row in rest)
        others = tuple(
            _table(results, tuple(row for row in rest if (row.band, row.frame) == key)) for key in groups
        )
        blocks.append(Fold("Other bands and frames", others))
    return Panel("budget", "Uncertainty", question, tuple(blocks))


def _table(results: Results, rows: tuple[Budget, ...]) -> Grid:
    """One row a stage, one column a channel."""
    stages = dict.fromkeys((item.stage, item.source) for row in rows for item in row.contributions)
    body = [
        (
            stage,
            source,
            *(number(_sigma(row, stage, source), 2) for row in rows),
        )
        for stage, source in stages
    ]
    body.append(("Total", "root sum of squares", *(number(row.total, 2) for row in rows)))
    head = ("Stage", "Source", *(f"{row.channel} / {unit(row.unit)}" for row in rows))
    title = f"Standard uncertainties, {band_label(results, rows[0].band)}, {frame_label(rows[0].frame)}"
    return Grid(title, head, tuple(body), "ll" + "r" * len(rows))


def _sigma(row: Budget, stage: str, source: str) -> float | None:
    return next(
        (item.sigma for item in row.contributions if (item.stage, item.source) == (stage, source)), None
    )
