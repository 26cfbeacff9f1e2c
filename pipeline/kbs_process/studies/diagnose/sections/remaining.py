"""What is left, and where does it live?"""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure as Canvas

from kbs_process.report import curves, draw
from kbs_process.report.panel import Block, Caption, Figure, Panel, Picture, Text
from kbs_process.report.tables import Tables
from kbs_process.report.text import label, number
from kbs_process.studies.diagnose.results import DiagnosisResults, Trial

_CHANNELS = Caption(
    shown="Residual of each channel over the repeatability, with the corrected model.",
    good="About 1 everywhere.",
    bad="One channel far above the others: its own sensor. One axis' channels: physics of that axis.",
    do="Look at that channel's spectrum and history below.",
)
_SPECTRA = Caption(
    shown="Power spectral density of the residual, and that of the repeatability (dashed): nominal parameters refitted "
    "(before), corrected model (after).",
    good="After lies on the repeatability at all frequencies.",
    bad="A hump above the repeatability: an effect that is still missing.",
    do="Find the motor order or resonance at the hump.",
)
_HISTORIES = Caption(
    shown="The same in time, in the channels' units.",
    good="After looks like noise, whatever the drives do. Rounding of an encoder (half a step at most) belongs to the "
    "repeatability, and moves with the drives.",
    bad="Bursts that recur with position, rate or time.",
    do="Compare their instants with the commands.",
)


def panel(results: DiagnosisResults, tables: Tables) -> Panel:
    """Channels of all recordings, spectra and histories of those held out."""
    blocks: list[Block] = [Figure("Residual, channel by channel", (_levels(results.trials),), _CHANNELS)]
    shown = [entry for entry in results.trials if entry.role == "held-out"] or list(results.trials)
    spectra, histories = [], []
    for entry in shown:
        channels = tuple(entry.channels)
        if (table := tables.read("residual_spectrum", entry.recording)) is not None:
            spectra.append(curves.spectra(table, channels, entry.recording, below="repeatability"))
        if (table := tables.read("residual", entry.recording)) is not None:
            histories.append(curves.histories(table, channels, entry.recording))
    if spectra:
        blocks.append(Figure("Spectra of the residual", tuple(spectra), _SPECTRA))
    if histories:
        blocks.append(Figure("Histories of the residual", tuple(histories), _HISTORIES))
    blocks += [Text(note) for note in results.notes]
    return Panel("remaining", "What remains", "How large is the residual, and where is it?", tuple(blocks))


def _levels(entries: tuple[Trial, ...]) -> Picture:
    """Draw what is left over the floor, channel by channel."""
    names = tuple(dict.fromkeys(name for entry in entries for name in entry.channels))
    values = np.array([[entry.channels.get(name, np.nan) for name in names] for entry in entries])
    with draw.style():
        figure = Canvas(figsize=(draw.WIDTH, 0.7 + 0.26 * len(entries)), layout="constrained")
        axis = figure.subplots()
        top = max(2.0, float(np.nanmax(values)))
        image = axis.imshow(values, cmap="Blues", vmin=1.0, vmax=top, aspect="auto")
        axis.set_xticks(range(len(names)), names)
        axis.set_yticks(range(len(entries)), [label(entry.recording, 24) for entry in entries])
        axis.grid(visible=False)
        for row, column in np.argwhere(np.isfinite(values)):
            value = values[row, column]
            color = "white" if value > 0.5 * (1.0 + top) else draw.INK
            axis.text(column, row, number(value), ha="center", va="center", color=color, fontsize=6)
        figure.colorbar(image, ax=axis, label="over repeatability")
        return draw.picture(figure, f"Residual over repeatability by channel, up to {number(float(np.nanmax(values)))}")
