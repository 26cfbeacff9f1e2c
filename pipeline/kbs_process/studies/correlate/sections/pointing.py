"""How well did the article point, as its encoders and an external instrument saw it?"""

from __future__ import annotations

import numpy as np

from kbs_process.report import distributions as figures
from kbs_process.report.panel import Block, Cell, Figure, Grid, Panel, Picture, Text
from kbs_process.report.prose import Prose
from kbs_process.report.tables import Tables
from kbs_process.report.text import MISSING, measure, number
from kbs_process.results.pointing import RecordedPointing
from kbs_process.studies.correlate.choose import PLATES
from kbs_process.studies.correlate.results import Results

_SAYS = Prose("kbs_process.studies.correlate", "pointing")


def panel(results: Results, tables: Tables) -> Panel | None:
    """Densities of the first recordings, the statistics of all, and what they must meet."""
    rows, judged = results.pointing, results.judged_pointing
    if results.campaign.frame != "T" and not judged:
        return None
    blocks: list[Block] = []
    pictures = _densities(rows, tables)
    if pictures:
        blocks.append(Figure("Distribution of the pointing error", pictures, _SAYS.caption("density")))
    nothing = Text("No recording has both commands and angles: nothing can be said about pointing.")
    blocks += [_table(rows) if rows else nothing, *([_judged(results)] if judged else [])]
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


def _mdeg(value: float, sigma: float) -> str:
    return measure(_in_mdeg(value), _in_mdeg(sigma))


def _in_mdeg(value: float) -> float:
    return 1e3 * float(np.degrees(value))
