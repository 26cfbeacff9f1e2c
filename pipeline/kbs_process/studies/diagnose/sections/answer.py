"""Is there a mismatch, and what was left out?"""

from __future__ import annotations

import numpy as np

from kbs_process.diagnosis.facts import Answer
from kbs_process.report import draw
from kbs_process.report.panel import Block, Caption, Cell, Figure, Grid, Notices, Panel, Picture, Text
from kbs_process.report.tables import Tables
from kbs_process.report.text import MISSING, chance, label, number, percent
from kbs_process.studies.diagnose.results import DiagnosisResults, Find, Trial, Unexplained

_TRIALS = Caption(
    shown="Whitened residual over the repeatability, rms, of every recording: with the parameter files' numbers "
    "(unknown phases as found), with nominal parameters refitted within their priors, and with the corrected model. "
    "Neither fit used held-out recordings.",
    good="Corrected bars end at 1 (dashed), those of held-out recordings as well.",
    bad="A held-out bar far above those of the fit: the effect does not carry over. All above: a mismatch is left.",
    do="See what remains, and record the trajectory where it is strongest.",
)
AT_FLOOR = 1.1
_STEPS = {"nominal": draw.SERIES[4], "known": draw.PREDICTED, "corrected": draw.MEASURED}
_WIDTH = 0.26


def panel(results: DiagnosisResults, tables: Tables) -> Panel:
    """The paragraph, notices, finds and residuals over the floor."""
    blocks: list[Block] = [Text(results.paragraph)]
    if results.warnings:
        blocks.append(
            Notices(tuple((entry.severity, entry.what, entry.where, entry.remedy) for entry in results.warnings))
        )
    if results.finds:
        blocks.append(_finds(results.finds, results.answer))
    blocks.append(Figure("Residual over the repeatability", (_bars(results.trials),), _TRIALS))
    blocks.append(_trials(results.trials))
    if results.requirements:
        blocks.append(_requirements(results.requirements))
    blocks.append(
        Text(f"Repeatability: {results.floor}. Chance of what nominal parameters leave: {chance(results.log10_p)}.")
    )
    if results.files:
        blocks.append(
            Text(
                f"{results.model}, for kbs-process predict --model and for any campaign's parameter files:",
                results.files,
            )
        )
    return Panel("answer", "Answer", "Is there a mismatch, and what was left out?", tuple(blocks))


def _finds(finds: tuple[Find, ...], answer: Answer) -> Grid:
    rows = tuple(
        (
            find.name,
            find.family,
            find.place.words,
            ", ".join(find.place.channels[:3]) or MISSING,
            number(find.probability, 3),
            number(find.distance, 3),
            MISSING if find.held_out_variance is None else percent(find.held_out_variance, 2),
        )
        for find in finds
    )
    head = ("Effect", "Physics", "Enters at", "Seen in", "Probability", "Distance / sigma", "Of the held-out excess")
    title = "Nearest to what the model lacks" if answer == "undecided" else "Physics that was left out"
    return Grid(title, head, rows, "klllrrr")


def _trials(trials: tuple[Trial, ...]) -> Grid:
    rows = tuple(
        (
            entry.recording,
            entry.role,
            number(entry.nominal),
            number(entry.known),
            Cell(number(entry.corrected), "pass" if entry.corrected < AT_FLOOR else "undecided"),
        )
        for entry in trials
    )
    head = ("Recording", "Role", "Nominal", "Nominal refitted", "Corrected")
    return Grid("Residual over the repeatability, rms", head, rows, "klrrr")


def _requirements(requirements: tuple[Unexplained, ...]) -> Grid:
    rows = tuple(
        (
            entry.name,
            f"{entry.statistic}, {number(entry.band_Hz[0])} to {number(entry.band_Hz[1])} Hz",
            f"{number(entry.limit)} {entry.unit}",
            f"{number(entry.known, 2)} {entry.unit}",
            f"{number(entry.corrected, 2)} {entry.unit}",
            percent(entry.share, 2),
            f"{entry.channel}, {entry.recording}",
        )
        for entry in requirements
    )
    head = ("Requirement", "As", "Limit", "Nominal refitted", "Corrected", "Of the limit", "Where")
    return Grid("Remaining difference, noise included, by requirement", head, rows, "klrrrrl")


def _bars(entries: tuple[Trial, ...]) -> Picture:
    """Draw residual over floor of each recording: nominal, known parameters refitted, corrected."""
    with draw.style():
        figure, axis = draw.canvas(0.9 + 0.34 * len(entries))
        places = np.arange(len(entries))[::-1]
        for index, (step, color) in enumerate(_STEPS.items()):
            values = [getattr(entry, step) for entry in entries]
            axis.barh(places + (1 - index) * _WIDTH, values, _WIDTH, color=color, label=step, left=0.0)
        axis.axvline(1.0, color=draw.LIMIT, linewidth=0.8, linestyle="--", label="repeatability")
        most = max(max(entry.nominal, entry.known, entry.corrected) for entry in entries)
        draw.logarithmic(axis, "x", 0.5, 1.3 * max(most, 2.0))
        axis.set_yticks(places, [f"{label(entry.recording, 24)} ({entry.role})" for entry in entries])
        axis.grid(visible=False, axis="y")
        axis.set_xlabel("residual over repeatability, rms")
        axis.legend(ncols=4, loc="lower right", bbox_to_anchor=(1.0, 1.0))
        worst = max(entries, key=lambda entry: entry.corrected)
        alt = f"Residual of {len(entries)} recordings over repeatability; corrected, at most {number(worst.corrected)}"
        return draw.picture(figure, alt)
