"""How well did the article point, as its encoders and an external instrument saw it?"""

from __future__ import annotations

import numpy as np

from kbs_process.report import distributions as figures
from kbs_process.report import draw
from kbs_process.report.panel import Block, Cell, Figure, Grid, Panel, Picture, Text
from kbs_process.report.prose import Prose
from kbs_process.report.tables import Table, Tables
from kbs_process.report.text import MISSING, measure, number, unit
from kbs_process.results.pointing import RecordedPointing
from kbs_process.studies.correlate.choose import PLATES
from kbs_process.studies.correlate.results import InstrumentChannel, Results

_POINTS = 3000  # of a curve
_SAYS = Prose("kbs_process.studies.correlate", "pointing")


def panel(results: Results, tables: Tables) -> Panel | None:
    """Densities of the first recordings, the statistics of all, and what they must meet."""
    rows, judged = results.pointing, results.judged_pointing
    if results.campaign.frame != "T" and not judged and not results.instruments:
        return None
    blocks: list[Block] = []
    pictures = _densities(rows, tables)
    if pictures:
        blocks.append(Figure("Distribution of the pointing error", pictures, _SAYS.caption("density")))
    nothing = Text("No recording has both commands and angles: nothing can be said about pointing.")
    blocks += [_table(rows) if rows else nothing, *([_judged(results)] if judged else [])]
    if results.instruments:
        blocks += _instruments(results.instruments, tables)
    question = "How well did the article point, as its encoders and an external instrument saw it?"
    return Panel("pointing", "Pointing", question, tuple(blocks))


def _densities(rows: tuple[RecordedPointing, ...], tables: Tables) -> tuple[Picture, ...]:
    pictures = []
    for recording in list(dict.fromkeys(row.recording for row in rows))[:PLATES]:
        table = tables.read("aligned", recording)
        if table is None:
            continue
        found = []
        for row in rows:
            axis = row.estimate.axis
            # An axis that was not asked to move may read one code throughout: there is nothing to draw.
            if (row.recording, row.instrument) == (recording, "encoder") and row.estimate.random > 0.0:
                error = table.columns[f"angle.{axis}"] - table.columns[f"command.{axis}"]
                found.append((axis, error[table.valid & np.isfinite(error)], row.estimate))
        if found:
            pictures.append(figures.distributions(found, recording))
    return tuple(pictures)


def _table(rows: tuple[RecordedPointing, ...]) -> Grid:
    head = (
        "Recording", "Instrument", "Axis", "Bias / mdeg", "Random, 2 σ / mdeg", "95 % / mdeg", "Variation / mdeg",
        "Greatest / mdeg",
    )  # fmt: skip
    body = tuple(
        (
            row.recording,
            row.instrument,
            row.estimate.axis,
            _mdeg(row.estimate.bias, row.estimate.bias_sigma),
            _mdeg(row.estimate.random, row.estimate.random_sigma),
            _mdeg(row.estimate.percentile, row.estimate.percentile_sigma),
            number(_in_mdeg(row.estimate.orbit)),
            number(_in_mdeg(row.estimate.greatest)),
        )
        for row in rows
    )
    return Grid("Pointing error against the command", head, body, "kkkrrrrr", _SAYS("table_note"))


def _judged(results: Results) -> Grid:
    head = ("Requirement", "Measured / mdeg", "Limit / mdeg", "Worst case", "Predicted / mdeg", "Verdict")
    body = tuple(
        (
            f"{one.name} ({one.statistic})",
            MISSING if one.value is None or one.sigma is None else _mdeg(one.value, one.sigma),
            number(_in_mdeg(one.limit)),
            one.where or MISSING,
            MISSING if one.predicted is None else number(_in_mdeg(one.predicted)),
            Cell(one.verdict, one.verdict),
        )
        for one in results.judged_pointing
    )
    doubts = list(dict.fromkeys(one.doubt for one in results.judged_pointing if one.doubt))
    return Grid("Requirements on pointing", head, body, "lrrlrc", _SAYS("judged_note", doubts=doubts))


def _instruments(rows: tuple[InstrumentChannel, ...], tables: Tables) -> list[Block]:
    """Histories of the first recording of each instrument, and all figures."""
    pictures = []
    for instrument in dict.fromkeys(row.instrument for row in rows):
        own = [row for row in rows if row.instrument == instrument]
        own = [row for row in own if row.recording == own[0].recording]
        table = tables.read("instruments", f"{own[0].recording}.{instrument}")
        if table is not None:
            pictures.append(_histories(own, table))
    figure = [Figure("Accelerometer and gyro beside the motion", tuple(pictures), _SAYS.caption("beside"))]
    head = (
        "Recording", "Instrument", "Axis", "Unit", "Zero", "Measured", "Encoders", "less encoders", "Predicted",
        "less predicted", "Noise",
    )  # fmt: skip
    body = tuple(
        (
            *(row.recording, row.instrument, row.channel, unit(row.unit)),
            *map(number, (row.zero, row.measured, row.encoders, row.encoders_left)),
            *map(number, (row.predicted, row.predicted_left, row.noise)),
        )
        for row in rows
    )
    grid = Grid("What accelerometer and gyro read", head, body, "kkkkrrrrrrr", _SAYS("instruments_note"))
    return [*(figure if pictures else []), grid]


def _histories(rows: list[InstrumentChannel], table: Table) -> Picture:
    """Draw an axis a row, each about its mean: measured, by the encoders' motion, and by the model's."""
    t = table.columns["t"]
    thin = max(1, len(t) // _POINTS)
    kinds = (("measured", draw.MEASURED), ("encoders", draw.RESIDUAL), ("predicted", draw.PREDICTED))
    with draw.style():
        figure, axes = draw.grid(0.5 + 1.1 * len(rows), len(rows), share_x=True)
        for axis, row in zip(axes, rows, strict=True):
            for kind, color in kinds:
                if (x := table.columns.get(f"{row.channel}.{kind}")) is not None:
                    about = np.where(table.valid, x - np.mean(x[table.valid]), np.nan)
                    axis.plot(t[::thin], about[::thin], color=color, linewidth=0.7, label=kind)
            axis.set_ylabel(f"{row.channel} / {unit(row.unit)}")
        axes[0].legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3)
        axes[-1].set_xlabel("time / s")
        return draw.picture(figure, f"{rows[0].instrument} in {rows[0].recording}, beside the motion", form="png")


def _mdeg(value: float, sigma: float) -> str:
    return measure(_in_mdeg(value), _in_mdeg(sigma))


def _in_mdeg(value: float) -> float:
    return 1e3 * float(np.degrees(value))
