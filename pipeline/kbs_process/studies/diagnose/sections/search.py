"""Where does it enter, and what was tried?"""

from __future__ import annotations

import numpy as np
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure as Canvas

from kbs_process.diagnosis.facts import Moved
from kbs_process.report import draw
from kbs_process.report.panel import Block, Caption, Cell, Figure, Fold, Grid, Panel, Picture
from kbs_process.report.tables import Table, Tables
from kbs_process.report.text import MISSING, chance, count, measure, number, percent, unit
from kbs_process.signals.records import Array
from kbs_process.studies.diagnose.results import DiagnosisResults, PortTest, Suspect

_FAR = 3.0  # sigma
_MAPS = Caption(
    shown="Mean residual of each trajectory's repeats, over the repeatability, by windows of time and frequency: "
    "nominal parameters refitted (before), corrected model (after). Dots: cells that chance does not explain.",
    good="White after, everywhere.",
    bad="A line along time: a resonance or a tone. One that follows the rate: a motor order. A column: a place or "
    "an event.",
    do="Compare a column's time with the commands, a line's frequency with the motors' rates.",
)


def panel(results: DiagnosisResults, tables: Tables) -> Panel:
    """Known parameters, ports, suspects, checks."""
    blocks: list[Block] = []
    far = tuple(entry for entry in results.moved if entry.sigmas is not None and abs(entry.sigmas) > _FAR)
    if far:
        blocks.append(_moved(f"Nominal parameters that moved by more than {_FAR:g} sigma", far))
    if maps := _maps(results, tables):
        blocks.append(Figure("Where the residual is", maps, _MAPS))
    if results.ports and results.answer != "none":  # where nothing is left, every port explains that
        blocks.append(_ports(results.ports))
    if results.suspects:
        blocks.append(_suspects(results.suspects))
    checks = tuple(
        (check.name, Cell("yes" if check.ok else "no", "pass" if check.ok else "undecided"), check.detail)
        for check in results.checks
    )
    if checks:
        blocks.append(Grid("Checks of the refit", ("Check", "Passed", "Detail"), checks, "kcl"))
    if results.moved:
        title = f"All nominal parameters ({count(len(results.moved), 'number')})"
        blocks.append(Fold(title, (_moved("Nominal parameters", results.moved),)))
    return Panel("search", "Search", "Where does it enter, and what was tried?", tuple(blocks))


def _maps(results: DiagnosisResults, tables: Tables) -> tuple[Picture, ...]:
    """One of each trajectory, named by its recordings."""
    members: dict[str, list[str]] = {}
    for trial in results.trials:
        if trial.role != "held-out":
            members.setdefault(trial.trajectory, []).append(trial.recording)
    found = ((tables.read("residual_map", number), names) for number, names in members.items())
    return tuple(_map(table, ", ".join(names)) for table, names in found if table is not None)


def _ports(entries: tuple[PortTest, ...]) -> Grid:
    rows = tuple(
        (
            entry.port,
            percent(entry.share, 3),
            chance(entry.log10_p),
            Cell("yes" if entry.sufficient else "no", "pass" if entry.sufficient else ""),
            ", ".join(entry.same_as) or MISSING,
        )
        for entry in entries
    )
    note = "An arbitrary input at one port: if it cannot explain the residual, no effect there can."
    head = ("Port", "Takes up of the excess", "p", "Suffices", "Looks the same as")
    return Grid("Where it enters", head, rows, "krrcl", note)


def _suspects(entries: tuple[Suspect, ...]) -> Grid:
    rows = tuple(
        (
            entry.name,
            entry.family,
            entry.place.words,
            number(entry.distance),
            MISSING if entry.absorbed is None else percent(entry.absorbed, 2),
            entry.outcome,
        )
        for entry in entries
    )
    head = ("Candidate effect", "Physics", "Enters at", "Distance / sigma", "Absorbed", "Outcome")
    note = "Distance: whitened size of the signature, without the part that nominal parameters can take up."
    return Grid("Candidate effects, strongest first", head, rows, "kllrrl", note)


def _moved(title: str, entries: tuple[Moved, ...]) -> Grid:
    rows = tuple(
        (
            entry.name,
            unit(entry.unit),
            "unknown phase" if entry.prior_sigma is None else measure(entry.prior, entry.prior_sigma),
            measure(entry.value, entry.sigma),
            MISSING
            if entry.sigmas is None
            else Cell(number(entry.sigmas, 2), "undecided" if abs(entry.sigmas) > _FAR else ""),
        )
        for entry in entries
    )
    return Grid(title, ("Number", "Unit", "Prior", "Refitted", "Moved / sigma"), rows, "klrrr")


def _map(table: Table, title: str) -> Picture:
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
        figure = Canvas(figsize=(draw.WIDTH, 2.4), layout="constrained")
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
        alt = f"{title}: residual over repeatability by time and frequency, before at most {worst}"
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
