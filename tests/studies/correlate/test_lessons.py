"""Section 8 of the paper is answered line by line, with figures that stand elsewhere, or by what is missing."""

from __future__ import annotations

from pathlib import Path

import msgspec
import pytest

from kbs_process.report.panel import Cell, Grid
from kbs_process.report.tables import Tables
from kbs_process.results.judged import BudgetItem
from kbs_process.stages.budget import CORDS, MATRIX, NOISE
from kbs_process.stages.gravity.error import ANGLES
from kbs_process.studies.correlate.report import DOCUMENT
from kbs_process.studies.correlate.results import GainAt, OnTransducer, Results, RigForce
from kbs_process.studies.correlate.sections.lessons import panel
from report import sample

NOWHERE = Tables(Path("nowhere"))


def results() -> Results:
    """The sample, with causes that its budget names as the pipeline does: 2, 20, 10 and 60 % of the measured rms."""
    found = sample.command_results()
    rms = {(m.recording, m.band, m.frame, m.channel): m.measured_rms or 0.0 for m in found.merit}
    shares = {MATRIX: 0.02, ANGLES: 0.2, CORDS: 0.1, NOISE: 0.6}
    budget = []
    for row in found.budget:
        whole = rms[row.recording or "", row.band, row.frame, row.channel]
        parts = tuple(BudgetItem(stage="", source=source, sigma=share * whole) for source, share in shares.items())
        budget.append(msgspec.structs.replace(row, total=whole, contributions=parts))
    gains = tuple(
        GainAt(angle_rad=1.2, frequency_Hz=edge, channel=channel, gain=gain, sigma=0.01)
        for edge, channel, gain in ((1.0, "Tx", 1.16), (1.0, "Ty", 1.1), (2.0, "Tx", 2.2))
    )
    transducer = OnTransducer(recording="EL089P00_1", gains=gains)
    return msgspec.structs.replace(found, budget=tuple(budget), transducer=transducer)


def lines(found: Results) -> list[str]:
    """What stands beside each of the paper's conclusions."""
    made = panel(found, NOWHERE)
    assert made is not None
    grid = made.blocks[0]
    assert isinstance(grid, Grid)
    return [str(row[1]).replace("\u00a0", " ") for row in grid.rows]


def test_each_line_has_this_campaigns_figure() -> None:
    found = lines(results())
    for line, figure in enumerate(
        (
            "The whole model leaves", "Up to 9", "by 16 % at 1 Hz (Tx), 120 % at 2 Hz (Tx)", "At most 20 %",
            "Ty no, 0 of 2", "in 1 of 2 recordings", "at most 2.0 % of the uncertainty", "something else pulls",
            "in 1 of 1 trajectories",
        )
    ):  # fmt: skip
        assert figure in found[line]


@pytest.mark.slow  # draws every section
def test_lines_lead_to_sections_of_the_report() -> None:
    found = sample.command_results()
    made = panel(found, NOWHERE)
    assert made is not None
    grid = made.blocks[0]
    assert isinstance(grid, Grid)
    sections = {made.key for make in DOCUMENT.panels if (made := make(found, NOWHERE)) is not None}
    assert {cell.to.removeprefix("#") for row in grid.rows for cell in row if isinstance(cell, Cell)} <= sections


def test_noise_is_told_of_each_trajectory() -> None:
    made = panel(results(), NOWHERE)
    assert made is not None
    table = made.blocks[1]
    assert isinstance(table, Grid)
    assert [[str(cell).replace("\u00a0", " ") for cell in row] for row in table.rows] == [
        ["EL089P00", "60 %", "60 %", "60 %"]
    ]


def test_a_described_cord_is_told_with_what_is_left() -> None:
    force = RigForce(recording="EL089P00_1", band="lt1Hz", frame="T", channel="Ty", unit="N m", rms=1.3)
    line = lines(msgspec.structs.replace(results(), rig_forces=(force,)))[7]
    assert line.startswith("Described cords make 1.3 N m rms (Ty of EL089P00_1)")


@pytest.mark.parametrize("missing", ["gravity", "transducer", "merit", "six_channels"])
def test_what_is_missing_is_said(missing: str) -> None:
    empty = {"gravity": None, "transducer": None, "merit": (), "six_channels": ()}[missing]
    found = lines(msgspec.structs.replace(results(), **{missing: empty}))
    assert any("ot answered" in line or "not tested" in line for line in found)


def test_rigs_without_a_spacecraft_have_none() -> None:
    assert panel(msgspec.structs.replace(results(), merit=(), requirements=()), NOWHERE) is None


def test_a_fit_of_forces_alone_leaves_no_torque_to_tell() -> None:
    found = results()
    assert found.gravity is not None
    forces = tuple(msgspec.structs.replace(rung, rms={"Fz": 0.1}) for rung in found.gravity.ladder)
    told = lines(msgspec.structs.replace(found, gravity=msgspec.structs.replace(found.gravity, ladder=forces)))
    assert told[0].startswith("Not answered")
