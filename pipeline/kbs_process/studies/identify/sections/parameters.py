"""What are the numbers of the motor-gears?"""

from __future__ import annotations

import math

import numpy as np

from kbs_process.report import draw
from kbs_process.report.panel import Block, Cell, Figure, Fold, Grid, Panel, Picture, Text
from kbs_process.report.prose import Prose
from kbs_process.report.tables import Tables
from kbs_process.report.text import MISSING, count, measure, number, unit
from kbs_process.studies.identify.results import Correlations, Identified, IdentifyResults

_SAYS = Prose("kbs_process.studies.identify", "parameters")
_LEVEL = 3.84
_COLUMNS = 3

_TITLES = {
    "critical": "The paper's five: tooth-passing stick-slip, flexspline stiffness and damping, cogging, twice-a-turn",
    "gearbox": "The rest of drives and transducer",
    "rig": "Other numbers of the rig, fitted within their priors",
}


def panel(results: IdentifyResults, tables: Tables) -> Panel:
    """Checks, estimates by group, profiles, correlations, starts."""
    checks = tuple(
        (check.name, Cell("yes" if check.ok else "no", "pass" if check.ok else "undecided"), check.detail)
        for check in results.checks
    )
    blocks: list[Block] = [Grid("Checks of the fit", ("Check", "Passed", "Detail"), checks, "kcl")]
    for group, title in _TITLES.items():
        entries = tuple(entry for entry in results.parameters if entry.group == group)
        if entries:
            grid = _grid(title, entries)
            blocks.append(grid if group != "rig" else Fold(f"{title} ({count(len(entries), 'number')})", (grid,)))
    profiled = tuple(entry for entry in results.parameters if entry.interval is not None)
    joints = dict.fromkeys(entry.name.split(".drive.")[0] for entry in profiled)
    pictures = tuple(
        _profiles(tuple(entry for entry in profiled if entry.name.startswith(f"{joint}.")), joint) for joint in joints
    )
    if pictures:
        blocks.append(Figure("Profile likelihood", pictures, _SAYS.caption("profile")))
    blocks.append(Figure("Correlations", (_correlations(results.correlations),), _SAYS.caption("correlation")))
    rows = tuple(
        (
            str(index),
            number(start.start_cost, 6),
            number(start.cost, 6),
            ", ".join(
                f"{name.removeprefix('joint.').replace('.drive.', ' ')} {value:+.2f}"
                for name, value in start.phases.items()
            ),
        )
        for index, start in enumerate(results.starts, 1)
    )
    blocks.append(
        Grid("Starts followed", ("Start", "Cost there", "Cost after the search", "Phases found / rad"), rows, "rrrl")
    )
    blocks.append(Text("Corrected parameter files, for [parameters] files of a campaign:", results.files))
    return Panel("parameters", "Parameters", "What are the numbers, and how well are they known?", tuple(blocks))


def _grid(title: str, entries: tuple[Identified, ...]) -> Grid:
    rows = tuple(
        (
            entry.name.removeprefix("joint."),
            unit(entry.unit),
            measure(entry.prior, entry.prior_sigma) if entry.prior_sigma is not None else "unknown phase",
            measure(entry.value, entry.sigma),
            MISSING
            if entry.interval is None
            else f"{number(entry.interval.low, 4)} to {number(entry.interval.high, 4)}",
            MISSING if entry.prior_sigma is None else number(entry.sigma / entry.prior_sigma, 2),
            Cell(
                f"{entry.partner.removeprefix('joint.')} {entry.correlation:+.2f}",
                "undecided" if abs(entry.correlation) > 0.95 else "",
            ),
        )
        for entry in entries
    )
    head = (
        "Number",
        "Unit",
        "Prior",
        "Estimate ± sigma",
        "95 % interval (profile)",
        "Sigma over prior's",
        "Most correlated with",
    )
    return Grid(title, head, rows, "klrrrrl")


def _profiles(entries: tuple[Identified, ...], title: str) -> Picture:
    """Draw each profile over the parabola of the estimate's sigma."""
    rows = math.ceil(len(entries) / _COLUMNS)
    with draw.style():
        figure, axes = draw.grid(0.3 + 1.5 * rows, rows, _COLUMNS)
        for axis, entry in zip(axes, entries, strict=False):
            assert entry.interval is not None
            x = np.linspace(-3.0, 3.0, 61)
            axis.plot(entry.value + entry.sigma * x, x**2, color=draw.RESIDUAL, linewidth=0.8)
            axis.plot(entry.interval.x, entry.interval.D, marker="o", markersize=3, color=draw.MEASURED)
            axis.axhline(_LEVEL, color=draw.LIMIT, linewidth=0.8, linestyle="--")
            for end in (entry.interval.low, entry.interval.high):
                axis.axvline(end, color=draw.MEASURED, linewidth=0.6, linestyle=":")
            axis.set_ylim(-0.3, 9.0)
            axis.set_title(entry.name.rpartition(".")[2])
            axis.set_xlabel(unit(entry.unit))
            axis.tick_params(axis="x", labelsize=6)
            axis.locator_params(axis="x", nbins=4)
        for axis in axes[len(entries) :]:
            axis.set_axis_off()
        return draw.picture(figure, f"{title}: profile likelihood of {len(entries)} parameters", title)


def _correlations(found: Correlations) -> Picture:
    """Draw the correlation matrix."""
    names = [name.removeprefix("joint.").replace(".drive.", " ").replace("transducer.", "") for name in found.names]
    with draw.style():
        figure, axis = draw.canvas(0.9 * draw.WIDTH)
        image = axis.imshow(np.array(found.matrix), cmap="RdBu_r", vmin=-1.0, vmax=1.0)
        axis.set_xticks(range(len(names)), names, rotation=90, fontsize=5.5)
        axis.set_yticks(range(len(names)), names, fontsize=5.5)
        axis.grid(visible=False)
        figure.colorbar(image, ax=axis, shrink=0.7, label="correlation")
        worst = max(
            (abs(value) for i, row in enumerate(found.matrix) for j, value in enumerate(row) if i != j), default=0.0
        )
        return draw.picture(figure, f"Correlations of {len(names)} estimates, at most {number(worst, 2)}")
