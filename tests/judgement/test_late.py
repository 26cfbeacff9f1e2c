"""How well it is known when angles and wrench belong together."""

from types import SimpleNamespace

import numpy as np
import pytest

from kbs_process.campaign.uncertainty import _late_sigma
from kbs_process.rig.model import Amplifier, Quantity
from kbs_process.signals.records import Clock


def test_an_amplifier_whose_corner_is_not_known_delays_by_what_is_not_known():
    clock = Clock(0.0, 0.0, 3e-4, 0.0, 4e-4, "fitted")
    analysis = SimpleNamespace(run=SimpleNamespace(clocks={"angle": clock}))
    corner = Quantity("corner", np.array(20.0), "Hz", np.array(2.0), "data sheet")
    assert _late_sigma(analysis, None) == pytest.approx(5e-4)
    # Second-order Butterworth: sqrt(2) / (2 pi 20 Hz) = 11.25 ms, a tenth of it unknown.
    assert _late_sigma(analysis, Amplifier(2, corner)) == pytest.approx(np.hypot(5e-4, 1.125e-3), rel=1e-3)
    apart = Clock(0.0, 0.0, np.nan, 0.0, np.nan, "not comparable")
    unknown = SimpleNamespace(run=SimpleNamespace(clocks={"angle": apart}))
    assert _late_sigma(unknown, Amplifier(2, corner)) == pytest.approx(1.125e-3, rel=1e-3)
