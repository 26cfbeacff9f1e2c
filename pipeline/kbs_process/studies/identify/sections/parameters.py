"""What are the numbers of the motor-gears?"""

from __future__ import annotations

from kbs_process.report.panel import Block, Caption, Cell, Figure, Fold, Grid, Panel, Text
from kbs_process.report.tables import Tables
from kbs_process.report.text import MISSING, count, measure, number, unit
from kbs_process.studies.identify import figures
from kbs_process.studies.identify.results import Identified, IdentifyResults

_PROFILE = Caption(
    shown="What the cost (-2 log likelihood) rises by when a parameter is held and all others follow (points), the "
    "parabola of its sigma (grey), the level of 95 % (dashed) and the interval (dotted).",
    good="Points on the parabola: sigma says it all.",
    bad="A flat or lopsided profile: the interval is not +-1.96 sigma. A point below zero: the search ended too early.",
    do="Use the interval where it differs from the parabola's; record motions that separate the pair where it is flat.",
)
_CORRELATION = Caption(
    shown="Correlation of the estimates of drives and transducer.",
    good="Little colour off the diagonal.",
    bad="A pair near +-1: the recordings know a combination of the two alone.",
    do="Measure one of the pair otherwise, or record both directions and other rates.",
)
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
        figures.profiles(tuple(entry for entry in profiled if entry.name.startswith(f"{joint}.")), joint)
        for joint in joints
    )
    if pictures:
        blocks.append(Figure("Profile likelihood", pictures, _PROFILE))
    blocks.append(Figure("Correlations", (figures.correlations(results.correlations),), _CORRELATION))
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
