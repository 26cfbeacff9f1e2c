"""Recordings in which a law does nothing say nothing of it."""

from __future__ import annotations

from dataclasses import replace

import pytest

from diagnosis import bench
from diagnosis.acceptance.test_needed import CABLE, joined
from diagnosis.selection.test_rounds import ROLES, standing, with_cable
from kbs_process.diagnosis.acceptance.gate import gate
from kbs_process.diagnosis.acceptance.remains import blind, missed
from kbs_process.diagnosis.experiments.experiment import Experiment
from kbs_process.diagnosis.experiments.thresholds import LEAST_RHO
from kbs_process.diagnosis.nominal.joint import Own, Standing
from kbs_process.diagnosis.nominal.known import Known

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def made() -> Experiment:
    return with_cable(bench.experiment(bench.rig(), ROLES, 3), (0, 1, 2))


@pytest.fixture(scope="module")
def found(made: Experiment) -> tuple[Standing, Standing, Own]:
    begun = standing(made)
    after, cable = joined(made, begun, CABLE)
    return begun, after, cable.tried.own


def louder(known: Known, k: int, times: float) -> Known:
    """The same with a recording predicted worse, its residual being larger by a factor."""
    left = tuple(times * z if i == k else z for i, z in enumerate(known.residual))
    return replace(known, residual=left)


def test_a_recording_is_blind_where_a_law_cannot_be_seen(
    made: Experiment, found: tuple[Standing, Standing, Own]
) -> None:
    _, after, own = found
    simulate = bench.serial(made)
    assert blind(after, own, simulate) == frozenset()
    known = after.known
    places = [known.names.index(name) for name in own.amplitudes]
    for share, seen in ((1.0, True), (1e-3, False)):
        value = known.value.copy()
        value[places] *= share
        weak = replace(known, value=value, hypothesis=known.hypothesis.at(known.free, value))
        shown = {k: bench.serial(made)([(k, weak.hypothesis)])[0] for k in {one.drive for one in made.trials}}
        left = tuple(known.metric[k](one.measured - shown[one.drive].values) for k, one in enumerate(made.trials))
        weak = replace(weak, shown=shown, residual=left)
        told = blind(Standing(weak, shown, {}), own, simulate)
        assert (2 not in told) == seen, LEAST_RHO


def test_recordings_in_which_it_does_nothing_do_not_refuse_a_law(found: tuple[Standing, Standing, Own]) -> None:
    before, after, own = found
    places = [after.known.names.index(name) for name in own.amplitudes]
    worse = louder(after.known, 2, 30.0)
    asked: list[int] = []

    def nothing_there() -> frozenset[int]:
        asked.append(1)
        return frozenset({2})

    passed = gate(before.known, after.known, places, blind=nothing_there)
    assert not any("worse" in one for one in passed.reasons) and asked == []
    assert any("r2 predicted worse" in one for one in gate(before.known, worse, places).reasons)
    told = gate(before.known, worse, places, blind=nothing_there).reasons
    assert asked == [1] and not any("worse" in one for one in told)
    assert any("no recording that was not used could show it" in one for one in told)
    assert missed(before.known, worse) and not missed(before.known, worse, {2})
