"""One look for all figures, and their way into the page: the same figure always gives the same bytes."""

from __future__ import annotations

import base64
import io
import math
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Literal

import matplotlib
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter
from PIL import Image

from kbs_process.report.panel import Picture
from kbs_process.report.text import number, power

_COLORS = 48
WIDTH = 7.1  # in: the text width of an A4 page
INK = "#20262e"
MEASURED = "#1f4e79"
PREDICTED = "#f0a94a"
RESIDUAL = "#7c8591"
LIMIT = "#b3261e"
SHADE = "#e6e9ed"
SERIES = ("#1f4e79", "#d97706", "#4c956c", "#8e5ea2", "#7c8591", "#c1666b", "#2a9d8f", "#b08968")

# The computed curve is broad and pale under the measured one, so that both show where they agree.
LINES: dict[str, dict[str, Any]] = {
    "measured": {"color": MEASURED, "linewidth": 0.6, "zorder": 3},
    "predicted": {"color": PREDICTED, "linewidth": 1.5, "zorder": 2},
    "static": {"color": PREDICTED, "linewidth": 1.5, "zorder": 2},
    "residual": {"color": RESIDUAL, "linewidth": 0.6, "zorder": 3},
}

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


def logarithmic(axes: Axes, which: Literal["x", "y"], low: float, high: float) -> None:
    """Make an axis logarithmic, with a label at every decade, at 1, 2 and 5, or at equal steps over less than one."""
    decades = math.log10(high / low) if high > low > 0.0 else 1.0
    axis: Axis = axes.xaxis if which == "x" else axes.yaxis
    axes.set(**{f"{which}scale": "log", f"{which}lim": (low, high)})
    if decades < 1.0:
        axis.set_major_locator(MaxNLocator(4))
        axis.set_major_formatter(FuncFormatter(lambda value, _: number(value, 2)))
    else:
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if decades < 2.0 else (1.0,), numticks=8))
        axis.set_major_formatter(FuncFormatter(lambda value, _: power(value)))
    axis.set_minor_formatter(NullFormatter())


@contextmanager
def style() -> Iterator[None]:
    """Draw in the report's look, whatever the user's matplotlib is set to."""
    with matplotlib.rc_context(), warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph .* missing from")
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(_STYLE)
        yield


def canvas(height: float, *, width: float = WIDTH) -> tuple[Figure, Axes]:
    """Return a figure with one pair of axes."""
    figure = Figure(figsize=(width, height), layout="constrained")
    return figure, figure.subplots()


def ladder(rows: int, columns: int, row_height: float, *, gap: float) -> tuple[Figure, list[Axes]]:
    """Return a figure of many axes, row by row, with fixed margins (in): much faster than fitted ones."""
    left, right, top, bottom, between = 0.68, 0.06, 0.22, 0.42, 0.62
    height = rows * row_height + (rows - 1) * gap + top + bottom
    figure = Figure(figsize=(WIDTH, height))
    axes_width = (WIDTH - left - right - (columns - 1) * between) / columns
    grid = figure.subplots(
        rows,
        columns,
        squeeze=False,
        gridspec_kw={
            "left": left / WIDTH,
            "right": 1.0 - right / WIDTH,
            "top": 1.0 - top / height,
            "bottom": bottom / height,
            "wspace": between / axes_width,
            "hspace": gap / row_height,
        },
    )
    return figure, [axes for row in grid for axes in row]


def picture(figure: Figure, alt: str, title: str = "", form: Literal["svg", "png"] = "svg") -> Picture:
    """Return the figure as a data URI: SVG, or PNG where its curves are dense."""
    content = io.BytesIO()
    if form == "svg":
        nothing = dict.fromkeys(("Date", "Creator", "Format", "Type"))
        figure.savefig(content, format="svg", metadata=nothing)
    else:
        drawn = io.BytesIO()
        figure.savefig(drawn, format="png", dpi=150, pil_kwargs={"compress_level": 0})
        # A palette makes the page half as large, and so few hues need no more.
        Image.open(drawn).convert("RGB").quantize(_COLORS).save(content, "PNG")
    kind = "image/svg+xml" if form == "svg" else "image/png"
    uri = f"data:{kind};base64,{base64.b64encode(content.getvalue()).decode('ascii')}"
    return Picture(uri, alt, title, round(100.0 * figure.get_figwidth() / WIDTH))
