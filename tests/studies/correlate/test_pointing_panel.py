"""Limits on pointing are shown with what was found, of a rig without a transducer, too."""

from __future__ import annotations

from pathlib import Path

import msgspec

from kbs_process.report.panel import Cell, Grid, Panel
from kbs_process.report.tables import Tables
from kbs_process.results.pointing import JudgedPointing
from kbs_process.studies.correlate.results import Results
from kbs_process.studies.correlate.sections.pointing import panel
from report import sample

MET = JudgedPointing(
    name="Bias", statistic="bias", limit=1e-3, verdict="pass", value=2e-4, sigma=1e-4, where="el in R1, by encoder"
)
OPEN = JudgedPointing(name="Drift", statistic="orbit", limit=1e-3, verdict="undecided", doubt="a recording is no orbit")


def shown(found: Results) -> Panel | None:
    return panel(found, Tables(Path("nowhere")))


def of_efforts(*judged: JudgedPointing) -> Results:
    """A rig whose joints' efforts are all that is recorded."""
    found = sample.command_results()
    campaign = msgspec.structs.replace(found.campaign, frame="joint")
    return msgspec.structs.replace(found, campaign=campaign, pointing=(), judged_pointing=judged)


def test_each_limit_has_a_row() -> None:
    made = shown(of_efforts(MET, OPEN))
    assert made is not None
    grid = made.blocks[-1]
    assert isinstance(grid, Grid)
    first, second = grid.rows
    assert first[0] == "Bias (bias)"
    assert str(first[1]).replace("\xa0", " ") == "11.5 ± 5.7"  # mdeg
    assert first[2:4] == ("57.3", "el in R1, by encoder")
    assert first[-1] == Cell("pass", "pass")
    assert (second[1], second[-1]) == ("–", Cell("undecided", "undecided"))
    assert "a recording is no orbit" in str(grid.note)


def test_a_rig_without_a_transducer_is_asked_only_where_a_limit_is_stated() -> None:
    assert shown(of_efforts()) is None
