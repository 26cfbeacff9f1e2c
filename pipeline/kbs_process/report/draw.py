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
import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter
from PIL import Image

from kbs_process.report.panel import Picture
from kbs_process.report.text import number, power

_DPI = 150
WIDTH = 7.1  # in: the text width of an A4 page
INK = "#20262e"
MEASURED = "#1f4e79"
PREDICTED = "#f0a94a"
RESIDUAL = "#7c8591"
LIMIT = "#b3261e"
SHADE = "#e6e9ed"
GRID = "#eceff2"
AXIS = "#8a929c"
TICK = "#59626d"
SERIES = ("#1f4e79", "#d97706", "#4c956c", "#8e5ea2", "#7c8591", "#c1666b", "#2a9d8f", "#b08968")

# The computed curve is broad and pale under the measured one, so that both show where they agree.
LINES: dict[str, dict[str, Any]] = {
    "measured": {"color": MEASURED, "linewidth": 0.6, "zorder": 3},
    "predicted": {"color": PREDICTED, "linewidth": 1.5, "zorder": 2},
    "static": {"color": PREDICTED, "linewidth": 1.5, "zorder": 2},
    "residual": {"color": RESIDUAL, "linewidth": 0.6, "zorder": 3},
    "threshold": {"color": LIMIT, "linewidth": 0.8, "linestyle": (0, (4, 2)), "zorder": 4},
}

_STYLE: dict[Any, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 7.5,
    "text.parse_math": False,
    "text.color": INK,
    "axes.edgecolor": AXIS,
    "axes.labelcolor": INK,
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.titlesize": 8,
    "axes.titlelocation": "left",
    "axes.titleweight": "bold",
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": GRID,
    "grid.linewidth": 0.6,
    "lines.linewidth": 0.8,
    "xtick.color": TICK,
    "ytick.color": TICK,
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


def row(height: float, count: int, *, width: float = WIDTH, share_y: bool = False) -> tuple[Figure, list[Axes]]:
    """Return a figure with so many pairs of axes side by side."""
    figure = Figure(figsize=(width, height), layout="constrained")
    return figure, list(figure.subplots(1, count, squeeze=False, sharey=share_y)[0])


def grid(height: float, rows: int, columns: int = 1, *, share_x: bool = False) -> tuple[Figure, list[Axes]]:
    """Return a figure with rows and columns of axes, row by row."""
    figure = Figure(figsize=(WIDTH, height), layout="constrained")
    return figure, list(figure.subplots(rows, columns, squeeze=False, sharex=share_x).ravel())


def limits(axes: Axes, *levels: float) -> None:
    """Draw levels that are not to be passed."""
    for level in levels:
        axes.axhline(level, color=LIMIT, linewidth=0.8, linestyle=(0, (4, 2)))


def legend_above(figure: Figure) -> None:
    """Say above the axes what is what."""
    figure.legend(loc="outside upper left", ncols=4, fontsize=7)


def picture(figure: Figure, alt: str, title: str = "", form: Literal["svg", "png"] = "svg") -> Picture:
    """Return the figure as a data URI: SVG, or PNG where its curves are dense."""
    content = io.BytesIO()
    if form == "svg":
        nothing = dict.fromkeys(("Date", "Creator", "Format", "Type"))
        FigureCanvasSVG(figure)
        figure.dpi = 72
        if (layout := figure.get_layout_engine()) is not None:  # else a first drawing is made for it
            layout.execute(figure)
            figure.set_layout_engine(None)
        figure.savefig(content, format="svg", metadata=nothing)
    else:
        figure.dpi = _DPI
        canvas: Any = FigureCanvasAgg(figure)  # whose methods have no types
        canvas.draw()
        # Sixteen hues, four bits each, make the page half as large as all of them, and show the same.
        drawn = Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB")
        drawn.quantize(palette=_palette(), dither=Image.Dither.NONE).save(content, "PNG", bits=4)
    kind = "image/svg+xml" if form == "svg" else "image/png"
    uri = f"data:{kind};base64,{base64.b64encode(content.getvalue()).decode('ascii')}"
    return Picture(uri, alt, title, round(100.0 * figure.get_figwidth() / WIDTH))


def _palette() -> Image.Image:
    """The colours of the curves, and those between them and the paper that smooth edges need."""

    def mixed(color: str, share: float, ground: str = "white") -> list[int]:
        over, under = np.array(to_rgb(color)), np.array(to_rgb(ground))
        return [round(255 * part) for part in share * over + (1.0 - share) * under]

    shares = {
        INK: (1.0, 0.75), MEASURED: (1.0, 0.75, 0.5, 0.25), PREDICTED: (1.0, 0.6, 0.3),
        RESIDUAL: (1.0, 0.5), LIMIT: (1.0, 0.5), SHADE: (1.0,), "white": (1.0,),
    }  # fmt: skip
    colors = [mixed(color, share) for color, parts in shares.items() for share in parts]
    colors.append(mixed(MEASURED, 0.5, PREDICTED))
    palette = Image.new("P", (1, 1))
    palette.putpalette([part for color in colors for part in color])
    return palette
