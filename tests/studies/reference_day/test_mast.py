"""A unit on a mast that yields: two inertias on a spring in closed form, the boresight's turn, and a short day."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from kbs_process.campaign.load import load_campaign
from kbs_process.campaign.mission import load_day
from kbs_process.campaign.writing.modal_file import modal_text
from kbs_process.errors import ConfigError
from kbs_process.plant.linear.modal import ModalModel, ModalTable
from kbs_process.progress import SilentProgress
from kbs_process.results.records import load
from kbs_process.signals.records import WRENCH_CHANNELS, WRENCH_UNITS, Array, Signal
from kbs_process.studies.reference_day.on_mast import answer, off_boresight
from kbs_process.studies.reference_day.results import ReferenceDayResults
from kbs_process.studies.reference_day.run import simulate_day
from studies.reference_day.test_reference_day import WHOLE, short_campaign

K, FOOT, HEAD, DAMPING = 400.0, 3.0, 1.5, 0.02  # N m/rad; kg m^2 of base and of what its drive turns; of critical
F0 = np.sqrt(K / (FOOT + HEAD)) / (2.0 * np.pi)  # 1.5 Hz, the drive held


def spring(axis: int = 5) -> ModalTable:
    """The only mode of both inertias on the spring about one of T's axes."""
    shape, participation = np.zeros((6, 1)), np.zeros((6, 1))
    shape[axis] = (FOOT + HEAD) ** -0.5
    participation[axis] = (FOOT + HEAD) ** 0.5
    known = (np.array([x]) for x in (F0, 0.0, DAMPING, 0.0))
    return ModalTable("az", (ModalModel(0.0, *known, shape, participation, np.zeros((6, 1))),), "two inertias")


def signal(values: Array, channels: tuple[str, ...], units: tuple[str, ...]) -> Signal:
    return Signal(0.0, 0.05, values, channels, units, "T", np.ones(len(values), dtype=np.bool_))


@pytest.mark.parametrize("f", [0.2, 1.0, 1.45, 4.0])
def test_two_inertias_on_a_spring(f: float) -> None:
    """The drive turns HEAD against FOOT by y: (FOOT + HEAD) a'' + c a' + K a = -HEAD y'', and K a + c a' is felt.

    On a rigid interface it feels -HEAD y''. So both answers are those of one resonance.
    """
    t = 0.05 * np.arange(6000)
    w, w0 = 2.0 * np.pi * f, 2.0 * np.pi * F0
    torque = np.zeros((len(t), 6))
    torque[:, 5] = np.sin(w * t)
    angle = signal(np.zeros((len(t), 2)), ("az", "el"), ("rad", "rad"))
    found = answer(signal(torque, WRENCH_CHANNELS, WRENCH_UNITS), angle, spring())
    resonance = w0**2 - w**2 + 2j * DAMPING * w0 * w
    middle = slice(2400, 3600)
    for x, expected in (
        (found.turn.values[:, 2], w0**2 / K / resonance),
        # Modal: the foot's torque is all but the damper's, which is 2 zeta of it at resonance.
        (found.wrench.values[:, 5], (w0**2 + 2j * DAMPING * w0 * w) / resonance),
    ):
        assert x[middle] == pytest.approx(np.imag(expected * np.exp(1j * w * t[middle])), abs=2e-3 * abs(expected))
    assert np.abs(found.wrench.values[:, :5]).max() < 1e-12


def test_the_boresight_turns_with_the_head() -> None:
    """Against the rotation itself, at any pose."""
    rng = np.random.default_rng(3)
    q = rng.uniform([-2.0, -0.4], [2.0, 1.4], (20, 2))
    turn = 1e-6 * rng.standard_normal((20, 3))
    ca, sa, ce, se = np.cos(q[:, 0]), np.sin(q[:, 0]), np.cos(q[:, 1]), np.sin(q[:, 1])
    u = np.stack([ce * ca, ce * sa, se], axis=1)
    moved = u + np.cross(turn, u)
    azimuth, elevation = np.arctan2(moved[:, 1], moved[:, 0]), np.arcsin(moved[:, 2])
    expected = np.stack([(azimuth - q[:, 0]) * ce, elevation - q[:, 1]], axis=1)
    assert off_boresight(turn, q) == pytest.approx(expected, abs=1e-11)


@pytest.mark.slow
def test_a_day_on_a_mast_tells_both(tmp_path: Path) -> None:
    folder = tmp_path / "SHORT"
    short_campaign(folder, 60.0, WHOLE)
    (folder / "mast.toml").write_text(modal_text(spring(4)), encoding="utf-8")
    text = (folder / "campaign.toml").read_text(encoding="utf-8")
    (folder / "campaign.toml").write_text(text.replace("[mission]\n", '[mission]\nmast = "mast.toml"\n'), "utf-8")
    campaign = load_campaign(folder, recordings=False)
    out = tmp_path / "out"
    outcome = simulate_day(campaign, out, samples=0, seed=0, progress=SilentProgress(), pdf=False)
    found = load(out, ReferenceDayResults)
    (section,) = found.sections
    assert found.mast is not None and section.mast is not None
    assert found.mast.frequency_Hz[0][0] == pytest.approx(F0)
    assert section.mast.rigid[0] != section.torques[0].value
    assert 0.0 < section.mast.elevation < 1e-4
    assert "The day on the mast" in outcome.report.read_text(encoding="utf-8")
    assert folder / "mast.toml" in campaign.inputs

    rig = (folder / "parameters" / "rig.toml").read_text(encoding="utf-8")
    known = '{ value = [1e3, 1e3, 1e3], unit = "N m/rad", sigma = 0.0, source = "guess" }'
    yielding = f"[transducer]\nstiffness = {known}\ndamping = {known.replace('N m/rad', 'N m s/rad')}\n"
    (folder / "parameters" / "rig.toml").write_text(rig.replace("[transducer]\n", yielding), "utf-8")
    with pytest.raises(ConfigError, match=r"yields by transducer\.stiffness, and by \[mission\] mast once more"):
        load_day(load_campaign(folder, recordings=False))
