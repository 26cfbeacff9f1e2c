"""What law is it, how well is it known, and what else could it be?"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from kbs_process.diagnosis.experiments.thresholds import RIVALS, SHADE, told_apart
from kbs_process.report import draw
from kbs_process.report.formula import equation
from kbs_process.report.panel import Block, Caption, Cell, Figure, Grid, Panel, Picture, Text
from kbs_process.report.tables import Tables
from kbs_process.report.text import number, percent, unit
from kbs_process.studies.diagnose.results import Curve, DiagnosisResults, Find, Rival

_LAW = Caption(
    shown="Input at the port, estimated from the residual without an assumed equation, against its regressor, and the "
    "effect as the plant has it.",
    good="The effect within the band everywhere.",
    bad="A stretch in which the effect leaves the band: there its equation is wrong.",
    do="Take the measured curve there, or widen the motion.",
)


def panel(results: DiagnosisResults, tables: Tables) -> Panel:
    """A find after the other: law, parameters, gate, rivals."""
    blocks = tuple(block for find in results.finds for block in _find(find))
    nothing = Text("No effect passed the acceptance test on held-out data: none is reported.")
    return Panel("finds", "Detections", "Which effect is it, and what else could it be?", blocks or (nothing,))


def _find(find: Find) -> Iterator[Block]:
    known = "" if find.named else " No effect of the catalogue passed the acceptance test: the curve is as measured."
    alike = f" The channels do not distinguish that port from {', '.join(find.same_ports)}." if find.same_ports else ""
    digits = 2 if find.absorbed < 0.99 else 4  # what a weight leaves of a cord is not nothing
    yield Text(
        f"{find.name}, {find.place.words}.{known} Nominal parameters could have taken up "
        f"{percent(find.absorbed, digits)} of its signature.{alike}"
    )
    if find.equation:
        yield equation(find.equation)
    if find.reference:
        yield Text(f"Source: {find.reference}.", tone="muted")
    rows = tuple(
        (
            entry.name,
            unit(entry.unit),
            number(entry.value, 4),
            number(entry.sigma, 2),
            f"{number(entry.low, 4)} to {number(entry.high, 4)}",
        )
        for entry in find.parameters
    )
    if rows:
        yield Grid(f"{find.name}: parameters", ("Parameter", "Unit", "Value", "Sigma", "95 %"), rows, "klrrr")
    if find.curve is not None:
        yield Figure(f"{find.name}: the effect", (_band(find, find.curve),), _LAW)
    gate = tuple(
        (
            entry.recording,
            entry.role,
            number(entry.before),
            Cell(number(entry.after), "pass" if entry.after <= entry.before else "fail"),
            number(entry.gain),
        )
        for entry in find.gate
    )
    note = "Held-out recordings decide: each has to be predicted better."
    head = ("Recording", "Role", "Before", "After", "Gain (-2 log likelihood)")
    yield Grid(f"{find.name}: residual over the repeatability, without and with it", head, gate, "klrrr", note)
    if find.rivals:
        yield Grid(
            f"{find.name}: rivals",
            ("Effect", "Physics", "Enters at", "Simulated", "Distance / sigma", "Probability"),
            tuple(
                (
                    rival.name,
                    rival.family,
                    rival.place.words,
                    "yes" if rival.simulated else "no",
                    Cell(number(rival.distance), "undecided" if _alike(find, rival) else ""),
                    number(rival.probability, 2),
                )
                for rival in find.rivals
            ),
            "kllcrr",
            f"These recordings do not distinguish marked rivals from it: they are nearer than {RIVALS} sigma, or "
            f"(those simulated) than {SHADE} of its own distance. Such a difference may come from the formulas.",
        )


def _alike(find: Find, rival: Rival) -> bool:
    """Whether a law cannot be told from a find."""
    return rival.distance < (told_apart(find.distance) if rival.simulated else RIVALS)


def _band(find: Find, curve: Curve) -> Picture:
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
