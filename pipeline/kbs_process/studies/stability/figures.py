"""Margins, poles and onsets of a stability analysis."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from kbs_process.report import draw
from kbs_process.report.panel import Picture
from kbs_process.report.tables import Table
from kbs_process.studies.stability.results import OnsetAt, StabilityResults

_SMOOTH: dict[str, Any] = {"linestyle": "none", "marker": "o", "markersize": 4.5, "color": draw.MEASURED}
_FRICTION: dict[str, Any] = {**_SMOOTH, "marker": "s", "markerfacecolor": "white", "markeredgecolor": draw.LIMIT}


def margins(results: StabilityResults, alt: str) -> Picture:
    """Draw the three margins of each joint's loop over the swept angle."""
    with draw.style():
        figure = Figure(figsize=(draw.WIDTH, 2.3), layout="constrained")
        gain, phase, peak = figure.subplots(1, 3)
        for index, joint in enumerate(results.joints):
            mine = [entry for entry in results.margins if entry.joint == joint]
            angle = np.degrees([entry.angle_rad for entry in mine])
            color = draw.SERIES[index % len(draw.SERIES)]
            decibel = 20.0 * np.log10(np.array([entry.gain or np.nan for entry in mine]))
            degrees = np.degrees(np.array([entry.phase_rad or np.nan for entry in mine]))
            gain.plot(angle, decibel, color=color, label=joint)
            phase.plot(angle, degrees, color=color)
            peak.plot(angle, [entry.sensitivity_peak for entry in mine], color=color)
        limits = ((gain, 6.0, "gain margin / dB"), (phase, 30.0, "phase margin / °"), (peak, 2.0, "sensitivity peak"))
        for axis, limit, label in limits:
            axis.axhline(limit, color=draw.LIMIT, linewidth=0.8, linestyle=(0, (4, 2)))
            axis.set_ylim(bottom=0.0)
            axis.set_xlabel(f"{results.joint} / °")
            axis.set_ylabel(label)
        gain.legend(loc="lower right")
        return draw.picture(figure, alt)


def poles(table: Table, joint: str, nyquist: float, alt: str) -> Picture:
    """Draw frequency and damping of the plant's and the closed loop's poles."""
    angle, frequency, damping = (table.columns[name] for name in ("angle", "frequency", "damping"))
    closed = table.columns["closed"] > 0.5
    with draw.style():
        figure = Figure(figsize=(draw.WIDTH, 3.0), layout="constrained")
        left, right = figure.subplots(1, 2)
        for axis, values in ((left, frequency), (right, damping)):
            axis.plot(
                np.degrees(angle[~closed]), values[~closed], linestyle="none", marker="o", markersize=4.5,
                markerfacecolor="none", markeredgecolor=draw.PREDICTED, label="plant, field held",
            )  # fmt: skip
            axis.plot(
                np.degrees(angle[closed]), values[closed], linestyle="none", marker=".", markersize=4.0,
                color=draw.MEASURED, label="closed loop",
            )  # fmt: skip
            axis.set_xlabel(f"{joint} / °")
        left.axhline(nyquist, color=draw.INK, linewidth=0.7, linestyle=(0, (1, 1.5)))
        draw.logarithmic(left, "y", 0.7 * float(frequency.min()), 1.4 * float(frequency.max()))
        draw.logarithmic(right, "y", 0.5 * max(1e-4, float(np.abs(damping).min())), 1.5)
        left.set_ylabel("frequency / Hz")
        right.set_ylabel("damping of critical")
        left.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, fontsize=6.5)
        return draw.picture(figure, alt)


def onsets(results: StabilityResults, alt: str) -> Picture:
    """Draw the critical factor over the angle, the boundary in the plane of both gains, and what simulations found."""
    with draw.style():
        figure = Figure(figsize=(draw.WIDTH, 2.8), layout="constrained")
        over, plane = figure.subplots(1, 2)
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
        plane.plot([e.integral_weight * (e.found or 0.0) for e in there], [e.found for e in there], **_SMOOTH)
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
