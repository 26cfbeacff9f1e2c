"""Archived campaigns against what was drawn for them: are the stated sigmas, and the budget, honest?

pytest tests/end_to_end -s        # prints the figures
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest

from end_to_end.archive_run import Processed
from end_to_end.truth import Truth
from engine.hardware import Array
from kbs_process.signals.records import WRENCH_CHANNELS, WRENCH_UNITS, Signal
from kbs_process.stages import bandpass
from kbs_process.stages.bandpass import Band

pytestmark = pytest.mark.validation

# Four of those with an antenna and without a cord, for time.
NAMES = ("EL089", "AZPS_ATA", "AESTPP00", "ACQ600")
INFORMED = 1.5  # prior sigma over sigma, from which the recordings have a say


@dataclass(frozen=True)
class Fitted:
    """Fitted parameters of one campaign."""

    names: tuple[str, ...]
    error: Array  # (p,) value less truth
    sigma: Array  # (p,)
    prior_sigma: Array  # (p,)

    @property
    def z(self) -> Array:
        return self.error / self.sigma


@pytest.fixture(scope="module")
def fitted(archived: Callable[[str], Processed]) -> dict[str, Fitted]:
    return {name: _fitted(archived(name)) for name in NAMES}


def _fitted(campaign: Processed) -> Fitted:
    parameters = campaign.results["gravity"]["parameters"]
    truth = Truth(campaign.name)
    return Fitted(
        names=tuple(p["name"] for p in parameters),
        error=np.array([p["value"] - truth.parameter(p["name"]) for p in parameters]),
        sigma=np.array([p["sigma"] for p in parameters]),
        prior_sigma=np.array([p["prior_sigma"] for p in parameters]),
    )


def test_stated_sigmas_cover_the_truth(fitted: dict[str, Fitted]) -> None:
    """On many campaigns, drawn for nothing else: `python -m stages.gravity.drawn_rigs`."""
    z = np.concatenate([one.z for one in fitted.values()])
    gain = np.concatenate([one.prior_sigma / one.sigma for one in fitted.values()])
    informed = z[gain > INFORMED]
    for name, one in fitted.items():
        print(f"{name}: z rms {_rms(one.z):.2f}, {np.mean(np.abs(one.z) < 2):.3f} within 2 sigma")
    print(
        f"all {len(z)}: z rms {_rms(z):.2f}, {np.mean(np.abs(z) < 2):.3f} within 2 sigma; "
        f"{len(informed)} that the data inform: {_rms(informed):.2f}, {np.mean(np.abs(informed) < 2):.3f}"
    )
    assert 0.8 < _rms(z) < 1.2
    assert np.mean(np.abs(z) < 2) > 0.9
    assert len(informed) > 40
    assert 0.6 < _rms(informed) < 1.3
    assert np.mean(np.abs(informed) < 2) > 0.87


def test_centre_of_gravity_of_the_antenna(fitted: dict[str, Fitted]) -> None:
    """EL089's antenna: within three stated sigmas, and known better than the parameter file does."""
    one = fitted["EL089"]
    for axis in range(3):
        at = one.names.index(f"body.antenna.cog[{axis}]")
        print(
            f"CoG {'xyz'[axis]}: {1e3 * one.error[at]:+.3f} mm off, sigma {1e3 * one.sigma[at]:.3f} mm, "
            f"before the fit {1e3 * one.prior_sigma[at]:.1f} mm"
        )
        assert abs(one.z[at]) < 3
        assert one.sigma[at] < 0.6 * one.prior_sigma[at]


@pytest.mark.parametrize(("name", "edge"), [("lt1Hz", 1.0), ("lt2Hz", 2.0)])
def test_error_in_the_band_is_what_the_budget_states(
    archived: Callable[[str], Processed], name: str, edge: float
) -> None:
    """Measured disturbance less the true one, channel by channel, over the report's total."""
    campaign = archived("EL089")
    run = list(Truth("EL089").runs())[1]
    table = campaign.table(f"bands/{run.recording}.{name}")
    t = table["t"]
    dt = (t[-1] - t[0]) / (len(t) - 1)
    everywhere = np.ones(len(t), dtype=bool)
    true = Signal(t[0], dt, run.disturbance(t), WRENCH_CHANNELS, WRENCH_UNITS, "T", everywhere)
    cut = bandpass.apply(true, Band(name, 0.01, edge))
    valid = table["valid"] & cut.valid
    stated = {
        b["channel"]: b["total"]
        for b in campaign.results["budget"]
        if (b["recording"], b["frame"], b["band"]) == (run.recording, "T", name)
    }
    for index, channel in enumerate(WRENCH_CHANNELS):
        error = _rms(table[f"{channel}.measured"][valid] - cut.values[valid, index])
        print(f"{name} {channel}: error {error:.2e}, budget {stated[channel]:.2e}, {error / stated[channel]:.2f}")
        assert 0.7 < error / stated[channel] < 1.4


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))
