"""The gravity fit: what was fitted, how well it is known, and what is left."""

from __future__ import annotations

from kbs_process.report.panel import Block, Caption, Cell, Figure, Grid, Panel, Text
from kbs_process.report.tables import Tables
from kbs_process.report.text import count, measure, number, unit
from kbs_process.studies.correlate.figures import bars
from kbs_process.studies.correlate.results import Gravity, Results, StaticChannel

_CAPTION = Caption(
    shown="How far each fitted parameter moved from what the parameter files said, in standard "
    "deviations of the latter. The bar is the fitted value's own standard deviation.",
    good="Points within the shaded band, with bars much shorter than it: the recordings agree with the "
    "drawing and know better.",
    bad="A point outside the band: the prior, the calibration or the model is wrong. A bar as long as "
    "the band: these recordings say nothing about that parameter.",
    do="For a point outside, weigh or measure that quantity again before the value is used elsewhere. "
    "For a long bar, record a pseudo-static run over a wider range of angles.",
)


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
        picture = bars.shifts(gravity.parameters, alt)
        blocks.append(Figure("Fitted parameters against their priors", (picture,), _CAPTION))
    if weighs:
        blocks.append(_channels(gravity))
    if any(channel.sigma for entry in gravity.recordings for channel in entry.channels):
        blocks.append(_taring(gravity))
    if gravity.recordings:
        blocks.append(_left(gravity))
    if gravity.checks:
        rows = tuple(
            (entry.name, Cell("ok" if entry.ok else "not met", "pass" if entry.ok else "fail"), entry.detail)
            for entry in gravity.checks
        )
        blocks.append(Grid("Checks on the fit", ("Check", "Outcome", "Detail"), rows, "lcl"))
    return Panel("gravity", title, question, tuple(blocks))


def _parameters(gravity: Gravity) -> Grid:
    rows = tuple(
        (entry.name, measure(entry.prior, entry.prior_sigma), measure(entry.value, entry.sigma), unit(entry.unit))
        for entry in gravity.parameters
    )
    quality = ""
    if gravity.samples:
        quality = f"{count(gravity.samples, 'sample')}; reduced chi-square {number(gravity.reduced_chi_square)}."
    if any(entry.name.startswith("transducer.cross_coupling") for entry in gravity.parameters):
        quality += " Cross-coupling: dX in (I + X) = (I + X₀)(I + dX), X₀ as stated."
    return Grid("Fitted parameters", ("Parameter", "Before (prior)", "Fitted", "Unit"), rows, "lrrl", quality)


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
    note = "σ from angles: encoder noise and quantisation times the static wrench's slope over the angle."
    return Grid("Static wrench and what is left of it", head, rows, "lrrrrl", note)


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
    note = (
        "The constant that the transducer added to each recording, taken away with the static wrench. A recording that "
        "was not fitted is tared by itself: these constants are all that was estimated from it."
    )
    return Grid("Taring", head, rows, "kk" + "r" * len(gravity.recordings[0].channels), note)


def _left(gravity: Gravity) -> Grid:
    rows = tuple((entry.recording, *map(_ratio, entry.channels)) for entry in gravity.recordings)
    head = ("Recording", *map(_named, gravity.recordings[0].channels))
    below = "" if gravity.low_pass_Hz is None else f" below {number(gravity.low_pass_Hz, 2)} Hz"
    note = (
        "Rms of what the model leaves, over what the model's and the angles' uncertainty and the fitted pseudo-static "
        "recordings' own residual explain. Marked: a load that no parameter file describes."
    )
    title = f"What is left of each recording{below}, over what may be left"
    return Grid(title, head, rows, "k" + "r" * len(gravity.recordings[0].channels), note)


def _ratio(channel: StaticChannel) -> str | Cell:
    text = f"{number(channel.left, 2)} / {number(channel.explained, 2)}"
    return text if channel.ok else Cell(text, "undecided")


def _named(channel: StaticChannel) -> str:
    return f"{channel.channel} / {unit(channel.unit)}"
