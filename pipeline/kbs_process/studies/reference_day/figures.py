"""The trajectory of a reference day, the distribution of its pointing errors, and its torques."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kbs_process.report import draw, series
from kbs_process.report.panel import Picture
from kbs_process.report.tables import Table
from kbs_process.studies.reference_day.results import Phase, Section

AXES = (("az", "azimuth", draw.MEASURED), ("el", "elevation", draw.PREDICTED))
TORQUES = (("Tx", draw.MEASURED), ("Ty", draw.PREDICTED), ("Tz", draw.RESIDUAL))
_POINTS = 3000  # of a curve over the day


def trajectory(table: Table, phases: Sequence[Phase], sections: Sequence[Section]) -> Picture:
    """Draw desired azimuth and elevation over the day; hand-overs shaded and named, sections numbered."""
    t = table.columns["t"]
    thin = max(1, len(t) // _POINTS)
    with draw.style():
        figure, axis = draw.canvas(3.3)
        for column, name, color in AXES:
            axis.plot(t[::thin], np.degrees(table.columns[column][::thin]), color=color, linewidth=1.1, label=name)
        axis.set_ylim(-60.0, 205.0)
        for phase in phases:
            if phase.mode in ("hand-over", "pre-pointing"):
                axis.axvspan(phase.start_s, phase.end_s, color=draw.SHADE, linewidth=0)
                axis.text(phase.start_s, 200.0, f"P {phase.relay}", ha="center", va="top", fontsize=6.5)
            elif phase.start_s <= 0.0:
                axis.text(0.0, 200.0, f" {phase.relay}", ha="left", va="top", fontsize=6.5)
        for section in sections:
            axis.axvline(section.end_s, color=draw.GRID, linewidth=0.8, zorder=0.6)
            axis.text(0.5 * (section.start_s + section.end_s), -57.0, section.name, ha="center", color=draw.TICK)
        axis.set_xlim(0.0, float(t[-1]))
        axis.set_xlabel("time / s")
        axis.set_ylabel("angle / °")
        axis.legend(loc="center right")
        return draw.picture(figure, "Desired azimuth and elevation over the reference day", form="png")


def rates(table: Table) -> Picture:
    """Draw the commanded rates over the day."""
    t = table.columns["t"]
    thin = max(1, len(t) // _POINTS)
    with draw.style():
        figure, axis = draw.canvas(1.9)
        for column, name, color in AXES:
            rate = np.degrees(np.gradient(table.columns[column], t))
            axis.plot(t[::thin], rate[::thin], color=color, linewidth=0.9, label=name)
        axis.set_xlim(0.0, float(t[-1]))
        axis.set_xlabel("time / s")
        axis.set_ylabel("rate / °/s")
        axis.legend(loc="upper right", ncols=2)
        return draw.picture(figure, "Commanded rates over the reference day", form="png")


def errors(table: Table, limit: float) -> Picture:
    """Draw both axes' pointing error over the day: the range within each stretch of time."""
    t = table.columns["t"]
    size = series.stride(len(t), _POINTS)
    t0, step = series.times(t, size)
    with draw.style():
        figure, _ = draw.canvas(3.0)
        figure.clear()
        axes = np.atleast_1d(figure.subplots(2, 1, sharex=True))
        for axis, (column, name, color) in zip(axes, AXES, strict=True):
            mdeg = 1e3 * np.degrees(series.envelope(table.columns[column], size))
            axis.plot(t0 + step * np.arange(len(mdeg)), mdeg, color=color, linewidth=0.4)
            for level in (-limit, limit):
                axis.axhline(1e3 * np.degrees(level), color=draw.LIMIT, linewidth=0.8, linestyle=(0, (4, 2)))
            axis.set_ylabel(f"{name} error / mdeg")
        axes[-1].set_xlim(0.0, float(t[-1]))
        axes[-1].set_xlabel("time / s")
        return draw.picture(figure, "Pointing error of either axis over the reference day", form="png")


def torques(tables: Sequence[tuple[str, Table]], limit: float | None) -> Picture:
    """Draw every axis' torque over the day, a row a band: the range within each stretch of time."""
    with draw.style():
        figure, _ = draw.canvas(0.4 + 1.6 * len(tables))
        figure.clear()
        axes = np.atleast_1d(figure.subplots(len(tables), 1, sharex=True))
        for axis, (name, table) in zip(axes, tables, strict=True):
            t = table.columns["t"]
            size = series.stride(len(t), _POINTS)
            t0, step = series.times(t, size)
            for column, color in TORQUES:
                x = series.envelope(np.where(table.valid, table.columns[column], np.nan), size)
                axis.plot(t0 + step * np.arange(len(x)), x, color=color, linewidth=0.4, label=column)
            if limit is not None and name == tables[0][0]:
                for level in (-limit, limit):
                    axis.axhline(level, color=draw.LIMIT, linewidth=0.8, linestyle=(0, (4, 2)))
            axis.set_ylabel(f"{name}\ntorque / N·m")
        axes[0].legend(loc="upper right", ncols=3)
        axes[-1].set_xlim(0.0, float(t[-1]))
        axes[-1].set_xlabel("time / s")
        return draw.picture(figure, "Disturbance torque at the spacecraft's centre of mass", form="png")


def against_published(sections: Sequence[Section]) -> Picture:
    """Draw 95 % of either axis' error, ours with two sigma beside the published one."""
    place = np.arange(len(sections), dtype=float)
    with draw.style():
        figure, _ = draw.canvas(2.3)
        figure.clear()
        for axis, which in zip(figure.subplots(1, 2, sharey=True), ("azimuth", "elevation"), strict=True):
            ours = [1e3 * np.degrees(getattr(section, which).percentile) for section in sections]
            sigma = [1e3 * np.degrees(getattr(section, which).percentile_sigma) for section in sections]
            theirs = [getattr(section.published, f"{which}_mdeg", np.nan) for section in sections]
            axis.bar(place - 0.2, ours, 0.38, yerr=2.0 * np.array(sigma), color=draw.MEASURED, label="simulated, ± 2 σ",
                     error_kw={"elinewidth": 0.8, "capsize": 1.5, "ecolor": draw.INK})  # fmt: skip
            axis.bar(place + 0.2, theirs, 0.38, color=draw.PREDICTED, label="published")
            axis.set_xticks(place, [section.name for section in sections])
            axis.grid(visible=False, axis="x")
            axis.set_title(which)
            axis.set_xlabel("section")
        figure.axes[0].set_ylim(bottom=0.0)  # shared; an error of a statistic may be greater than the statistic
        figure.axes[0].set_ylabel("95 % error / mdeg")
        figure.axes[0].legend(loc="upper left", fontsize=6.5)
        return draw.picture(figure, "95 % of the pointing error of each section, simulated and published")
