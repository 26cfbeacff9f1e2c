"""Trajectories keep to the limits and do what their names say."""

from __future__ import annotations

import numpy as np
import pytest

from engine import TRAJECTORIES

# deg/s^2, out of the flight's envelope
QUICK = {
    "AZPS_ATA": 0.15, "AZPS_RESTS": 0.4, "AZPS_SHORT": 1.0,
    "AL012M00": 0.25, "ALSTPP00": 0.25, "SWPAZ000": 0.03, "SWPEL000": 0.03
}  # fmt: skip


@pytest.mark.parametrize("name", TRAJECTORIES)
def test_limits_and_consistency(name: str) -> None:
    path = TRAJECTORIES[name]()
    position, rate = np.degrees(path.position), np.degrees(path.rate)
    acceleration = np.diff(rate, axis=0) / 0.1
    assert np.abs(acceleration).max() < QUICK.get(name, 0.015) + 1e-4
    assert np.abs(rate).max() < 2.0 + 1e-4
    # Rates are the positions' own: between two cycles, the mean of two rates where acceleration is steady.
    steady = np.abs(np.diff(acceleration, axis=0, prepend=0.0)) < 1e-4
    mean_rate = (rate[1:] + rate[:-1]) / 2
    np.testing.assert_allclose(np.where(steady, np.diff(position, axis=0) / 0.1 - mean_rate, 0.0), 0.0, atol=2e-3)
    np.testing.assert_array_equal(rate[0], 0.0)
    if "STPP" in name:
        np.testing.assert_allclose(rate[-1], 0.0, atol=1e-6)


def test_el089_is_the_papers() -> None:
    path = TRAJECTORIES["EL089P00"]()
    el, rate = np.degrees(path.position[:, 1]), np.degrees(path.rate[:, 1])
    assert (el[0], el[-1]) == pytest.approx((70.0, 87.0), abs=1e-5)
    assert rate.max() == pytest.approx(0.3, abs=1e-5)
    assert path.t[-1] == pytest.approx(200.0)


def test_calibration_covers_three_elevations_and_azimuth() -> None:
    path = TRAJECTORIES["AZPS_ATA"]()
    az, el = np.degrees(path.position).T
    for elevation, least in ((70.0, 290.0), (78.5, 145.0), (87.0, 145.0)):
        assert np.ptp(az[np.abs(el - elevation) < 0.01]) > least


def test_a_pseudo_static_calibration_rests_at_nine_poses() -> None:
    path = TRAJECTORIES["AZPS_RESTS"]()
    still = np.all(path.rate == 0.0, axis=1)
    assert np.mean(still) > 0.25
    assert len(np.unique(np.round(np.degrees(path.position[still])), axis=0)) == 9
