"""A law that was found first and stood in for one that was found later is taken out again."""

from __future__ import annotations

import bench
import pytest
from test_rounds import FREE, ROLES, screened, standing, with_cable

from kbs_process.diagnosis.experiment import Experiment
from kbs_process.diagnosis.floor import declared
from kbs_process.diagnosis.gate import Gate
from kbs_process.diagnosis.joint import Standing, with_extra, without
from kbs_process.diagnosis.needed import Accepted, needed
from kbs_process.diagnosis.outcome import Find
from kbs_process.diagnosis.tryout import extra_of, identity

LAG, CABLE = ("channel_lag", "Tx"), ("ground_cable", "el")


def joined(made: Experiment, before: Standing, family: tuple[str, str]) -> tuple[Standing, Accepted]:
    tried, scene, found = screened(before)
    chosen = next(one for one in found.candidates if one.suspect.family == family)
    after = with_extra(before, extra_of(chosen, before, tried, scene), bench.serial(made))
    find = Find(
        identity=identity(chosen.suspect),
        named=True,
        equation="",
        reference="",
        estimates=(),
        probability=1.0,
        rho=0.0,
        rho_eff=0.0,
        kappa=0.0,
        gate=Gate(True, (), True, 0.0, (1.0, 1.0), ()),
        alternatives=(),
        ports_alike=(),
        held_out_variance=None,
        curve=None,
    )
    return after, Accepted(find, after.known.names[len(before.known.names) :])


@pytest.fixture(scope="module")
def made() -> Experiment:
    return with_cable(bench.experiment(bench.rig(), ROLES, 3), (0, 1, 2))


def test_without_a_needless_law_nothing_is_lost_and_without_the_right_one_much_is(made: Experiment) -> None:
    simulate = bench.serial(made)
    begun = standing(made)
    first, lag = joined(made, begun, LAG)
    both, cable = joined(made, first, CABLE)
    rest = without(both, lag.names, simulate)
    assert rest.known.names == (*begun.known.names, *cable.names) and not rest.laws
    assert rest.known.cost == pytest.approx(both.known.cost, abs=20.0)
    bare = without(both, cable.names, simulate)
    assert set(bare.laws) == set(lag.names)
    assert bare.known.cost > both.known.cost + 1000.0


def test_the_needless_law_goes_and_the_other_is_judged_without_it(made: Experiment) -> None:
    first, lag = joined(made, standing(made), LAG)
    both, cable = joined(made, first, CABLE)
    kept, left = needed([lag, cable], both, declared(made), bench.serial(made))
    assert [one.find.identity.law for one in kept] == ["ground_cable"]
    assert left.known.names == (*(scalar.name for scalar in FREE), *cable.names)
    assert kept[0].find.gate.folds[0].gain > 500.0
    assert kept[0].find.held_out_variance == pytest.approx(1.0, abs=0.2)


def test_what_was_found_alone_stays_as_it_is(made: Experiment) -> None:
    after, cable = joined(made, standing(made), CABLE)
    kept, left = needed([cable], after, declared(made), bench.serial(made))
    assert kept == [cable] and left is after
