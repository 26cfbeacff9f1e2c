"""Repeats on one grid."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis import bench
from kbs_process.diagnosis.experiments.experiment import Experiment, Recorded, assemble
from kbs_process.plant.predict import Schedule
from kbs_process.signals.records import Events, Run, Signal

N = 900


def recording(name: str, late: float, trajectory: str = "SWING", n: int = N, turn: float = 0.02) -> Recorded:
    """A swing of elevation seen `late` s later, and a wrench that follows the same clock."""
    t = bench.DT * np.arange(n)
    cycles = np.arange(0.0, n * bench.DT, 0.1) + 0.013 + late  # of the clock of the drive
    swing = 1.2 + 10.0 * turn * np.sin(0.3 * (cycles - late))
    position = np.stack([0.0 * swing, swing], axis=1)
    rate = np.gradient(position, 0.1, axis=0)
    channels = bench.rig().transducer.channels
    wrench = np.stack([np.sin(2.0 * np.pi * (0.5 + k) * (t - late)) for k in range(6)], axis=1)
    valid = np.ones(n, dtype=np.bool_)
    run = Run(
        name=name,
        wrench=Signal(0.0, bench.DT, wrench, channels, ("N",) * 3 + ("N m",) * 3, "T", valid),
        angle=Signal(0.0, bench.DT, np.zeros((n, 2)), ("az", "el"), ("rad", "rad"), "joint", valid),
        rate=None,
        command=Events(cycles, np.hstack([position, rate]), ("az", "el", "az.rate", "el.rate")),
        field=Events(cycles, 100.0 * position, ("az", "el")),
        temperature=None,
        encoder=None,
        spectrum=None,
        envelope=None,
        epoch_ns=0,
        rates={"wrench": 100.0, "angle": 100.0},
    )
    return Recorded("fit", trajectory, run, Schedule(cycles, position, rate, 100.0 * position), None)


def made(*recorded: Recorded) -> Experiment:
    return assemble(recorded, bench.rig(), bench.effects())


def test_repeats_started_by_hand_lie_on_one_grid_and_share_their_drive() -> None:
    experiment = made(recording("a", 0.0), recording("b", 0.37213))
    assert experiment.repeats == ((0, 1),)
    assert len(experiment.drives) == 1
    a, b = experiment.trials
    both = a.valid & b.valid
    assert both.sum() > 0.95 * N - 40
    # up to 5.5 Hz, by interpolation that is exact there
    assert b.measured[both] == pytest.approx(a.measured[both], abs=2e-3)


def test_another_motion_of_the_same_name_is_no_repeat() -> None:
    experiment = made(recording("a", 0.0), recording("b", 0.0, turn=0.01))
    assert experiment.repeats == ((0,), (1,)) or experiment.repeats == ((1,), (0,))
    assert len(experiment.drives) == 2


def test_shorter_repeats_are_missing_where_they_end_and_order_is_kept() -> None:
    experiment = made(recording("short", 0.0, n=N - 200), recording("long", 0.0))
    assert [trial.name for trial in experiment.trials] == ["short", "long"]
    short = experiment.trials[0]
    assert len(short.valid) == N
    assert not short.valid[N - 195 :].any()
    assert not short.measured[N - 195 :].any()


def test_roles_say_what_may_be_fitted() -> None:
    experiment = made(recording("a", 0.0), recording("b", 0.1))
    assert experiment.fit == (0, 1)
    assert experiment.held_out == ()
    assert experiment.channels == (*bench.rig().transducer.channels, "az", "el")
