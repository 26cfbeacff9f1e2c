"""What is gained only while an earlier law acts is no second law; what is gained at any time may be."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis import bench
from diagnosis.proposing.test_local_law import ANGLE, TORQUE, WIDTH, with_bump
from kbs_process.diagnosis.acceptance.remains import most_of, only_while
from kbs_process.diagnosis.experiments.thresholds import MOSTLY
from kbs_process.diagnosis.nominal.joint import Own, Standing, bare, with_extra
from kbs_process.diagnosis.proposing.tryout import extra_of
from kbs_process.diagnosis.screening.scene import Scene
from kbs_process.diagnosis.screening.screen import Bench, Catalogued, screen
from kbs_process.diagnosis.screening.suspects import Candidate
from kbs_process.plant.laws.position.bell import LOCAL_TORQUE
from kbs_process.signals.records import Array

pytestmark = pytest.mark.slow

Changes = tuple[Array, ...]


@pytest.fixture(scope="module")
def found() -> tuple[Standing, Own, Changes]:
    """A standing with its bump, the bump's numbers, and what the bump does for each whitened residual."""
    here = with_bump()
    scene = Scene.of(here.known.experiment, here.hypothesis, here.predicted)
    tried = Bench.of(here.known, scene)
    bump = Catalogued(Candidate(LOCAL_TORQUE, "el", (("local_angle", ANGLE), ("local_width", WIDTH))), scene)
    best = screen(tried, [bump]).candidates[0]
    simulate = bench.serial(here.known.experiment)
    after = with_extra(here, extra_of(best, here, tried, scene), simulate)
    assert after.known.value[-3] == pytest.approx(TORQUE, rel=0.05)
    own = Own(after.known.names[-3:], after.known.names[-3:-2])
    out = bare(after, own, simulate).known
    change = tuple(a - b for a, b in zip(out.residual, after.known.residual, strict=True))
    return after, own, change


def beside(standing: Standing, lacks: Changes) -> tuple[Standing, Standing]:
    """A standing that lacks something of its residuals, and the same with it."""
    known = standing.known
    residual = tuple(z + d for z, d in zip(known.residual, lacks, strict=True))
    return replace(standing, known=replace(known, residual=residual)), standing


def test_what_a_bump_s_formula_lacks_is_gained_while_it_acts(found: tuple[Standing, Own, Changes]) -> None:
    standing, own, change = found
    simulate = bench.serial(standing.known.experiment)
    before, after = beside(standing, tuple(0.2 * d for d in change))
    reasons = only_while([("bump", own)], before, after.known, simulate)
    print(reasons)
    assert len(reasons) == 1 and "while bump acts" in reasons[0]
    assert only_while([], before, after.known, simulate) == ()


def test_what_is_missed_at_any_time_is_not_the_bump_s(found: tuple[Standing, Own, Changes]) -> None:
    standing, own, change = found
    rng = np.random.default_rng(3)
    size = 0.1 * np.sqrt(np.mean([d @ d / len(d) for d in change]))
    before, after = beside(standing, tuple(size * rng.standard_normal(len(d)) for d in change))
    simulate = bench.serial(standing.known.experiment)
    lost = sum(float(one @ one) for one in before.known.residual)
    assert lost > sum(float(one @ one) for one in after.known.residual)  # there is something to gain
    assert only_while([("bump", own)], before, after.known, simulate) == ()


def test_most_of_the_power_is_in_the_fewest_samples_that_hold_it() -> None:
    power = [np.array([28.0, 0.0, 1.0]), np.array([70.0, 0.5, 0.5])]
    masks, share = most_of(power)
    assert [mask.tolist() for mask in masks] == [[True, False, False], [True, False, False]]
    assert share == pytest.approx(2.0 / 6.0)
    assert sum(p[m].sum() for p, m in zip(power, masks, strict=True)) >= MOSTLY * 100.0


def test_a_law_that_has_come_to_nothing_stays_where_its_numbers_are_fitted(
    found: tuple[Standing, Own, Changes],
) -> None:
    """One more is taken out beside it: what its numbers are of has to be there."""
    standing, own, _ = found
    known = standing.known
    value = np.where([name in own.amplitudes for name in known.names], 0.0, known.value)
    nothing = replace(known, value=value, hypothesis=known.hypothesis.at(known.free, value), shown={})
    other = Own(known.names[:1], ())
    left = bare(replace(standing, known=nothing), other, bench.serial(known.experiment)).known
    assert left.names == known.names[1:]
    assert "local_torque" in left.hypothesis.effects
    gone = bare(replace(standing, known=nothing), own, bench.serial(known.experiment)).known
    assert "local_torque" not in gone.hypothesis.effects
