"""Is the prediction pessimistic on a channel? Yes, no, or not testable: never more than the figures of merit say."""

from __future__ import annotations

from pathlib import Path

import msgspec
import pytest

from kbs_process.report.panel import Cell
from kbs_process.report.tables import Tables
from kbs_process.studies.correlate.results import Merit
from kbs_process.studies.correlate.sections.merit import panel
from report import sample


def answer(*rows: tuple[float, float], sigma: float | None = 1.0) -> str:
    """What is said of Tx, for the pessimism and the measured rms of each recording."""
    first = next(row for row in sample.command_results().merit if (row.channel, row.frame) == ("Tx", "T"))

    def row(index: int, ratio: float, signal: float) -> Merit:
        changes = {"recording": str(index), "measured_rms": signal, "sigma": sigma}
        changes |= {"measured_peak": 10.0, "predicted_peak": 10.0 * ratio}
        return msgspec.structs.replace(first, **changes)

    merit = tuple(row(index, *each) for index, each in enumerate(rows))
    found = msgspec.structs.replace(sample.command_results(), merit=merit)
    grid = panel(found, Tables(Path("nowhere"))).blocks[0]
    cell = grid.rows[0][1]
    assert isinstance(cell, Cell)
    return cell.text


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        ([(1.2, 5.0), (1.0, 5.0)], "yes, 2 of 2"),
        ([(1.2, 5.0), (0.7, 5.0)], "no, 1 of 2"),
        ([(1.2, 5.0), (0.9, 5.0)], "open, 1 of 2"),  # 9 is below 10 +- 1 by less than noise can make it
        ([(1.2, 5.0), (0.1, 1.5)], "yes, 1 of 1"),  # the second is at the noise
        ([(1.2, 1.0), (0.1, 1.5)], "not testable"),
    ],
)
def test_only_what_is_above_the_noise_answers(rows: list[tuple[float, float]], said: str) -> None:
    assert answer(*rows) == said


def test_without_a_stated_uncertainty_nothing_is_said() -> None:
    assert answer((1.2, 5.0), sigma=None) == "not testable"
