"""Spectra with the resonances on the transducer and the band edges."""

from __future__ import annotations

import math

import numpy as np

from kbs_process.report import draw, series, sheet
from kbs_process.report.panel import Block, Figure, Grid, Live, Panel, Picture, Text, View
from kbs_process.report.prose import Prose
from kbs_process.report.tables import Table, Tables
from kbs_process.report.text import frame_label, measure, number, unit
from kbs_process.signals.records import Array
from kbs_process.studies.correlate.choose import PLATES, by_role
from kbs_process.studies.correlate.results import Resonance, Results

_SAYS = Prose("kbs_process.studies.correlate", "spectra")
_KINDS = ("measured", "predicted")
_BINS = 500
_APART = 0.15  # in: resonances that are closer on the sheet share a label


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
        _densities(
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
        views = tuple(_view(results, recording.name, table, edges) for recording, table in found)
        live = Live("spectra", _KINDS, views, two_scales=False, along=("frequency", "f", "Hz"), choosing="Frame")
        blocks.append(Figure(title, pictures, _SAYS.caption("densities"), live))
    else:
        blocks.append(Text("No recording has a spectrum table."))
    if results.resonances:
        rows = tuple(
            (entry.axis, f"{measure(entry.frequency_Hz, entry.sigma_Hz)} Hz", entry.source)
            for entry in results.resonances
        )
        blocks.append(Grid("Resonances on the transducer", ("Axis", "Frequency", "Source"), rows, "lrl"))
    return Panel("spectra", "Spectra", question, tuple(blocks))


def _view(results: Results, name: str, table: Table, edges: list[float]) -> View:
    resonances = ((one.frequency_Hz, "fail") for one in results.resonances)
    channels = [
        (channel, table.unit(channel), [table.columns[column] for column in columns])
        for channel in table.channels
        if (columns := [at for kind in _KINDS if (at := f"{channel}.{kind}") in table.columns])
    ]
    marks = (*((edge, "ink") for edge in edges), *resonances)
    return series.spectra(name, frame_label(results.campaign.frame), table.columns["f"], channels, marks)


def _densities(
    table: Table, resonances: tuple[Resonance, ...], edges: tuple[float, ...], *, alt: str, title: str
) -> Picture:
    """Draw measured and predicted density of every channel on logarithmic scales, down the columns."""
    channels = table.channels
    columns = 2 if len(channels) > 1 else 1
    rows = math.ceil(len(channels) / columns)
    with draw.style():
        plate = sheet.Sheet(rows, columns, 1.14 if rows > 1 else 2.2, gap=0.12)
        names: set[str] = set()
        for index, channel in enumerate(channels):
            column, row = divmod(index, rows)
            curves = _curves(table, channel)
            frequencies, densities = (
                _range(*(f for f, _ in curves.values())),
                _range(*(density for _, density in curves.values())),
            )
            panel = plate.panel(row, column, frequencies, (0.5 * densities[0], 2.0 * densities[1]), logarithmic=True)
            for name, (frequency, density) in curves.items():
                panel.curve(frequency, density, draw.LINES[name])
            _marks(panel, resonances, edges, named=index == 0)
            lowest = row == rows - 1 or index == len(channels) - 1
            panel.frame(f"{channel} / {unit(table.unit(channel))}", below="frequency / Hz" if lowest else None)
            names |= curves.keys()
        plate.key(0, sorted(names))
        return draw.picture(plate.figure, alt, title, "png")


def _curves(table: Table, channel: str) -> dict[str, tuple[Array, Array]]:
    """Return the channel's densities."""
    return {
        kind: _thinned(table.columns["f"], table.columns[f"{channel}.{kind}"])
        for kind in _KINDS
        if f"{channel}.{kind}" in table.columns
    }


def _thinned(f: Array, density: Array) -> tuple[Array, Array]:
    """Keep the greatest density of each of many equal steps of log frequency, so that no line is lost.

    Noughts, which a logarithmic scale cannot show, are left out.
    """
    usable = (f > 0) & (density > 0)
    f, density = f[usable], density[usable]
    if len(f) <= _BINS:
        return f, density
    step = np.log(f[-1] / f[0]) / _BINS
    bins = np.minimum((np.log(f / f[0]) / step).astype(np.intp), _BINS - 1)
    order = np.lexsort((-density, bins))
    keep = np.sort(order[np.unique(bins[order], return_index=True)[1]])
    return f[keep], density[keep]


def _range(*values: Array) -> tuple[float, float]:
    """Return the least and the greatest of all positive values; a decade where there are none."""
    found = np.concatenate(values)
    return (float(found.min()), float(found.max())) if found.size else (0.1, 1.0)


def _marks(panel: sheet.Panel, resonances: tuple[Resonance, ...], edges: tuple[float, ...], *, named: bool) -> None:
    """Draw band edges and resonances within the panel's range, these with their frequencies in the first panel."""
    shown = [edge for edge in edges if panel.x.low <= edge <= panel.x.high]
    panel.upright(shown, colors=draw.INK, linewidths=0.7, linestyles=[(0, (1, 1.5))], zorder=1)
    near = sorted({one.frequency_Hz for one in resonances if panel.x.low <= one.frequency_Hz <= panel.x.high})
    panel.upright(near, colors=draw.LIMIT, linewidths=0.7, linestyles=[(0, (4, 2))], zorder=1)
    groups: list[list[float]] = []
    for frequency in near if named else ():
        if groups and panel.x.place(frequency) - panel.x.place(groups[-1][0]) < _APART:
            groups[-1].append(frequency)
        else:
            groups.append([frequency])
    for group in groups:
        panel.sheet.axes.text(
            float(panel.x.place(group[0])) - 0.02,
            panel.y.end - 0.015,
            " to ".join(dict.fromkeys(number(frequency) for frequency in (group[0], group[-1]))) + " Hz",
            rotation=90,
            ha="right",
            va="top",
            fontsize=5.5,
            color=draw.LIMIT,
            bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 0.4},
        )
