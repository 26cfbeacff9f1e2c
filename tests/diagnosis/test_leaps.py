"""Tooth contact at wrong edges, which no descent leaves, is put where it is."""

from __future__ import annotations

import numpy as np

from diagnosis import bench
from kbs_process.diagnosis.floor import declared
from kbs_process.diagnosis.hypothesis import Hypothesis
from kbs_process.diagnosis.leaps import leap
from kbs_process.diagnosis.metric import metrics
from kbs_process.diagnosis.parameters import known_parameters, prior
from kbs_process.diagnosis.search import Search
from kbs_process.rig.model import substitute

PHASE, WIDTH = "joint.az.drive.phi_stat", "joint.az.drive.delta"


def test_a_leap_finds_the_edges_of_a_contact() -> None:
    truth = bench.rig()
    made = bench.experiment(truth, ("fit",), seed=11)
    own = {name: float(truth.quantities()[name]) for name in (PHASE, WIDTH)}
    wrong = substitute(made.rig, {PHASE: own[PHASE] + 1.0, WIDTH: own[WIDTH] * 1.3})
    free = tuple(s for s in known_parameters(made.rig, made.effects) if s.name.startswith("joint."))
    begin = Hypothesis(wrong, made.effects)
    parameters = prior(wrong, made.rig, made.effects, free)
    simulate = bench.serial(made)
    metric = metrics(made, declared(made), dict(enumerate(simulate([(0, begin)]))), begin)
    search = Search(made, metric, simulate, begin, free, parameters)
    found = search.begin(begin.values(free))
    theta = leap(search, found, smooth=False)
    assert theta is not None
    moved = dict(zip((scalar.name for scalar in free), theta, strict=True))
    turned = float(np.angle(np.exp(1j * (moved[PHASE] - own[PHASE]))))
    wider = moved[WIDTH] - own[WIDTH]
    assert (
        max(abs(turned - wider), abs(turned + wider)) < 0.05
    )  # rad; where the farther was off by more than one
