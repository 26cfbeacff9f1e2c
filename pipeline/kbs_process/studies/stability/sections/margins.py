"""Margins over the swept joint, and what they depend on."""

from __future__ import annotations

import math

import numpy as np

from kbs_process.report import draw
from kbs_process.report.panel import Block, Figure, Grid, Panel, Picture, Text
from kbs_process.report.prose import Prose
from kbs_process.report.tables import Tables
from kbs_process.report.text import number
from kbs_process.studies.stability.results import StabilityResults

_SAYS = Prose("kbs_process.studies.stability", "margins")

_ROWS = 9


def panel(results: StabilityResults, tables: Tables) -> Panel:
    """Figure and table of margins, and the parameters that the critical gain hangs on."""
    question = "How far is the loop from instability, and does that change with the pose?"
    gains = ", ".join(
        f"{joint}: Kp {number(kp)}, Ki {number(ki)} 1/s"
        for joint, kp, ki in zip(results.joints, results.Kp, results.Ki, strict=True)
    )
    words = _SAYS("loop", gains=gains, cycle_s=results.cycle_s, latency=results.latency)
    alt = "Gain margin, phase margin and sensitivity peak over the angle of the swept joint"
    blocks: list[Block] = [
        Text(words),
        Figure("Margins over the range", (_margins(results, alt),), _SAYS.caption("margins")),
        _table(results),
        _sensitivities(results),
    ]
    return Panel("margins", "Margins", question, tuple(blocks))


def _table(results: StabilityResults) -> Grid:
    angles = [entry.angle_rad for entry in results.critical]
    shown = {angles[round(i * (len(angles) - 1) / max(1, _ROWS - 1))] for i in range(_ROWS)}
    critical = {entry.angle_rad: entry for entry in results.critical}
    rows = tuple(
        (
            f"{number(math.degrees(entry.angle_rad))}°",
            entry.joint,
            _decibel(entry.gain),
            number(entry.gain_frequency_Hz),
            number(None if entry.phase_rad is None else math.degrees(entry.phase_rad)),
            number(entry.phase_frequency_Hz),
            number(entry.sensitivity_peak),
            number(critical[entry.angle_rad].factor, 4),
            number(critical[entry.angle_rad].at_rest, 4),
        )
        for entry in results.margins
        if entry.angle_rad in shown
    )
    head = (
        f"Angle of {results.joint}", "Loop", "Gain margin / dB", "at / Hz", "Phase margin / °", "at / Hz",
        "Sensitivity peak", "Critical factor", "with friction's slope at rest",
    )  # fmt: skip
    return Grid("Margins", head, rows, "kkrrrrrrr", _SAYS("table_note"))


def _sensitivities(results: StabilityResults) -> Grid:
    rows = tuple((entry.name, number(entry.sigma_of_factor, 2)) for entry in results.sensitivities[:8])
    total = f"all together: {number(results.worst_sigma, 2)}, at {number(math.degrees(results.worst_angle_rad))}°"
    note = f"First order, every uncertain number of the rig moved by one standard deviation; {total}."
    return Grid("What the critical factor depends on", ("Parameter", "Its sigma moves the factor by"), rows, "lr", note)


def _decibel(value: float | None) -> str:
    return number(None if value is None else 20.0 * math.log10(value))


def _margins(results: StabilityResults, alt: str) -> Picture:
    """Draw the three margins of each joint's loop over the swept angle."""
    with draw.style():
        figure, (gain, phase, peak) = draw.row(2.3, 3)
        for index, joint in enumerate(results.joints):
            mine = [entry for entry in results.margins if entry.joint == joint]
            angle = np.degrees([entry.angle_rad for entry in mine])
            color = draw.SERIES[index % len(draw.SERIES)]
            decibel = 20.0 * np.log10(np.array([entry.gain or np.nan for entry in mine]))
            degrees = np.degrees(np.array([entry.phase_rad or np.nan for entry in mine]))
            gain.plot(angle, decibel, color=color, label=joint)
            phase.plot(angle, degrees, color=color)
            peak.plot(angle, [entry.sensitivity_peak for entry in mine], color=color)
        limits = ((gain, 6.0, "gain margin / dB"), (phase, 30.0, "phase margin / °"), (peak, 2.0, "sensitivity peak"))
        for axis, limit, label in limits:
            draw.limits(axis, limit)
            axis.set_ylim(bottom=0.0)
            axis.set_xlabel(f"{results.joint} / °")
            axis.set_ylabel(label)
        gain.legend(loc="lower right")
        return draw.picture(figure, alt)
