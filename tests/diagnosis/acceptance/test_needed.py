"""A law that was found first and stood in for one that was found later is taken out again."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis import bench
from diagnosis.selection.test_rounds import ROLES, screened, standing, with_cable
from kbs_process.diagnosis.acceptance import needed as needing
from kbs_process.diagnosis.acceptance.finding import Tried
from kbs_process.diagnosis.acceptance.gate import Gate
from kbs_process.diagnosis.acceptance.needed import Accepted, in_the_shade, needed
from kbs_process.diagnosis.acceptance.outcome import Find
from kbs_process.diagnosis.experiments.experiment import Experiment
from kbs_process.diagnosis.experiments.floor import declared
from kbs_process.diagnosis.experiments.thresholds import CLEAR, GATE_SIGMA, STAYS_SIGMA
from kbs_process.diagnosis.nominal.joint import Own, Standing, with_extra, without
from kbs_process.diagnosis.nominal.known import Known
from kbs_process.diagnosis.proposing.tryout import extra_of, identity
from kbs_process.diagnosis.selection.race import own_of
from kbs_process.plant.laws import CATALOGUE

pytestmark = pytest.mark.validation

LAG, CABLE, HARNESS = ("channel_lag", "Tx"), ("ground_cable", "el"), ("harness", "el")
HARNESS_EFFECT = next(one for one in CATALOGUE if one.name == "harness")


def joined(made: Experiment, before: Standing, family: tuple[str, str]) -> tuple[Standing, Accepted]:
    bench_, scene, found = screened(before)
    chosen = next(one for one in found.candidates if one.suspect.family == family)
    after = with_extra(before, extra_of(chosen, before, bench_, scene), bench.serial(made))
    passed = Gate(True, (), True, 0.0, (1.0, 1.0), ())
    find = Find(
        identity=identity(chosen.suspect),
        named=True,
        equation="",
        reference="",
        estimates=(),
        probability=1.0,
        rho_eff=0.0,
        kappa=0.0,
        gate=passed,
        alternatives=(),
        ports_alike=(),
        held_out_variance=None,
        curve=None,
    )
    return after, Accepted(Tried(chosen, after, passed, found, own_of(chosen, before, after)), find, before)


def at_floor(known: Known) -> Known:
    """The same with residuals as if nothing were left."""
    return replace(known, residual=tuple(z * np.sqrt(len(z)) / np.linalg.norm(z) for z in known.residual))


@pytest.fixture(scope="module")
def made() -> Experiment:
    return with_cable(bench.experiment(bench.rig(), ROLES, 3), (0, 1, 2))


def test_without_a_needless_law_nothing_is_lost_and_without_the_right_one_much_is(made: Experiment) -> None:
    simulate = bench.serial(made)
    begun = standing(made)
    first, lag = joined(made, begun, LAG)
    both, cable = joined(made, first, CABLE)
    rest = without(both, lag.tried.own, simulate)
    assert rest.known.names == (*begun.known.names, *cable.tried.own.names) and not rest.laws
    assert rest.known.cost == pytest.approx(both.known.cost, abs=20.0)
    bare = without(both, cable.tried.own, simulate)
    assert set(bare.laws) == set(lag.tried.own.names)
    assert bare.known.cost > both.known.cost + 1000.0


@pytest.mark.parametrize("family", [LAG, HARNESS])
def test_the_needless_law_goes_and_the_other_is_judged_without_it(made: Experiment, family: tuple[str, str]) -> None:
    begun = standing(made)
    first, needless = joined(made, begun, family)
    both, cable = joined(made, first, CABLE)
    kept, left, fallen = needed([needless, cable], both, declared(made), bench.serial(made))
    assert [one.identity for one in fallen] == [needless.find.identity] and fallen[0].reasons
    assert [one.find.identity.law for one in kept] == ["ground_cable"]
    assert left.known.names == (*begun.known.names, *cable.tried.own.names)
    assert kept[0].find.gate.folds[0].gain > 500.0
    assert kept[0].find.held_out_variance == pytest.approx(1.0, abs=0.2)
    # nothing of it stays in the plant, of which the corrected model is made
    assert set(left.hypothesis.effects) == {*made.effects, "ground_cable"}
    of_harness = {entry.name for entry in HARNESS_EFFECT.parameters}
    assert not any(name.rpartition(".")[2] in of_harness for name in left.hypothesis.rig.quantities())


def test_what_was_found_alone_stays_as_it_is(made: Experiment) -> None:
    after, cable = joined(made, standing(made), CABLE)
    settled = replace(cable, before=replace(cable.before, known=at_floor(cable.before.known)))
    kept, left, fallen = needed([settled], after, declared(made), bench.serial(made))
    assert kept == [settled] and left is after and fallen == ()


def test_what_was_found_before_known_numbers_could_settle_is_judged_again(made: Experiment) -> None:
    after, cable = joined(made, standing(made), CABLE)
    assert cable.before.known.gross
    kept, left, fallen = needed([cable], after, declared(made), bench.serial(made))
    (one,) = kept
    assert left is after and fallen == ()
    assert one.find.identity == cable.find.identity and one.find.gate.passed
    assert one.find.gate.folds and not cable.find.gate.folds


def test_what_recordings_that_were_not_used_do_not_show_falls_when_no_more_is_found(made: Experiment) -> None:
    plain = bench.experiment(bench.rig(), ROLES, 3)
    fitted = with_cable(plain, (0, 1))
    other = np.sin(0.9 * bench.DT * np.arange(len(plain.trials[2].measured)))
    shown = fitted.trials[2].measured.copy()
    shown[:, 5] += 0.05 * other * fitted.trials[2].valid
    experiment = replace(fitted, trials=(*fitted.trials[:2], replace(fitted.trials[2], measured=shown)))
    begun = standing(experiment)
    after, cable = joined(experiment, begun, CABLE)
    kept, left, fallen = needed([cable], after, declared(made), bench.serial(made))
    assert kept == [] and left.known.names == begun.known.names
    (one,) = fallen
    assert one.identity == cable.find.identity
    assert any("of the excess of r2" in reason for reason in one.reasons)


def test_finds_of_one_law_at_one_place_stand_or_fall_together(made: Experiment) -> None:
    first, lag = joined(made, standing(made), LAG)
    second, again = joined(made, first, LAG)
    both, cable = joined(made, second, CABLE)
    kept, left, fallen = needed([lag, again, cable], both, declared(made), bench.serial(made))
    assert [one.identity for one in fallen] == [lag.find.identity]
    assert [one.find.identity.law for one in kept] == ["ground_cable"]
    assert not left.laws


def test_what_is_small_beside_a_find_at_the_same_place_may_be_its_formula(made: Experiment) -> None:
    begun = standing(made)
    _, cable = joined(made, begun, CABLE)
    _, lag = joined(made, begun, LAG)
    size = cable.tried.found.score.rho_eff

    def earlier(one: Accepted, rho_eff: float) -> Accepted:
        return replace(one, find=replace(one.find, rho_eff=rho_eff))

    assert in_the_shade(cable.tried.found, [earlier(cable, 10.0 * size)]) == ()
    (reason,) = in_the_shade(cable.tried.found, [earlier(lag, 100.0 * size), earlier(cable, 100.0 * size)])
    assert "1.0 %" in reason
    # At another place it is a law of its own, however small.
    assert in_the_shade(cable.tried.found, [earlier(lag, 100.0 * size)]) == ()


def test_a_small_gain_that_numbers_alone_could_have_had_is_no_find() -> None:
    """The law came with a better minimum of the known numbers than the one that it is compared with."""
    plain = bench.experiment(bench.rig(), ROLES, 3)
    begun = standing(plain)
    after, cable = joined(plain, begun, CABLE)
    share = 0.6 * CLEAR
    worse = replace(
        begun.known, residual=tuple(z * np.sqrt(1.0 + share * len(z) / (z @ z)) for z in begun.known.residual)
    )
    rows = float(worse.rows[list(plain.fit)].sum())
    assert not worse.gross and 0.0 < worse.cost - after.known.cost < CLEAR * rows
    before = replace(cable.before, known=worse)
    kept, left, fallen = needed([replace(cable, before=before)], after, declared(plain), bench.serial(plain))
    assert kept == [] and left.known.names == begun.known.names
    assert fallen[0].identity == cable.find.identity


def test_a_law_with_the_right_one_between_its_parts_has_not_gained_what_that_did(made: Experiment) -> None:
    begun = standing(made)
    first, lag = joined(made, begun, LAG)
    both, cable = joined(made, first, CABLE)
    clear = tuple(z * np.sqrt(1.5 * len(z) / (z @ z)) for z in begun.known.residual)
    before = replace(lag.before, known=replace(begun.known, residual=clear))
    assert not before.known.gross and before.known.cost - both.known.cost > CLEAR * before.known.fit_rows
    part = replace(lag, before=before)
    more = replace(part, tried=replace(part.tried, own=Own((), ())))
    kept, _, fallen = needed([part, cable, more], both, declared(made), bench.serial(made))
    assert {one.identity for one in fallen} == {lag.find.identity}
    assert [one.find.identity.law for one in kept] == ["ground_cable"]


def test_a_law_that_does_what_no_other_does_stays_whatever_recordings_that_it_does_little_in_say(
    made: Experiment, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun = standing(made)
    first, lag = joined(made, begun, LAG)
    both, cable = joined(made, first, CABLE)
    asked: list[float] = []

    def refuses(*_: object, least: float) -> Gate:
        asked.append(least)
        return Gate(False, (), True, 0.0, (1.0, 1.0), ("r2 predicted worse",))

    monkeypatch.setattr(needing, "gated", refuses)
    simulate = bench.serial(made)
    _, _, fallen = needed([cable, lag], both, declared(made), simulate)
    assert fallen[0].identity == lag.find.identity
    assert set(asked) == {STAYS_SIGMA} and STAYS_SIGMA < GATE_SIGMA
    rest = without(both, cable.tried.own, simulate)
    assert needing._vital(rest.known, both.known)
    assert not needing._vital(both.known, both.known)
    told, reasons = needing._again([cable], cable.tried.own, rest, both, declared(made), simulate, alone=True)
    assert "r2 predicted worse" in reasons
    told, reasons = needing._again([cable], cable.tried.own, rest, both, declared(made), simulate, alone=False)
    assert "r2 predicted worse" not in reasons and told[0].find.identity == cable.find.identity
