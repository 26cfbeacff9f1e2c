"""Spectra with the resonances on the transducer and the band edges."""

from __future__ import annotations

from kbs_process.report.panel import Block, Caption, Figure, Grid, Panel, Text
from kbs_process.report.tables import Tables
from kbs_process.report.text import frame_label, measure
from kbs_process.studies.correlate.figures import spectra
from kbs_process.studies.correlate.results import Results
from kbs_process.studies.correlate.sections.choose import by_role
from kbs_process.studies.correlate.sections.static import PLATES

_CAPTION = Caption(
    shown="One-sided power spectral density of each channel at its full rate: measured and predicted. "
    "Dotted: edges of the bands. Dashed: resonances of the article on the transducer.",
    good="Measured and predicted agree within the band, and the resonance lies well above the band's edge.",
    bad="A resonance next to an edge: the filter then passes part of a response that belongs to the test "
    "rig, not to the mechanism. A measured floor well above the prediction: the channel shows noise, not "
    "disturbance.",
    do="With a resonance near the edge, read the narrower band first and compare what both engines give "
    "for the wider. A narrow line that only the measurement has is a candidate for physics that was left "
    "out.",
)


def panel(results: Results, tables: Tables) -> Panel:
    """One plate a recording, and the resonances with their sources."""
    question = "Where in frequency do measurement and prediction differ, and what lies next to a band's edge?"
    edges = sorted(
        {edge for band in results.bands for edge in (band.high_pass_Hz, band.low_pass_Hz) if edge is not None}
    )
    found = [
        (recording, table)
        for recording in by_role(results.recordings)
        if (table := tables.spectrum(recording.name)) is not None and table.channels
    ]
    pictures = tuple(
        spectra.spectra(
            table,
            results.resonances,
            tuple(edges),
            alt=f"{recording.name}: power spectral densities of {', '.join(table.channels)}",
            title=f"{recording.name} ({recording.role})",
        )
        for recording, table in found[:PLATES]
    )
    blocks: list[Block] = []
    if pictures:
        title = f"Power spectral densities, {frame_label(results.campaign.frame)}"
        blocks.append(Figure(title, pictures, _CAPTION))
    else:
        blocks.append(Text("No recording has a spectrum table."))
    if results.resonances:
        rows = tuple(
            (entry.axis, f"{measure(entry.frequency_Hz, entry.sigma_Hz)} Hz", entry.source)
            for entry in results.resonances
        )
        blocks.append(Grid("Resonances on the transducer", ("Axis", "Frequency", "Source"), rows, "lrl"))
    return Panel("spectra", "Spectra", question, tuple(blocks))
