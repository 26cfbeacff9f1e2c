"""A recorded encoder drives the controller where its samples are the controller's, and only there."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from campaign.campaign_folder import EXAMPLE
from kbs_process.campaign.load import load_campaign
from kbs_process.reduction.predicting import schedule_of
from kbs_process.signals.records import Events

JOINTS = ("az", "el")
T = 0.037 + 0.1 * np.arange(300)


def angle(t: np.ndarray) -> np.ndarray:
    return np.stack([0.01 * t, 1.2 + 0.005 * t], axis=1)


def encoder_of(sampled: np.ndarray) -> np.ndarray | None:
    """What of encoders sampled at these times reaches the controller."""
    rig = load_campaign(EXAMPLE, checksums=False).rig
    command = np.concatenate([angle(T), np.tile([0.01, 0.005], (len(T), 1))], axis=1)
    run = SimpleNamespace(
        name="run",
        command=Events(T, command, (*JOINTS, "az.rate", "el.rate")),
        field=None,
        encoder=Events(sampled, angle(sampled), JOINTS),
    )
    return schedule_of(run, rig).encoder


def test_samples_of_the_cycles_starts_are_fed_however_the_clocks_jitter() -> None:
    jitter = np.random.default_rng(3).uniform(-1e-4, 1e-4, len(T))
    fed = encoder_of(T + jitter)
    assert fed is not None
    np.testing.assert_array_equal(fed, angle(T + jitter))  # none of the cycle before, though half come later
    fine = np.sort(np.concatenate([T + jitter, T + 0.02, T + 0.06]))
    np.testing.assert_array_equal(encoder_of(fine), fed)


def test_a_lost_sample_is_left_open() -> None:
    fed = encoder_of(np.delete(T, [40, 41]))
    assert fed is not None
    assert np.isnan(fed[40:42]).all() and np.isfinite(np.delete(fed, [40, 41], axis=0)).all()


def test_samples_of_other_instants_are_not_fed() -> None:
    assert encoder_of(np.arange(-0.1, 31.0, 0.02)) is None  # 3 ms off each cycle's start, or more
