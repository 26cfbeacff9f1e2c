"""The onset of instability found by simulation, beside the predicted one."""

from __future__ import annotations

import math

from kbs_process.report.panel import Block, Caption, Figure, Grid, Panel, Text
from kbs_process.report.tables import Tables
from kbs_process.report.text import number, percent
from kbs_process.studies.stability import figures
from kbs_process.studies.stability.results import OnsetAt, StabilityResults

_CAPTION = Caption(
    shown="Left: the factor on all gains at which the linear loop loses stability, over the swept joint's angle, and "
    "the onset that bisection finds in simulations of the whole plant. Right: the boundary in the plane of both gains "
    "at the pose with the least margin, the point at which the campaign was run, and onsets.",
    good="Simulations without friction on the line; those with friction near it.",
    bad="A simulation without friction off the line: the linear model lacks something, or a motor loses its step.",
    do="Trust the simulation; look for what limits the motors' torque.",
)
_LIMIT_CYCLES = (
    "What is left of a kick in the last 10 s, with friction, cogging and the encoder's rounding. The integrator moves "
    "the field until the reading changes its code, friction lets it go late: the joint wanders within a part of a "
    "code, at any gain. That is a limit cycle, and no instability."
)


def panel(results: StabilityResults, tables: Tables) -> Panel:
    """Figure and tables of onsets and limit cycles."""
    question = "Does the non-linear plant become unstable where the linear one says?"
    alt = "Critical gain factor, predicted and simulated, over the angle and over the plane of gains"
    blocks: list[Block] = [
        _words(results),
        Figure("Onset of instability", (figures.onsets(results, alt),), _CAPTION),
        _table(results.onsets, results.joint),
        _cycles(results),
    ]
    return Panel("onset", "Onset by simulation", question, tuple(blocks))


def _words(results: StabilityResults) -> Text:
    smooth = [e for e in results.onsets if not e.friction and e.found is not None]
    off = max((abs((e.found or 0.0) / e.predicted - 1.0) for e in smooth), default=None)
    text = (
        f"A kick of {number(1e3 * results.kick_rad)} mrad on all commands; an oscillation that is larger after 30 s "
        f"than after 10 s has passed the onset. Without friction the largest deviation from the prediction "
        f"is {percent(off, 2)}, over {len(smooth)} onsets found to 0.05 %."
    )
    return Text(text)


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
    note = (
        "Factor on Kp; that on Ki is it times the weight. With friction: friction, cogging and the encoder's rounding, "
        "and a limit cycle below the kick is no onset."
    )
    return Grid("Onsets", head, rows, "krlrrrrr", note)


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
    return Grid("Limit cycles", head, rows, "rrrrr", _LIMIT_CYCLES)
