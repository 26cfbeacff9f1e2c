"""The onset of instability found by simulation, beside the predicted one."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from kbs_process.report import draw
from kbs_process.report.panel import Block, Figure, Grid, Panel, Picture, Text
from kbs_process.report.prose import Prose
from kbs_process.report.tables import Tables
from kbs_process.report.text import number, percent
from kbs_process.studies.stability.results import OnsetAt, StabilityResults

_SAYS = Prose("kbs_process.studies.stability", "onset")
_SMOOTH: dict[str, Any] = {"linestyle": "none", "marker": "o", "markersize": 4.5, "color": draw.MEASURED}
_FRICTION: dict[str, Any] = {**_SMOOTH, "marker": "s", "markerfacecolor": "white", "markeredgecolor": draw.LIMIT}


def panel(results: StabilityResults, tables: Tables) -> Panel:
    """Figure and tables of onsets and limit cycles."""
    question = "Does the non-linear plant become unstable where the linear one says?"
    alt = "Critical gain factor, predicted and simulated, over the angle and over the plane of gains"
    blocks: list[Block] = [
        _words(results),
        Figure("Onset of instability", (_onsets(results, alt),), _SAYS.caption("onset")),
        _table(results.onsets, results.joint),
        _cycles(results),
    ]
    return Panel("onset", "Onset by simulation", question, tuple(blocks))


def _words(results: StabilityResults) -> Text:
    smooth = [e for e in results.onsets if not e.friction and e.found is not None]
    off = max((abs((e.found or 0.0) / e.predicted - 1.0) for e in smooth), default=None)
    return Text(_SAYS("kick", kick_mrad=1e3 * results.kick_rad, off=off, count=len(smooth)))


def _table(onsets: tuple[OnsetAt, ...], joint: str) -> Grid:
    head = (f"Angle of {joint}", "Ki weight", "Friction", "Predicted", "Found", "±", "Deviation", "Frequency / Hz")
    rows = tuple(
        (
            f"{number(math.degrees(e.angle_rad))}°",
            number(e.integral_weight),
            "yes" if e.friction else "no",
            number(e.predicted, 4),
            number(e.found, 4),
            number(e.half_width, 2),
            percent(None if e.found is None else e.found / e.predicted - 1.0, 2),
            number(e.frequency_Hz, 2),
        )
        for e in onsets
    )
    return Grid("Onsets", head, rows, "krlrrrrr", _SAYS("onsets_note"))


def _cycles(results: StabilityResults) -> Grid:
    rows = tuple(
        (
            number(e.factor, 3),
            percent(e.share_of_critical, 2),
            f"{number(1e6 * e.rms_rad)} µrad",
            percent(e.rms_rad / results.encoder_step_rad if results.encoder_step_rad > 0.0 else None, 2),
            number(e.frequency_Hz, 2),
        )
        for e in results.limit_cycles
    )
    head = ("Factor on the gains", "of the critical one", "Joint's rms", "of an encoder code", "Frequency / Hz")
    return Grid("Limit cycles", head, rows, "rrrrr", _SAYS("limit_cycles"))


def _onsets(results: StabilityResults, alt: str) -> Picture:
    """Draw the critical factor over the angle, the boundary in the plane of both gains, and what simulations found."""
    with draw.style():
        figure, (over, plane) = draw.row(2.8, 2)
        angle = np.degrees([entry.angle_rad for entry in results.critical])
        factor = np.array([entry.factor or np.nan for entry in results.critical])
        over.plot(angle, factor, color=draw.PREDICTED, linewidth=1.6, label="predicted")
        at_one = [entry for entry in results.onsets if entry.integral_weight == 1.0]
        for friction, look, name in ((False, _SMOOTH, "simulated"), (True, _FRICTION, "simulated, with friction")):
            _marks(over, [e for e in at_one if e.friction is friction], look, name)
        middle = float(np.nanmean(factor)) if np.isfinite(factor).any() else 1.0
        over.set_ylim(0.8 * middle, 1.2 * middle)
        over.set_xlabel(f"{results.joint} / °")
        over.set_ylabel("factor on Kp and Ki")
        over.legend(loc="lower right", fontsize=6.5)
        plane.plot(
            [entry.integral for entry in results.boundary],
            [entry.proportional for entry in results.boundary],
            color=draw.PREDICTED, linewidth=1.6, label="boundary",
        )  # fmt: skip
        there = [e for e in results.onsets if not e.friction and e.angle_rad == results.worst_angle_rad and e.found]
        plane.plot([e.integral_weight * (e.found or 0.0) for e in there], [e.found or 0.0 for e in there], **_SMOOTH)
        plane.plot([1.0], [1.0], linestyle="none", marker="*", markersize=8, color=draw.LIMIT, label="as run")
        plane.set_xlim(left=0.0)
        plane.set_ylim(bottom=0.0)
        plane.set_xlabel("factor on Ki")
        plane.set_ylabel("factor on Kp")
        plane.legend(fontsize=6.5)
        return draw.picture(figure, alt)


def _marks(axis: Axes, entries: list[OnsetAt], look: dict[str, Any], name: str) -> None:
    found = [entry for entry in entries if entry.found is not None]
    axis.plot(np.degrees([e.angle_rad for e in found]), [e.found or np.nan for e in found], label=name, **look)
