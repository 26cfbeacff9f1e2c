"""Does the identified plant predict recordings that it has not seen?"""

from __future__ import annotations

from kbs_process.report import curves
from kbs_process.report.panel import Block, Cell, Figure, Grid, Panel
from kbs_process.report.prose import Prose
from kbs_process.report.tables import Tables
from kbs_process.report.text import exact, number
from kbs_process.studies.identify.results import IdentifyResults

_SAYS = Prose("kbs_process.studies.identify", "residuals")


def panel(results: IdentifyResults, tables: Tables) -> Panel:
    """Misfit by recording and channel, then spectra and histories of those held out."""
    rows = tuple(
        (
            m.recording,
            m.role,
            m.channel,
            number(m.before),
            Cell(number(m.after), "pass" if m.after < 1.05 else "undecided"),
        )
        for m in results.misfits
    )
    low, high = (exact(round(edge, 4)) for edge in results.band_Hz)
    note = (
        f"Residual over sensor noise, rms from {low} to {high} Hz (angles: as far as their rate goes); "
        "1 is all that can be reached."
    )
    head = ("Recording", "Role", "Channel", "Before", "After")
    blocks: list[Block] = [Grid("Residual over noise", head, rows, "llcrr", note)]
    shown = [m.recording for m in results.misfits if m.role == "held-out"] or [m.recording for m in results.misfits]
    spectra, histories = [], []
    for name in dict.fromkeys(shown):
        channels = tuple(dict.fromkeys(m.channel for m in results.misfits if m.recording == name))
        if (table := tables.read("residual_spectrum", name)) is not None:
            spectra.append(curves.spectra(table, channels, name))
        if (table := tables.read("residual", name)) is not None:
            histories.append(curves.histories(table, channels, name))
    if spectra:
        blocks.append(Figure("Spectra of the residual", tuple(spectra), _SAYS.caption("spectra")))
    if histories:
        blocks.append(Figure("Histories of the residual", tuple(histories), _SAYS.caption("histories")))
    return Panel(
        "residuals", "Held-out predictions", "Does it predict recordings that the fit has not seen?", tuple(blocks)
    )
