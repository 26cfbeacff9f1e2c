"""Signal against noise over the repeats of a trajectory."""

from __future__ import annotations

from kbs_process.report.panel import Block, Caption, Cell, Figure, Fold, Grid, Panel, Text
from kbs_process.report.tables import Tables
from kbs_process.report.text import frame_label, number, unit
from kbs_process.studies.correlate.figures import bars
from kbs_process.studies.correlate.results import Repeatability, Results
from kbs_process.studies.correlate.sections.choose import band_label, folded, main_band, main_frame
from kbs_process.studies.correlate.sections.static import PLATES

_CAPTION = Caption(
    shown="For each channel the rms of what the repeats have in common (signal) and of what each has "
    "alone (noise), in the requirement's band.",
    good="Signal several times the noise.",
    bad="Noise as large as the signal, as the channel's comparison with a prediction then says nothing.",
    do="Record more repeats, or remove the noise's cause: see the spectra for its frequency and the "
    "budget for its stage.",
)


def panel(results: Results, tables: Tables) -> Panel:
    """Bars and a table for the requirement's band and frame; the others on demand."""
    question = "Is what was measured the mechanism's, or noise?"
    rows = results.repeatability
    if not rows:
        text = Text("No trajectory was recorded more than once: signal and noise cannot be told apart by repeats.")
        return Panel("repeatability", "Repeatability", question, (text,))
    band, frame = main_band(results), main_frame(results)
    first = tuple(row for row in rows if (row.band, row.frame) == (band, frame)) or rows
    rest = tuple(row for row in rows if row not in first)
    pictures = []
    for trajectory in list(dict.fromkeys(row.trajectory for row in first))[:PLATES]:
        shown = [row for row in first if row.trajectory == trajectory]
        alt = f"{trajectory}: rms of signal and noise of each channel"
        title = f"{trajectory}, {shown[0].n} runs"
        pictures.append(bars.signal_and_noise(shown, alt, title))
    title = f"Signal and noise, {band_label(results, first[0].band)}, {frame_label(first[0].frame)}"
    blocks: list[Block] = [Figure(title, tuple(pictures), _CAPTION)]
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
