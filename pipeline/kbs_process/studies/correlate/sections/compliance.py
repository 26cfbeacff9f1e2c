"""Is every requirement met, and what qualifies the answer?"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kbs_process.report import draw
from kbs_process.report.panel import Block, Cell, Figure, Fold, Grid, Notices, Panel, Picture, Text, Tone
from kbs_process.report.prose import Prose
from kbs_process.report.tables import Tables
from kbs_process.report.text import MISSING, band_hz, count, exact, frame_label, label, measure, number, percent, unit
from kbs_process.results.judged import ChannelResult, Requirement
from kbs_process.results.records import Notice
from kbs_process.studies.correlate.results import Results

_SAYS = Prose("kbs_process.studies.correlate", "compliance")


def panel(results: Results, tables: Tables) -> Panel:
    """Compliance table, warnings and data losses right under it, and the channels behind the verdict."""
    blocks: list[Block] = [_table(results)] if results.requirements else []
    if not results.requirements and not results.judged_pointing:
        blocks.append(Text("This campaign states no requirement; the report compares, and gives no verdict."))
    blocks.extend(_ways(entry) for entry in results.requirements if entry.ways)
    for entry in results.requirements:
        tone: Tone = "undecided" if entry.only_without else ""
        blocks += [Text(f"{entry.name}: {entry.left_out}", tone=tone)] if entry.left_out else []
    if results.cross_coupling is not None and results.requirements:
        stated = 2.0 * max(row[place] for place, row in enumerate(results.cross_coupling.sigma))
        shown = [(channel, 2.0 * sigma) for channel, sigma in results.soundness.gains.items()]
        blocks.append(Text(_SAYS("gains", stated=stated, shown=shown)))
    blocks.append(_qualified(results))
    serious = tuple(_entry(notice) for notice in _sorted(results.warnings) if notice.severity != "info")
    if serious:
        blocks.append(Notices(serious))
    remarks = tuple(_entry(notice) for notice in results.warnings if notice.severity == "info")
    if remarks:
        blocks.append(Fold(count(len(remarks), "remark"), (Notices(remarks),)))
    if results.notes:
        blocks.append(Text("Assumptions behind these figures:", results.notes))
    blocks.extend(_figure(requirement) for requirement in results.requirements if requirement.channels)
    return Panel("compliance", "Compliance", "Is every requirement met, and what qualifies the answer?", tuple(blocks))


def _predicted(entry: Requirement) -> str:
    value = measure(entry.predicted_value, entry.predicted_sigma, 3)
    return value if value == MISSING else f"{value} {unit(entry.unit)}"


def _table(results: Results) -> Grid:
    rows = tuple(
        (
            f"{entry.name} ({entry.statistic}, {entry.frame}{_axes(entry)}{_lever(entry)})",
            band_hz(*entry.band_Hz),
            f"{number(entry.value)} {unit(entry.unit)}",
            _interval(entry),
            f"{exact(entry.limit)} {unit(entry.unit)}",
            _margin(entry),
            _where(entry),
            _predicted(entry),
            Cell(entry.verdict, entry.verdict),
        )
        for entry in results.requirements
    )
    head = (
        "Requirement",
        "Band",
        "Measured",
        "Interval, 95 %",
        "Limit",
        "Margin",
        "Worst case",
        "Predicted",
        "Verdict",
    )
    sources = list(dict.fromkeys(entry.source for entry in results.requirements if entry.source))
    return Grid("Compliance", head, rows, "llrrrrlrc", _SAYS("table_note", sources=sources))


def _ways(entry: Requirement) -> Grid:
    """Both ways to the spacecraft, on the recording that decides each channel."""
    deciding = {(one.recording, one.channel) for one in entry.channels}
    rows = tuple(
        (
            way.channel,
            way.recording,
            *(f"{number(value)} ({number(low)} to {number(high)})" for value, low, high in (way.together, way.moved)),
            "yes" if way.agree else Cell("no: the worse counts", "undecided"),
        )
        for way in sorted(entry.ways, key=lambda way: way.channel)
        if (way.recording, way.channel) in deciding
    )
    ways = (f"All six channels at once / {unit(entry.unit)}", f"Moved by the measured forces / {unit(entry.unit)}")
    head = ("Channel", "Recording", *ways, "Agreement")
    return Grid(f"{entry.name}: both ways to the spacecraft", head, rows, "kkrrl", _SAYS("ways_note"))


def _interval(entry: Requirement) -> str:
    if entry.low is None or entry.high is None:
        return MISSING
    return f"{number(entry.low)} to {number(entry.high)} {unit(entry.unit)}"


def _margin(entry: Requirement) -> str:
    if entry.margin is None:
        return MISSING
    return f"{number(entry.margin)} {unit(entry.unit)} ({percent(entry.margin / entry.limit, 2)})"


def _lever(entry: Requirement) -> str:
    return "" if entry.lever_m is None else f", {number(entry.lever_m)}\u00a0m from the transducer"


def _axes(entry: Requirement) -> str:
    return "" if len(entry.axes) == 3 else f", {', '.join(entry.axes)} alone"


def _where(entry: Requirement) -> str:
    parts = [part for part in (entry.channel, entry.recording) if part]
    if entry.time_s is not None:
        parts.append(f"at {entry.time_s:.2f}\u00a0s")
    return ", ".join(parts) or MISSING


def _qualified(results: Results) -> Text:
    severities = [notice.severity for notice in results.warnings]
    lossy = [recording for recording in results.recordings if recording.lost]
    losses = sum(len(recording.lost) for recording in lossy)
    broken = [convention for convention in results.conventions if not convention.ok]
    parts = [
        count(severities.count("error"), "error"),
        count(severities.count("warning"), "warning"),
        f"{count(losses, 'data loss', 'data losses')} in {len(lossy)} of {len(results.recordings)} runs",
    ]
    if results.conventions:
        parts.append(f"{len(broken)} of {count(len(results.conventions), 'sign and frame self-test')} failed")
    clean = not losses and not broken and not {"error", "warning"} & set(severities)
    return Text(" · ".join(parts) + ".", tone="muted" if clean else "undecided")


def _sorted(notices: tuple[Notice, ...]) -> list[Notice]:
    return sorted(notices, key=lambda notice: ("error", "warning", "info").index(notice.severity))


def _entry(notice: Notice) -> tuple[str, str, str, str]:
    return notice.severity, notice.what, notice.where, notice.remedy


def _figure(requirement: Requirement) -> Figure:
    title = f"{requirement.name}: {requirement.statistic} by channel, frame {frame_label(requirement.frame)}"
    found = ", ".join(f"{row.channel} {number(row.value)}" for row in requirement.channels)
    alt = f"Measured {requirement.statistic} in {requirement.unit}: {found}; limit {exact(requirement.limit)}"
    return Figure(title, (_against_limit(requirement, alt),), _SAYS.caption("channels"))


def _against_limit(requirement: Requirement, alt: str) -> Picture:
    """Draw each channel's measured value with its 95 % interval, the predicted one, and the limit."""
    rows = requirement.channels
    with draw.style():
        figure, axis = draw.canvas(0.75 + 0.36 * len(rows))
        place = np.arange(len(rows), dtype=float)
        axis.barh(
            place - 0.19,
            [row.value or 0.0 for row in rows],
            0.34,
            xerr=_reach(rows),
            color=draw.MEASURED,
            error_kw={"elinewidth": 0.9, "capsize": 2, "ecolor": draw.INK},
            label="measured, 95 % interval",
        )
        if any(row.predicted is not None for row in rows):
            axis.barh(
                place + 0.19, [row.predicted or 0.0 for row in rows], 0.34, color=draw.PREDICTED, label="predicted"
            )
        axis.axvline(requirement.limit, color=draw.LIMIT, linewidth=1.2, label="limit")
        axis.set_yticks(place, [label(row.channel) for row in rows])
        axis.invert_yaxis()
        axis.set_xlim(left=0.0)
        axis.grid(visible=False, axis="y")
        axis.set_xlabel(f"{requirement.statistic} / {unit(requirement.unit)}")
        draw.legend_above(figure)
        return draw.picture(figure, alt)


def _reach(rows: Sequence[ChannelResult]) -> list[list[float]]:
    """How far each channel's interval reaches below and above its value; not at all where there is none."""
    values = [row.value or 0.0 for row in rows]
    lows = [value if row.low is None else row.low for value, row in zip(values, rows, strict=True)]
    highs = [value if row.high is None else row.high for value, row in zip(values, rows, strict=True)]
    return [
        [value - low for value, low in zip(values, lows, strict=True)],
        [high - value for value, high in zip(values, highs, strict=True)],
    ]
