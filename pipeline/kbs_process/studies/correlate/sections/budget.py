"""The uncertainty budget: what every stage adds to a channel's uncertainty."""

from __future__ import annotations

from collections.abc import Sequence

from kbs_process.report import draw
from kbs_process.report.panel import Block, Cell, Figure, Fold, Grid, Panel, Picture, Text
from kbs_process.report.prose import Prose
from kbs_process.report.tables import Tables
from kbs_process.report.text import frame_label, label, number, unit
from kbs_process.results.judged import Budget
from kbs_process.studies.correlate.choose import band_label, main_band, main_frame
from kbs_process.studies.correlate.results import Results, SixChannels

_SAYS = Prose("kbs_process.studies.correlate", "budget")


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
    blocks: list[Block] = [Figure(title, (_shares(first, alt),), _SAYS.caption("shares"))]
    blocks.append(_table(results, first))
    if together := tuple(one for one in results.six_channels if one.band == band):
        blocks.append(_six_channels(results, together))
    elsewhere = tuple(row for row in results.budget if row.recording == recording and row not in first)
    others = tuple(row for row in here if row.recording != recording)
    for name, rows in (("Other bands and frames", elsewhere), ("Other recordings", others)):
        if rows:
            blocks.append(Fold(name, _tables(results, rows)))
    return Panel("budget", "Uncertainty", question, tuple(blocks))


def _six_channels(results: Results, rows: tuple[SixChannels, ...]) -> Grid:
    """The torques of each recording, and whether six channels agree on them."""
    body: list[tuple[str | Cell, ...]] = []
    for row in rows:
        torques = [f"{number(row.peak[name], 2)} ± {number(row.sigma[name], 2)}" for name in row.peak]
        shown = torques if row.explained else [Cell("something else pulls", "undecided")] * len(torques)
        body.append((row.recording, number(row.chi_square, 2), *shown))
    head = ("Recording", "Chi-square", *(f"{name} / N m" for name in rows[0].peak))
    title = f"Peak torque at the spacecraft from all six channels at once, {band_label(results, rows[0].band)}"
    return Grid(title, head, tuple(body), "kr" + "r" * len(rows[0].peak), _SAYS("six_channels_note"))


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
    place = rows[0].recording, rows[0].band, rows[0].frame
    measured = {one.channel: one.measured_rms for one in results.merit if (one.recording, one.band, one.frame) == place}
    if measured:
        body.append(("Measured", "rms, to compare with", *(number(measured.get(row.channel), 2) for row in rows)))
    head = ("Stage", "Source", *(f"{row.channel} / {unit(row.unit)}" for row in rows))
    title = f"Standard uncertainties, {_label(results, rows[0])}"
    return Grid(title, head, tuple(body), "ll" + "r" * len(rows))


def _sigma(row: Budget, stage: str, source: str) -> float | None:
    return next((item.sigma for item in row.contributions if (item.stage, item.source) == (stage, source)), None)


def _shares(budgets: Sequence[Budget], alt: str) -> Picture:
    """Draw each stage's share of each channel's variance; the total stands beside the bar."""
    stages = list(dict.fromkeys(item.stage for budget in budgets for item in budget.contributions))
    with draw.style():
        figure, axis = draw.canvas(0.95 + 0.34 * len(budgets))
        for row, budget in enumerate(budgets):
            variance = sum(item.sigma**2 for item in budget.contributions) or 1.0
            left = 0.0
            for item in budget.contributions:
                share = 100.0 * item.sigma**2 / variance
                color = draw.SERIES[stages.index(item.stage) % len(draw.SERIES)]
                axis.barh(row, share, 0.62, left=left, color=color, edgecolor="white", linewidth=0.5)
                left += share
            axis.annotate(
                f"{number(budget.total, 2)} {unit(budget.unit)}", (101.0, row), va="center", annotation_clip=False
            )
        axis.set_yticks(range(len(budgets)), [label(budget.channel) for budget in budgets])
        axis.invert_yaxis()
        axis.set_xlim(0.0, 100.0)
        axis.grid(visible=False, axis="y")
        axis.set_xlabel("share of the variance / %          total σ at the bar's end")
        for index, stage in enumerate(stages):
            axis.bar(0, 0, color=draw.SERIES[index % len(draw.SERIES)], label=label(stage))
        draw.legend_above(figure)
        return draw.picture(figure, alt)
