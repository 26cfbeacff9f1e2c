"""Signal against noise over the repeats of a trajectory."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kbs_process.report import draw
from kbs_process.report.panel import Block, Cell, Figure, Fold, Grid, Panel, Picture, Text
from kbs_process.report.prose import Prose
from kbs_process.report.tables import Tables
from kbs_process.report.text import frame_label, label, number, unit
from kbs_process.studies.correlate.choose import PLATES, band_label, folded, main_band, main_frame
from kbs_process.studies.correlate.results import Repeatability, Results

_SAYS = Prose("kbs_process.studies.correlate", "repeatability")


def panel(results: Results, tables: Tables) -> Panel:
    """Bars and a table for the requirement's band and frame; the others on demand."""
    question = "Is what was measured the mechanism's, or noise?"
    rows = results.repeatability
    if not rows:
        text = Text("No trajectory was recorded more than once: repeats cannot separate signal and noise.")
        return Panel("repeatability", "Repeatability", question, (text,))
    band, frame = main_band(results), main_frame(results)
    first = tuple(row for row in rows if (row.band, row.frame) == (band, frame)) or rows
    rest = tuple(row for row in rows if row not in first)
    pictures = []
    for trajectory in list(dict.fromkeys(row.trajectory for row in first))[:PLATES]:
        shown = [row for row in first if row.trajectory == trajectory]
        alt = f"{trajectory}: rms of signal and noise of each channel"
        title = f"{trajectory}, {shown[0].n} runs"
        pictures.append(_bars(shown, alt, title))
    title = f"Signal and noise, {band_label(results, first[0].band)}, {frame_label(first[0].frame)}"
    blocks: list[Block] = [Figure(title, tuple(pictures), _SAYS.caption("signal"))]
    blocks.extend(folded(_table(results, first, "Repeatability"), "Further rows"))
    if rest:
        blocks.append(Fold("Other bands and frames", (_table(results, rest, "Repeatability, other bands"),)))
    return Panel("repeatability", "Repeatability", question, tuple(blocks))


def _table(results: Results, rows: tuple[Repeatability, ...], title: str) -> Grid:
    head = ("Trajectory", "Band", "Frame", "Channel", "Runs", "Signal rms", "Noise rms", "Ratio", "Unit")
    body = tuple(
        (
            row.trajectory,
            band_label(results, row.band),
            row.frame,
            row.channel,
            str(row.n),
            number(row.signal_rms),
            number(row.noise_rms),
            Cell(number(row.ratio, 2), "undecided" if row.ratio is not None and row.ratio < 1.0 else ""),
            unit(row.unit),
        )
        for row in rows
    )
    return Grid(title, head, body, "kkckrrrrk")


def _bars(rows: Sequence[Repeatability], alt: str, title: str) -> Picture:
    """Draw rms of signal and of noise of every channel, on a logarithmic axis."""
    with draw.style():
        figure, axis = draw.canvas(0.8 + 0.3 * len(rows))
        place = np.arange(len(rows), dtype=float)
        for values, offset, color, name in (
            ([row.signal_rms or np.nan for row in rows], -0.18, draw.MEASURED, "signal"),
            ([row.noise_rms or np.nan for row in rows], 0.18, draw.RESIDUAL, "noise"),
        ):
            axis.barh(place + offset, values, 0.34, color=color, label=name)
        found = [value for row in rows for value in (row.signal_rms, row.noise_rms) if value]
        draw.logarithmic(axis, "x", 0.5 * min(found, default=0.1), 1.5 * max(found, default=1.0))
        axis.set_yticks(place, [f"{label(row.channel)} / {unit(row.unit)}" for row in rows])
        axis.invert_yaxis()
        axis.grid(visible=False, axis="y")
        axis.set_xlabel("rms, in the channel's unit")
        draw.legend_above(figure)
        return draw.picture(figure, alt, title)
