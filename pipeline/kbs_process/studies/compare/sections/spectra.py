"""Spectra of the channels that decide, one over the other."""

from __future__ import annotations

from kbs_process.report import draw
from kbs_process.report.panel import Figure, Panel, Picture
from kbs_process.report.prose import Prose
from kbs_process.report.tables import Table, Tables
from kbs_process.report.text import unit
from kbs_process.studies.compare.results import ComparisonResults

_SAYS = Prose("kbs_process.studies.compare", "sections")
_SIDES = {"measured": "-", "predicted": (0, (3, 2))}


def panel(results: ComparisonResults, tables: Tables) -> Panel | None:
    """One plate a requirement."""
    read = [tables.read("spectra", str(place)) for place in range(len(results.compared))]
    plates = []
    for number, one in enumerate(results.requirements):
        curves = [
            (table, draw.SERIES[place % len(draw.SERIES)], f"{results.compared[place].mark} {one.channel[place]}")
            for place, table in enumerate(read)
            if table is not None and f"{number}.measured" in table.columns
        ]
        if curves:
            plates.append(_plate(number, one.name, curves))
    if not plates:
        return None
    figure = Figure("Power spectral densities of the channels that decide", tuple(plates), _SAYS.caption("spectra"))
    return Panel("spectra", "Spectra", "At which frequencies do the results differ?", (figure,))


def _plate(number: int, title: str, curves: list[tuple[Table, str, str]]) -> Picture:
    with draw.style():
        figure, axis = draw.canvas(3.0)
        for table, color, name_of in curves:
            for side, line in _SIDES.items():
                name = f"{number}.{side}"
                if name in table.columns:
                    label = name_of if side == "measured" else ""
                    f, density = table.columns[f"{name}.f"], table.columns[name]
                    axis.plot(f[1:], density[1:], color=color, linestyle=line, linewidth=0.8, label=label)
        x, y = axis.dataLim.intervalx, axis.dataLim.intervaly
        draw.logarithmic(axis, "x", *x)
        draw.logarithmic(axis, "y", *y)
        axis.set_xlabel("frequency / Hz")
        axis.set_ylabel(f"density / ({unit(curves[0][0].unit(f'{number}.measured'))})")
        draw.legend_above(figure)
        return draw.picture(figure, f"{title}: power spectral densities", title)
