"""One look for all figures, and their way into the page: the same figure always gives the same bytes."""

from __future__ import annotations

import base64
import io
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Literal

import matplotlib
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from kbs_process.report.panel import Picture

WIDTH = 7.1  # in: the text width of an A4 page
INK = "#20262e"
MEASURED = "#1f4e79"
PREDICTED = "#d97706"
RESIDUAL = "#7c8591"
LIMIT = "#b3261e"
SHADE = "#e6e9ed"
SERIES = ("#1f4e79", "#d97706", "#4c956c", "#8e5ea2", "#7c8591", "#c1666b", "#2a9d8f", "#b08968")

_STYLE: dict[Any, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 7.5,
    "text.parse_math": False,
    "text.color": INK,
    "axes.edgecolor": "#8a929c",
    "axes.labelcolor": INK,
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.titlesize": 8,
    "axes.titlelocation": "left",
    "axes.titleweight": "bold",
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#eceff2",
    "grid.linewidth": 0.6,
    "lines.linewidth": 0.8,
    "xtick.color": "#59626d",
    "ytick.color": "#59626d",
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "legend.frameon": False,
    "path.simplify": True,
    "path.simplify_threshold": 0.3,
    "svg.hashsalt": "kbs-process",
    "svg.fonttype": "path",
    "hatch.linewidth": 0.5,
}


@contextmanager
def style() -> Iterator[None]:
    """Draw in the report's look, whatever the user's matplotlib is set to."""
    with matplotlib.rc_context(), warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph .* missing from")
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(_STYLE)
        yield


def canvas(
    height: float, rows: int = 1, columns: int = 1, *, width: float = WIDTH
) -> tuple[Figure, list[Axes]]:
    """Return a figure and its axes, row by row."""
    figure = Figure(figsize=(width, height), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False)
    return figure, [axis for row in axes for axis in row]


def picture(figure: Figure, alt: str, title: str = "", form: Literal["svg", "png"] = "svg") -> Picture:
    """Return the figure as a data URI: SVG, or PNG where its curves are dense."""
    content = io.BytesIO()
    if form == "svg":
        nothing = dict.fromkeys(("Date", "Creator", "Format", "Type"))
        figure.savefig(content, format="svg", metadata=nothing)
    else:
        figure.savefig(content, format="png", dpi=150, metadata={"Software": None})
    kind = "image/svg+xml" if form == "svg" else "image/png"
    return Picture(f"data:{kind};base64,{base64.b64encode(content.getvalue()).decode('ascii')}", alt, title)
