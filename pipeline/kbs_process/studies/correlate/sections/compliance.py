"""Is every requirement met, and what qualifies the answer?"""

from __future__ import annotations

from kbs_process.report.panel import Block, Caption, Cell, Figure, Fold, Grid, Notices, Panel, Text
from kbs_process.report.tables import Tables
from kbs_process.report.text import MISSING, band_hz, count, exact, frame_label, measure, number, percent, unit
from kbs_process.studies.correlate.figures import bars
from kbs_process.studies.correlate.results import Notice, Requirement, Results

_CAPTION = Caption(
    shown="Each channel's measured value in the recording that is nearest to failing, with the interval that holds the "
    "true one at 95 %, the prediction's largest, and the limit. The interval of a peak reaches further down than up: "
    "noise raises a peak and never lowers it.",
    good="Every bar with its interval ends left of the limit, and the prediction is a little above the measurement.",
    bad="An error bar that reaches the limit: the verdict is then undecided. A prediction well below the "
    "measurement: it must not be used to extrapolate to flight.",
    do="For the channel nearest to its limit, go to its time history, then to the uncertainty budget for "
    "what would narrow the bar.",
)


def panel(results: Results, tables: Tables) -> Panel:
    """Compliance table, warnings and data losses right under it, and the channels behind the verdict."""
    blocks: list[Block] = [_table(results)] if results.requirements else []
    if not results.requirements:
        blocks.append(Text("This campaign states no requirement; the report compares, and gives no verdict."))
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
            f"{entry.name} ({entry.statistic}, {entry.frame})",
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
    note = (
        "Interval: two standard deviations above the measured value; below it two for an rms, for a peak as many as "
        "noise alone may make of one. Elsewhere in this report ± is one standard deviation. Margin: limit less "
        "measured value."
    )
    sources = "; ".join(dict.fromkeys(entry.source for entry in results.requirements if entry.source))
    return Grid("Compliance", head, rows, "llrrrrlrc", f"{note} Source: {sources}." if sources else note)


def _interval(entry: Requirement) -> str:
    if entry.low is None or entry.high is None:
        return MISSING
    return f"{number(entry.low)} to {number(entry.high)} {unit(entry.unit)}"


def _margin(entry: Requirement) -> str:
    if entry.margin is None:
        return MISSING
    return f"{number(entry.margin)} {unit(entry.unit)} ({percent(entry.margin / entry.limit, 2)})"


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
    return Figure(title, (bars.against_limit(requirement, alt),), _CAPTION)
