"""How far each recording is from the floor, step by step, and the laws that were found."""

from __future__ import annotations

import numpy as np
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from kbs_process.report import draw
from kbs_process.report.panel import Picture
from kbs_process.report.tables import Table
from kbs_process.report.text import label, number, unit
from kbs_process.signals.records import Array
from kbs_process.studies.diagnose.results import Curve, Find, Trial

STEPS = {"nominal": draw.SERIES[4], "known": draw.PREDICTED, "corrected": draw.MEASURED}
_WIDTH = 0.26


def trials(entries: tuple[Trial, ...]) -> Picture:
    """Draw residual over floor of each recording: nominal, known parameters refitted, corrected."""
    with draw.style():
        figure, axis = draw.canvas(0.9 + 0.34 * len(entries))
        places = np.arange(len(entries))[::-1]
        for index, (step, color) in enumerate(STEPS.items()):
            values = [getattr(entry, step) for entry in entries]
            axis.barh(places + (1 - index) * _WIDTH, values, _WIDTH, color=color, label=step, left=0.0)
        axis.axvline(1.0, color=draw.LIMIT, linewidth=0.8, linestyle="--", label="floor")
        most = max(max(entry.nominal, entry.known, entry.corrected) for entry in entries)
        draw.logarithmic(axis, "x", 0.5, 1.3 * max(most, 2.0))
        axis.set_yticks(places, [f"{label(entry.recording, 24)} ({entry.role})" for entry in entries])
        axis.grid(visible=False, axis="y")
        axis.set_xlabel("residual over floor, rms")
        axis.legend(ncols=4, loc="lower right", bbox_to_anchor=(1.0, 1.0))
        worst = max(entries, key=lambda entry: entry.corrected)
        alt = f"Residual over floor of {len(entries)} recordings; corrected, at most {number(worst.corrected)}"
        return draw.picture(figure, alt)


def law(find: Find, curve: Curve) -> Picture:
    """Draw what enters at the port, with its band of two sigmas, and the accepted law through it."""
    x, y, sigma = (np.asarray(values) for values in (curve.x, curve.y, curve.sigma))
    with draw.style():
        figure, axis = draw.canvas(2.3)
        axis.fill_between(x, y - 2.0 * sigma, y + 2.0 * sigma, color=draw.SHADE, linewidth=0.0, label="2 sigma")
        axis.plot(x, y, color=draw.MEASURED, linewidth=0.9, label="measured")
        if curve.fitted:
            axis.plot(x, curve.fitted, color=draw.PREDICTED, linewidth=1.6, zorder=1, label=find.name)
        axis.set_xlabel(f"{curve.regressor} / {unit(curve.x_unit)}")
        axis.set_ylabel(f"{find.place.port} / {unit(curve.y_unit)}")
        axis.legend()
        return draw.picture(figure, f"{find.name} at {find.place.site}: measured law over {curve.regressor}")


def channels(entries: tuple[Trial, ...]) -> Picture:
    """Draw what is left over the floor, channel by channel."""
    names = tuple(dict.fromkeys(name for entry in entries for name in entry.channels))
    values = np.array([[entry.channels.get(name, np.nan) for name in names] for entry in entries])
    with draw.style():
        figure = Figure(figsize=(draw.WIDTH, 0.7 + 0.26 * len(entries)), layout="constrained")
        axis = figure.subplots()
        top = max(2.0, float(np.nanmax(values)))
        image = axis.imshow(values, cmap="Blues", vmin=1.0, vmax=top, aspect="auto")
        axis.set_xticks(range(len(names)), names)
        axis.set_yticks(range(len(entries)), [label(entry.recording, 24) for entry in entries])
        axis.grid(visible=False)
        for row, column in np.argwhere(np.isfinite(values)):
            value = values[row, column]
            color = "white" if value > 0.5 * (1.0 + top) else draw.INK
            axis.text(column, row, number(value), ha="center", va="center", color=color, fontsize=6)
        figure.colorbar(image, ax=axis, label="over floor")
        return draw.picture(figure, f"Residual over floor by channel, at most {number(float(np.nanmax(values)))}")


def where(table: Table, title: str) -> Picture:
    """Draw rms over the floor in windows of time by frequencies, before and after; dots: more than chance."""
    t, f, found = (table.columns[name] for name in ("t", "f", "significant"))
    times, tones = _windows(t, f), np.unique(f)
    grids = {side: np.full((len(tones), len(times)), np.nan) for side in ("before", "after")}
    for row, tone in enumerate(tones):
        own = np.flatnonzero(f == tone)
        # A window that holds the slowest changes is as long as several others.
        nearest = own[np.abs(t[own][:, None] - times).argmin(axis=0)]
        for side, grid in grids.items():
            grid[row] = table.columns[side][nearest]
    most = max(3.0, float(np.nanquantile(grids["before"], 0.99)))
    with draw.style():
        figure = Figure(figsize=(draw.WIDTH, 2.4), layout="constrained")
        axes = figure.subplots(1, 2, sharey=True)
        for axis, (side, grid) in zip(axes, grids.items(), strict=True):
            image = axis.pcolormesh(
                _edges(times), _edges(tones), grid, cmap="Blues", norm=LogNorm(1.0, most), rasterized=True
            )
            axis.set_title(side)
            axis.set_xlabel("time / s")
            axis.grid(visible=False)
        seen = found > 0.5
        axes[0].plot(t[seen], f[seen], ".", color=draw.LIMIT, markersize=1.5)
        draw.logarithmic(axes[0], "y", float(tones[0]) * 0.8, float(tones[-1]) * 1.1)
        axes[0].set_ylabel("frequency / Hz")
        scale = figure.colorbar(image, ax=axes, label="over floor")
        draw.logarithmic(scale.ax, "y", 1.0, most)
        worst = number(float(np.nanmax(grids["before"])))
        alt = f"{title}: residual over floor by time and frequency, before at most {worst}"
        return draw.picture(figure, alt, title)


def _windows(t: Array, f: Array) -> Array:
    """Middles of the shortest windows: those of the frequency that is looked at most often."""
    tones, counts = np.unique(f, return_counts=True)
    return np.unique(t[f == tones[counts.argmax()]])


def _edges(middles: Array) -> Array:
    """Borders between neighbours, and as far beyond the first and the last one."""
    if len(middles) < 2:
        return np.asarray(np.concatenate([middles - 0.5, middles + 0.5]))
    between = 0.5 * (middles[1:] + middles[:-1])
    first, last = 2.0 * middles[0] - between[0], 2.0 * middles[-1] - between[-1]
    return np.asarray(np.concatenate([[max(first, 0.5 * middles[0])], between, [last]]))
