"""Tooth contact at wrong edges, which no descent leaves, is put where it is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis import bench
from kbs_process.diagnosis.experiments.floor import declared
from kbs_process.diagnosis.experiments.hypothesis import Hypothesis
from kbs_process.diagnosis.experiments.metric import metrics
from kbs_process.diagnosis.nominal import leaps
from kbs_process.diagnosis.nominal.costs import GEARS, Found
from kbs_process.diagnosis.nominal.leaps import stride
from kbs_process.diagnosis.nominal.parameters import known_parameters, prior
from kbs_process.diagnosis.nominal.search import Search
from kbs_process.rig.model import substitute
from kbs_process.signals.records import Array

pytestmark = pytest.mark.slow

PHASE, WIDTH, TORQUE = "joint.az.drive.phi_stat", "joint.az.drive.delta", "joint.az.drive.Ts0"


def searching(wrong: dict[str, float]) -> tuple[Search, Found, dict[str, float]]:
    """A search for the drives' numbers that begins with some of them wrong: by what, or times what (torques)."""
    truth = bench.rig()
    made = bench.experiment(truth, ("fit",), seed=11)
    own = {name: float(truth.quantities()[name]) for name in (PHASE, WIDTH, TORQUE)}
    rig = substitute(made.rig, {name: own[name] + by for name, by in wrong.items()})
    free = tuple(s for s in known_parameters(made.rig, made.effects) if s.name.startswith("joint."))
    begin = Hypothesis(rig, made.effects)
    parameters = prior(rig, made.rig, made.effects, free)
    simulate = bench.serial(made)
    metric = metrics(made, declared(made), dict(enumerate(simulate([(0, begin)]))), begin)
    search = Search(made, metric, simulate, begin, free, parameters)
    return search, search.begin(begin.values(free)), own


def farther_edge(search: Search, theta: Array, own: dict[str, float]) -> float:
    """By how much the farther of the contact's edges is off, rad."""
    moved = dict(zip((scalar.name for scalar in search.free), theta, strict=True))
    turned = float(np.angle(np.exp(1j * (moved[PHASE] - own[PHASE]))))
    return abs(turned) + abs(moved[WIDTH] - own[WIDTH])


def test_edges_of_a_contact_are_found() -> None:
    width = float(bench.rig().quantities()[WIDTH])
    search, found, own = searching({PHASE: 1.0, WIDTH: 0.3 * width})
    moved = search.leapt(found, smooth=False)
    assert moved is not None
    settled = search.descend(moved)
    # Where the farther was off by more than one; twelve seconds do not tell edges apart that are nearer.
    assert farther_edge(search, settled.theta, own) < 0.2
    right, there, _ = searching({})
    assert sum(search.cost(settled.theta, settled.predicted)) < sum(right.cost(there.theta, there.predicted))


def test_a_stride_finds_a_contact_that_has_vanished_elsewhere() -> None:
    """Most of its torque gone, other numbers have settled without it."""
    torque = float(bench.rig().quantities()[TORQUE])
    search, found, own = searching({PHASE: 2.0, TORQUE: -0.97 * torque})
    stuck = search.descend(found)
    assert farther_edge(search, stuck.theta, own) > 1.0
    reached = stride(search, stuck, 2, GEARS)
    assert reached is not None
    settled = search.descend(reached)
    assert farther_edge(search, settled.theta, own) < 0.05
    assert sum(search.cost(settled.theta, settled.predicted)) < sum(search.cost(stuck.theta, stuck.predicted))


def test_a_stride_does_not_descend_from_a_place_that_is_worse_by_far(monkeypatch: pytest.MonkeyPatch) -> None:
    torque = float(bench.rig().quantities()[TORQUE])
    search, found, _ = searching({PHASE: 2.0, TORQUE: -0.97 * torque})
    stuck = search.descend(found)
    monkeypatch.setattr(leaps, "_FAR", 0.0)
    monkeypatch.setattr(search, "descend", lambda *_, **__: pytest.fail("it descended"))
    assert stride(search, stuck, 2, GEARS) is None


def test_no_stride_leaves_the_right_place() -> None:
    search, found, _ = searching({})
    assert stride(search, found, 2, GEARS) is None


def test_numbers_that_nothing_shows_do_not_end_the_search() -> None:
    """As a law's reach, while its amplitude is zero: all its slopes are."""
    search, found, _ = searching({PHASE: 1.0})
    search.precision[0] = 0.0
    none = {
        drive: replace(one, columns=one.columns * (np.arange(len(search.free)) > 0)[:, None, None])
        for drive, one in found.gradients.items()
    }
    moved = search.leapt(replace(found, gradients=none), smooth=False)
    assert moved is not None and np.isfinite(moved.theta).all()
