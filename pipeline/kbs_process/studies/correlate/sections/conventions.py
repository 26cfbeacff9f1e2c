"""Signs and frames: printed, drawn and tested on the campaign's own data."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from kbs_process.report import draw
from kbs_process.report.panel import Block, Cell, Figure, Grid, Panel, Picture, Text
from kbs_process.report.prose import Prose
from kbs_process.report.tables import Tables
from kbs_process.signals.records import Array
from kbs_process.stages.conventions import SignCheck
from kbs_process.studies.correlate.choose import at_spacecraft
from kbs_process.studies.correlate.results import Results

_SAYS = Prose("kbs_process.studies.correlate", "conventions")

# Oblique projection: x towards the reader and left, y right, z up.
_PROJECTION = np.array([[-0.55, 1.0, 0.0], [-0.42, 0.0, 1.0]])
_AXES = (("x", draw.SERIES[5]), ("y", draw.SERIES[2]), ("z", draw.SERIES[0]))


def panel(results: Results, tables: Tables) -> Panel:
    """Definitions, the drawing, and the outcome of every self-test."""
    spacecraft = at_spacecraft(results)
    picture = _frames("Frame T with its axes and positive torques", spacecraft=spacecraft)
    names = ("transducer", "wrench", "torques", *(("spacecraft",) if spacecraft else ()))
    blocks: list[Block] = [
        Text("Definitions:", tuple(map(_SAYS, names))),
        Figure("Frames and signs", (picture,), _SAYS.caption("frames")),
    ]
    rows = tuple((entry.check, entry.expected, entry.found, _outcome(entry)) for entry in results.conventions)
    if rows:
        blocks.append(
            Grid("Self-tests on this campaign's data", ("Check", "Expected", "Found", "Outcome"), rows, "lllc")
        )
    else:
        blocks.append(Text("No self-test of signs and frames was made."))
    return Panel("conventions", "Signs and frames", "Do recorder and model use the same signs?", tuple(blocks))


def _outcome(entry: SignCheck) -> Cell:
    if not entry.testable:
        return Cell("not testable", "muted")
    return Cell("ok", "pass") if entry.ok else Cell("failed", "fail")


def _frames(alt: str, *, spacecraft: bool) -> Picture:
    """Draw T on the transducer's top plate, positive torques, the weight, and S where there is one."""
    with draw.style():
        figure, axis = draw.canvas(1.9, width=4.6)
        axis.set_axis_off()
        axis.set_aspect("equal")
        _plate(axis)
        _triad(axis, np.zeros(3), 1.25, "T", torques=True)
        if spacecraft:
            origin = np.array([0.0, 2.5, 0.55])
            line = np.stack([_flat(np.zeros(3)), _flat(origin)])
            axis.plot(line[:, 0], line[:, 1], color=draw.RESIDUAL, linewidth=0.8, linestyle=(0, (3, 2)))
            _triad(axis, origin, 0.7, "S", torques=False)
        start = np.array([0.0, -1.35, 1.0])
        _arrow(axis, start, np.array([0.0, 0.0, -0.8]), draw.INK)
        place = _flat(start + np.array([0.0, -0.08, -0.4]))
        axis.text(place[0], place[1], "g, where z is up:\nat rest Fz < 0", ha="right", va="center")
        axis.margins(0.08)
        return draw.picture(figure, alt)


def _flat(point: Array) -> Array:
    flat: Array = _PROJECTION @ point
    return flat


def _arrow(axis: Axes, start: Array, along: Array, color: str) -> None:
    tail, head = _flat(start), _flat(start + along)
    axis.annotate(
        "",
        xy=(head[0], head[1]),
        xytext=(tail[0], tail[1]),
        arrowprops={"arrowstyle": "-|>", "color": color, "linewidth": 1.3, "shrinkA": 0, "shrinkB": 0},
    )
    axis.plot([tail[0], head[0]], [tail[1], head[1]], linestyle="none")  # for the limits of the axes


def _triad(axis: Axes, origin: Array, length: float, name: str, *, torques: bool) -> None:
    for index, (letter, color) in enumerate(_AXES):
        direction = np.eye(3)[index]
        _arrow(axis, origin, length * direction, color)
        place = _flat(origin + 1.14 * length * direction)
        axis.text(place[0], place[1], f"{letter}", ha="center", va="center", color=color, weight="bold")
        if torques:
            _circle(axis, origin + 0.72 * length * direction, index, color)
    place = _flat(origin)
    axis.text(place[0] + 0.08, place[1] - 0.17, name, weight="bold")


def _circle(axis: Axes, centre: Array, about: int, color: str) -> None:
    """Three quarters of a turn about an axis, in the positive (right-handed) sense."""
    u, v = np.eye(3)[(about + 1) % 3], np.eye(3)[(about + 2) % 3]
    angle = np.linspace(-0.3, 1.4 * np.pi, 40)
    turn = _PROJECTION @ (centre[:, None] + 0.17 * (np.outer(u, np.cos(angle)) + np.outer(v, np.sin(angle))))
    axis.plot(turn[0], turn[1], color=color, linewidth=1.0)
    axis.annotate(
        "",
        xy=(turn[0, -1], turn[1, -1]),
        xytext=(turn[0, -3], turn[1, -3]),
        arrowprops={"arrowstyle": "-|>", "color": color, "linewidth": 1.0, "shrinkA": 0, "shrinkB": 0},
    )
    place = _flat(centre + 0.33 * (u + 0.2 * v))
    axis.text(place[0], place[1], f"+T{'xyz'[about]}", fontsize=6.5, color=color, ha="center", va="center")


def _plate(axis: Axes) -> None:
    corners = np.array([[0.6, -0.6, 0.0], [0.6, 0.6, 0.0], [-0.6, 0.6, 0.0], [-0.6, -0.6, 0.0]])
    outline = _PROJECTION @ corners.T
    axis.fill(outline[0], outline[1], facecolor=draw.SHADE, edgecolor="#b8bfc7", linewidth=0.8, zorder=0)
