"""How well it is known when angles and wrench belong together."""

import numpy as np
import pytest

from kbs_process.rig.model import Amplifier, Quantity
from kbs_process.signals.records import Clock
from kbs_process.stages.align.clocks import UNKNOWN_OFFSET_S, late_sigma, offset_sigma


def test_an_amplifier_whose_corner_is_not_known_delays_by_what_is_not_known():
    clock = Clock(0.0, 0.0, 3e-4, 0.0, 4e-4, "fitted")
    corner = Quantity("corner", np.array(20.0), "Hz", np.array(2.0), "data sheet")
    clocks = {"angle": clock}
    assert late_sigma(clocks, None) == pytest.approx(5e-4)
    assert late_sigma(clocks, None, 1.2e-3) == pytest.approx(1.3e-3)
    # Second-order Butterworth: sqrt(2) / (2 pi 20 Hz) = 11.25 ms, a tenth of it unknown.
    assert late_sigma(clocks, Amplifier(2, corner)) == pytest.approx(np.hypot(5e-4, 1.125e-3), rel=1e-3)


def test_clocks_that_cannot_be_compared_are_not_taken_for_exact():
    apart = Clock(0.0, 0.0, np.nan, np.nan, np.nan, "not comparable")
    assert late_sigma({"rate": apart}, None) == offset_sigma(apart) == UNKNOWN_OFFSET_S > 0.0
