"""How do the sections of the day compare, with each other and with the published table?"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kbs_process.report import draw
from kbs_process.report.panel import Block, Figure, Grid, Panel, Picture, Text
from kbs_process.report.prose import Prose
from kbs_process.report.tables import Tables
from kbs_process.report.text import MISSING, measure, number
from kbs_process.results.pointing import PointingEstimate
from kbs_process.studies.reference_day.results import ReferenceDayResults, Section, Spread

_MDEG = 1e3 * float(np.degrees(1.0))
_SAYS = Prose("kbs_process.studies.reference_day", "sections")


def panel(results: ReferenceDayResults, tables: Tables) -> Panel:
    """Table of the sections with the published figures, and the discussion."""
    blocks: list[Block] = [_compared(results)]
    if any(section.published for section in results.sections):
        figure = _against_published(results.sections)
        blocks.append(
            Figure("95 % of the pointing error, simulated and published", (figure,), _SAYS.caption("compared"))
        )
    if results.samples:
        blocks.append(_units(results))
    if results.discussion:
        blocks.append(Text("Where they differ, and why:", results.discussion))
    blocks.append(_statistics(results))
    question = "How do the sections of the day compare, with each other and with the published table?"
    return Panel("sections", "Sections", question, tuple(blocks))


def _compared(results: ReferenceDayResults) -> Grid:
    bands = tuple(torque.label for torque in results.sections[0].torques)
    head = (
        "Section", "Time / s", "(publ.)", "Mode", "az 95 % / mdeg", "(publ.)", "el 95 % / mdeg", "(publ.)",
        *(f"Torque {band} / N\u00a0m" for band in bands), "(publ.)", "Published comment",
    )  # fmt: skip
    rows = tuple(_row(section) for section in results.sections)
    note = (
        "± is one standard deviation, from the length of the section and the correlation of its error. Torque: "
        "greatest over the axes, at the spacecraft's centre of mass."
    )
    return Grid("Sections of the reference day", head, rows, "krrlrrrr" + "r" * len(bands) + "rl", note)


def _row(section: Section) -> tuple[str, ...]:
    published = section.published
    return (
        section.name,
        f"{section.start_s:.0f}–{section.end_s:.0f}",
        MISSING if published is None else f"to {published.end_s:.0f}",
        ", ".join(section.modes),
        _mdeg(section.azimuth.percentile, section.azimuth.percentile_sigma),
        MISSING if published is None else f"{published.azimuth_mdeg:.1f}",
        _mdeg(section.elevation.percentile, section.elevation.percentile_sigma),
        MISSING if published is None else f"{published.elevation_mdeg:.1f}",
        *(number(torque.value, 2) for torque in section.torques),
        MISSING if published is None else published.torque,
        "" if published is None else published.comment,
    )


def _units(results: ReferenceDayResults) -> Grid:
    """What units differ by, in every figure of the sections."""
    bands = tuple(f"Torque {torque.label} / N\u00a0m" for torque in results.sections[0].torques)
    rows = tuple(
        (
            section.name,
            _among(section.azimuth_units, _MDEG),
            _among(section.elevation_units, _MDEG),
            *(_among(torque.units, 1.0) for torque in section.torques),
        )
        for section in results.sections
    )
    note = _SAYS("units", samples=results.samples, seed=results.seed)
    head = ("Section", "az 95 % / mdeg", "el 95 % / mdeg", *bands)
    return Grid("What units differ by", head, rows, "krr" + "r" * len(bands), note)


def _among(one: Spread | None, scale: float) -> str:
    if one is None:
        return MISSING
    least, greatest = (number(scale * x, 3) for x in (one.least, one.greatest))
    return f"{measure(scale * one.mean, scale * one.sigma)} ({least} to {greatest})"


def _mdeg(value: float, sigma: float) -> str:
    return measure(_MDEG * value, _MDEG * sigma)


def _statistics(results: ReferenceDayResults) -> Grid:
    head = ("Section", "Axis", "Bias / mdeg", "Random, 2 σ / mdeg", "95 % / mdeg", "Greatest / mdeg")
    rows = [
        _line(section.name, name, one)
        for section in results.sections
        for name, one in (("azimuth", section.azimuth), ("elevation", section.elevation))
    ]
    rows += [_line("whole day", one.axis, one) for one in results.boresight]
    note = "Whole day: in the boresight's own frame; the line of sight is the resultant, whose mean is no bias."
    return Grid("Statistics of the pointing error", head, tuple(rows), "kkrrrr", note)


def _line(where: str, name: str, one: PointingEstimate) -> tuple[str, ...]:
    return (
        where,
        name,
        _mdeg(one.bias, one.bias_sigma),
        _mdeg(one.random, one.random_sigma),
        _mdeg(one.percentile, one.percentile_sigma),
        number(_MDEG * one.greatest),
    )


def _sigma(own: PointingEstimate, among: Spread | None) -> float:
    """One standard deviation, mdeg, of 95 %: by the length of the section, and by what units differ by."""
    return _MDEG * float(np.hypot(own.percentile_sigma, 0.0 if among is None else among.sigma))


def _against_published(sections: Sequence[Section]) -> Picture:
    """Draw 95 % of either axis' error, ours with two sigma beside the published one."""
    place = np.arange(len(sections), dtype=float)
    with draw.style():
        figure, axes = draw.row(2.3, 2, share_y=True)
        for axis, which in zip(axes, ("azimuth", "elevation"), strict=True):
            ours = [_MDEG * getattr(section, which).percentile for section in sections]
            sigma = [_sigma(getattr(section, which), getattr(section, f"{which}_units")) for section in sections]
            theirs = [getattr(section.published, f"{which}_mdeg", np.nan) for section in sections]
            axis.bar(place - 0.2, ours, 0.38, yerr=2.0 * np.array(sigma), color=draw.MEASURED, label="simulated, ± 2 σ",
                     error_kw={"elinewidth": 0.8, "capsize": 1.5, "ecolor": draw.INK})  # fmt: skip
            axis.bar(place + 0.2, theirs, 0.38, color=draw.PREDICTED, label="published")
            axis.set_xticks(place, [section.name for section in sections])
            axis.grid(visible=False, axis="x")
            axis.set_title(which)
            axis.set_xlabel("section")
        axes[0].set_ylim(bottom=0.0)  # shared; an error of a statistic may be greater than the statistic
        axes[0].set_ylabel("95 % error / mdeg")
        axes[0].legend(loc="upper left", fontsize=6.5)
        return draw.picture(figure, "95 % of the pointing error of each section, simulated and published")
