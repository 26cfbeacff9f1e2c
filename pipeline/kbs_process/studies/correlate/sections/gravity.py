"""The gravity fit: what was fitted, how well it is known, and what is left."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from kbs_process.report import draw
from kbs_process.report.panel import Block, Cell, Figure, Grid, Panel, Picture, Text
from kbs_process.report.prose import Prose
from kbs_process.report.tables import Tables
from kbs_process.report.text import element, label, measure, number, unit
from kbs_process.studies.correlate.results import FittedParameter, Gravity, Results, StaticChannel

_SAYS = Prose("kbs_process.studies.correlate", "gravity")
_ROWS = 24  # of parameters in one column


def panel(results: Results, tables: Tables) -> Panel:
    """Parameters with prior and posterior, checks, and the residual of every channel."""
    weighs = results.campaign.frame == "T"  # efforts show inertia and friction, and weight only in passing
    title = "Gravity fit" if weighs else "Fit of the rigid bodies"
    question = (
        "Which masses explain the static wrench, and is computed compensation feasible?"
        if weighs
        else "Which masses, inertias and viscous frictions explain the efforts?"
    )
    gravity = results.gravity
    if gravity is None:
        text = Text("Nothing was fitted: the static wrench is that of the parameter files.")
        return Panel("gravity", title, question, (text,))
    blocks: list[Block] = []
    if gravity.feasible:
        blocks.append(Text(gravity.feasible))
    blocks.append(_parameters(gravity))
    if any(entry.prior is not None and entry.prior_sigma for entry in gravity.parameters):
        alt = "Fitted parameters against their priors, in prior sigma"
        picture = _shifts(gravity.parameters, alt)
        blocks.append(Figure("Fitted parameters against their priors", (picture,), _SAYS.caption("shifts")))
    if weighs:
        blocks.append(_channels(gravity))
    if len(gravity.ladder) > 1:
        blocks.append(_ladder(gravity))
    if any(channel.sigma for entry in gravity.recordings for channel in entry.channels):
        blocks.append(_taring(gravity))
    if gravity.recordings:
        blocks.append(_left(gravity))
    if gravity.checks:
        rows = tuple(
            (entry.name, Cell("ok" if entry.ok else "see detail", "pass" if entry.ok else "undecided"), entry.detail)
            for entry in gravity.checks
        )
        blocks.append(Grid("Checks on the fit", ("Check", "Outcome", "Detail"), rows, "lcl"))
    return Panel("gravity", title, question, tuple(blocks))


def _parameters(gravity: Gravity) -> Grid:
    rows = tuple(
        (
            element(entry.name),
            measure(entry.prior, entry.prior_sigma),
            measure(entry.value, entry.sigma),
            unit(entry.unit),
        )
        for entry in gravity.parameters
    )
    notes = []
    if gravity.samples:
        notes.append(_SAYS("fit_note", samples=gravity.samples, chi_square=gravity.reduced_chi_square))
    if any(entry.name.startswith("transducer.cross_coupling") for entry in gravity.parameters):
        notes.append(_SAYS("coupling_note"))
    return Grid("Fitted parameters", ("Parameter", "Before (prior)", "Fitted", "Unit"), rows, "lrrl", " ".join(notes))


def _channels(gravity: Gravity) -> Grid:
    rows = tuple(
        (
            entry.channel,
            number(entry.static_peak),
            number(entry.residual_rms),
            number(entry.encoder_sigma, 2),
            number(entry.model_sigma, 2),
            unit(entry.unit),
        )
        for entry in gravity.channels
    )
    head = ("Channel", "Static peak", "Residual rms", "σ from angles", "σ from the fit", "Unit")
    return Grid("Static wrench and residual", head, rows, "lrrrrl", _SAYS("channels_note"))


def _ladder(gravity: Gravity) -> Grid:
    torques = [name for name in gravity.ladder[0].rms if name.startswith("T")]
    rows = tuple(
        (
            "and " * bool(index) + rung.name,
            *(f"{number(rung.rms[name], 2)} / {number(rung.peak[name], 2)}" for name in torques),
        )
        for index, rung in enumerate(gravity.ladder)
    )
    head = ("Gravity model", *(f"{name} / N m" for name in torques))
    return Grid("Residual after each part of the model", head, rows, "l" + "r" * len(torques), _SAYS("ladder_note"))


def _taring(gravity: Gravity) -> Grid:
    rows = tuple(
        (
            entry.recording,
            "the fit" if entry.fitted else "itself",
            *(measure(channel.constant, channel.sigma) for channel in entry.channels),
        )
        for entry in gravity.recordings
    )
    head = ("Recording", "Tared by", *map(_named, gravity.recordings[0].channels))
    return Grid("Taring", head, rows, "kk" + "r" * len(gravity.recordings[0].channels), _SAYS("taring_note"))


def _left(gravity: Gravity) -> Grid:
    rows = tuple((entry.recording, *map(_ratio, entry.channels)) for entry in gravity.recordings)
    head = ("Recording", *map(_named, gravity.recordings[0].channels))
    below = "" if gravity.low_pass_Hz is None else f" below {number(gravity.low_pass_Hz, 2)} Hz"
    title = f"What is left of each recording{below}, over what may be left"
    return Grid(title, head, rows, "k" + "r" * len(gravity.recordings[0].channels), _SAYS("left_note"))


def _ratio(channel: StaticChannel) -> str | Cell:
    text = f"{number(channel.left, 2)} / {number(channel.explained, 2)}"
    return text if channel.ok else Cell(text, "undecided")


def _named(channel: StaticChannel) -> str:
    return f"{channel.channel} / {unit(channel.unit)}"


def _shifts(parameters: Sequence[FittedParameter], alt: str) -> Picture:
    """Draw how far each fitted parameter moved from its prior, in the prior's sigma; many in two columns."""
    moved = [entry for entry in parameters if entry.prior is not None and entry.prior_sigma]
    columns = 1 if len(moved) <= _ROWS else 2
    rows = math.ceil(len(moved) / columns)
    prior = np.array([entry.prior for entry in moved], dtype=float)
    width = np.array([entry.prior_sigma for entry in moved], dtype=float)
    pull = (np.array([entry.value for entry in moved]) - prior) / width
    error = np.array([entry.sigma for entry in moved]) / width
    reach = max(3.0, 1.15 * float(np.max(np.abs(pull), initial=0.0)))
    with draw.style():
        figure, axes = draw.row(0.7 + (0.2 if columns == 1 else 0.155) * rows, columns)
        for column, axis in enumerate(axes):
            shown = slice(column * rows, min((column + 1) * rows, len(moved)))
            place = np.arange(shown.stop - shown.start, dtype=float)
            axis.axvspan(-2.0, 2.0, color=draw.SHADE, linewidth=0, label="prior, ± 2 σ")
            axis.errorbar(
                pull[shown],
                place,
                xerr=error[shown],
                fmt="o",
                markersize=3.5,
                color=draw.MEASURED,
                elinewidth=1.0,
                capsize=2,
                label="fitted, ± 1 σ",
            )
            axis.axvline(0.0, color=draw.RESIDUAL, linewidth=0.7)
            axis.set_yticks(place, [label(element(entry.name)) for entry in moved[shown]])
            axis.set_ylim(rows - 0.5, -0.5)
            axis.set_xlim(-reach, reach)
            axis.grid(visible=False, axis="y")
            axis.set_xlabel("(fitted − prior) / prior's σ")
        handles, names = axes[0].get_legend_handles_labels()
        figure.legend(handles, names, loc="outside upper left", ncols=4, fontsize=7)
        return draw.picture(figure, alt, form="svg" if columns == 1 else "png")
