"""Orders of a recording, from a torque on a track to the section of the report."""

from __future__ import annotations

from pathlib import Path

import msgspec
import numpy as np
import pytest

from kbs_process.plant.laws import select
from kbs_process.report.panel import Figure, Grid, Text
from kbs_process.report.tables import Tables
from kbs_process.results.tables import write_table
from kbs_process.rig.model import Drive, Joint, Quantity
from kbs_process.signals.records import Array, Signal
from kbs_process.stages.orders.known import known_orders
from kbs_process.stages.orders.tracking import Track
from kbs_process.studies.correlate.orders import follow, tables_of
from kbs_process.studies.correlate.results import OrdersIn
from kbs_process.studies.correlate.sections.spectra import orders
from report import sample

DT = 0.05
T = DT * np.arange(4000)
RATE = 8e-4 * (1.0 + 0.6 * np.sin(2.0 * np.pi * T / 90.0))  # turns/s
TRACK = Track(DT * np.cumsum(RATE), RATE, np.ones(len(T), dtype=np.bool_), DT, 0.0, 8.0)
CHANNELS = ("Fz", "Tx", "Ty")


def number(value: float) -> Quantity:
    return Quantity("", np.array(value), "", np.array(0.0), "")


def joint(**parameters: float) -> Joint:
    has = {name: number(value) for name, value in parameters.items()}
    drive = Drive(number(100.0), number(2e-5), number(12800.0), has)
    return Joint("el", "lab", (0.0, 0.0, 1.0), number(0.0), number(0.0), None, drive)


KNOWN = known_orders(joint(Kangle=100.0, kinematic_order=3.0), select(["cogging", "kinematic_error"]))


def side(amplitudes: dict[float, float], noise: float, seed: int = 1) -> Signal:
    """Ty with some orders, on every channel noise."""
    values = noise * np.random.default_rng(seed).normal(size=(len(T), 3))
    values[:, 2] += sum(size * np.sin(2.0 * np.pi * order * TRACK.turns) for order, size in amplitudes.items())
    valid: Array = np.ones(len(T), dtype=np.bool_)
    return Signal(0.0, DT, values, CHANNELS, ("N", "N m", "N m"), "T", valid)


def said(*sides: Signal) -> OrdersIn:
    found = follow("EL089P00_2", "el", TRACK, sides, KNOWN)
    assert found is not None
    return found.findings


def test_what_the_description_has_at_an_order_is_named() -> None:
    assert KNOWN == {
        "turn of the joint": 1.0,
        "motor turn": 100.0,
        "motor step": 1.28e6,
        "electrical cycle": 1e4,
        "cogging": 2e4,
        "kinematic error": 300.0,
    }
    found = said(side({200.0: 0.01, 300.0: 0.02, 450.0: 0.03}, 1e-3))
    assert {round(peak.order): peak.known for peak in found.peaks} == {
        200: ("motor turn × 2",),
        300: ("motor turn × 3", "kinematic error"),
        450: (),
    }
    assert {peak.channel for peak in found.peaks} == {"Ty"}
    assert found.above == {"motor step": 1.28e6, "electrical cycle": 1e4, "cogging": 2e4}


def test_the_prediction_stands_beside_the_measurement() -> None:
    measured, predicted = side({200.0: 0.01, 450.0: 0.02}, 1e-3), side({200.0: 0.012, 900.0: 0.03}, 0.0)
    peaks = {round(peak.order): peak for peak in said(measured, predicted).peaks}
    assert sorted(peaks) == [200, 450, 900]
    assert peaks[200].measured == pytest.approx(0.01, rel=0.02)
    assert peaks[200].predicted == pytest.approx(0.012, rel=0.02)
    assert peaks[450].predicted == pytest.approx(0.0, abs=1e-4)
    assert peaks[900].measured is None and peaks[900].predicted == pytest.approx(0.03, rel=0.02)


def test_without_a_prediction_and_without_peaks_the_section_says_so(tmp_path: Path) -> None:
    results = sample.command_results()
    section = orders.panel(results, Tables(tmp_path))
    assert [type(block) for block in section.blocks] == [Text]


def test_the_section_has_peaks_spectra_maps_and_what_is_left_out(tmp_path: Path) -> None:
    found = follow("EL089P00_2", "el", TRACK, [side({200.0: 0.01}, 1e-3), side({200.0: 0.012}, 0.0)], KNOWN)
    assert found is not None
    for kind, (columns, units) in tables_of(found).items():
        write_table(tmp_path / "tables" / "orders" / f"EL089P00_2.el{kind}.parquet", columns, units)
    results = msgspec.structs.replace(sample.command_results(), orders=(found.findings,))
    peaks, spectra, maps, limits = orders.panel(results, Tables(tmp_path)).blocks
    assert isinstance(peaks, Grid) and isinstance(spectra, Figure)
    assert isinstance(maps, Figure) and isinstance(limits, Grid)
    assert peaks.rows[0][:3] == ("EL089P00_2", "el", "Ty / N\u00a0m")
    assert peaks.rows[0][-1] == "motor turn × 2"
    assert spectra.live is not None and spectra.live.views[0].places is not None
    assert [channel.name for channel in spectra.live.views[0].channels] == ["Tx", "Ty"]
    assert "cogging" in str(limits.rows[0][-1])
    assert len(maps.pictures) == 1
