"""How the figures were obtained, with every constant."""

from __future__ import annotations

from kbs_process.report.panel import Block, Grid, Panel, Text
from kbs_process.report.prose import Prose
from kbs_process.report.provenance import constants
from kbs_process.report.tables import Tables
from kbs_process.report.text import MISSING, number, percent
from kbs_process.studies.correlate.choose import band_range
from kbs_process.studies.correlate.results import Results

_SAYS = Prose("kbs_process.studies.correlate", "methods")


def panel(results: Results, tables: Tables) -> Panel:
    """The methods paragraphs, the bands and their edges, and the constants."""
    paragraphs = [" ".join(part.split()) for part in results.methods.split("\n\n") if part.strip()]
    blocks: list[Block] = [Text(paragraph) for paragraph in paragraphs]
    if results.bands:
        blocks.append(_bands(results))
    if results.parameters:
        blocks.append(constants(results.parameters))
    return Panel("methods", "Methods", "How were these figures obtained?", tuple(blocks))


def _bands(results: Results) -> Grid:
    rows = tuple(
        (
            band.label,
            band_range(band),
            band.method,
            f"{number(band.edge_s, 3)}\u00a0s" if band.edge_s else MISSING,
            percent(band.edge_error, 2),
            percent(band.edge_error_drift, 2),
        )
        for band in results.bands
    )
    head = ("Band", "Range", "Method", "Edge", "Edge error, flat", "Edge error, drift")
    return Grid("Bands", head, rows, "lllrrr", _SAYS("bands_note"))
