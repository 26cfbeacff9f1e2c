"""The transducer's resonance in processed campaigns."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
import pytest

if TYPE_CHECKING:
    from end_to_end.archive_run import Processed

pytestmark = pytest.mark.slow

Archived = Callable[[str], "Processed"]


def test_both_ways_agree_at_the_resonance_and_below_the_noise_elsewhere(archived: Archived) -> None:
    found = archived("EL089").results["transducer"]
    for entry in found["agreement"]:
        if entry["band"] != "unfiltered":
            assert entry["difference_rms"] < 0.1 * entry["noise_rms"], entry
        elif entry["coupled_rms"] > 0.1 * entry["noise_rms"]:
            assert entry["difference_rms"] < 0.25 * entry["coupled_rms"], entry
            assert entry["rigid_rms"] < 0.5 * entry["coupled_rms"], entry


def test_gains_are_those_of_the_modes(archived: Archived) -> None:
    found = archived("EL089").results["transducer"]
    lowest = min(mode["frequency_Hz"] for mode in found["modes"])
    for entry in found["gains"]:
        growth = entry["gain"] - 1.0
        if entry["channel"] == "Ty":
            single = 1.0 / (1.0 - (entry["frequency_Hz"] / lowest) ** 2) - 1.0
            assert growth == pytest.approx(single, rel=0.5)
            assert 0.0 < entry["sigma"] < 0.1 * growth
    errors = {(e["frame"], e["band"], e["channel"]): e for e in found["errors"]}
    below_1, below_2 = (errors["S", band, "Ty"] for band in ("lt1Hz", "lt2Hz"))
    assert below_1["error_rms"] < below_2["error_rms"]
    assert 0.0 < below_2["error_peak_sigma"] < below_2["error_peak"]


def test_curves_are_kept_and_shown(archived: Archived) -> None:
    done = archived("EL089")
    name = done.results["transducer"]["recording"]
    gain, spectrum = done.table(f"transducer/{name}.gain"), done.table(f"transducer/{name}.spectrum")
    peak = gain["f"][np.argmax(next(values for column, values in gain.items() if column.startswith("Ty")))]
    assert peak == pytest.approx(6.1, abs=0.2)
    assert np.allclose(spectrum["Ty.coupled"].max(), spectrum["Ty.modal"].max(), rtol=0.3)
    assert "Transducer resonance" in (done.folder / "index.html").read_text()


def test_a_run_in_which_both_joints_turn_is_not_studied_and_says_so(archived: Archived) -> None:
    found = archived("AESING00").results["transducer"]
    assert "turns too" in found["reason"]
    assert found["agreement"] == []
