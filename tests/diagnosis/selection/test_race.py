"""Leaders in the plant: the right law comes first, and none is worse off for following; a name goes before a curve."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis import bench
from diagnosis.selection.test_rounds import ROLES, standing, with_cable
from kbs_process.diagnosis.acceptance.finding import Tried
from kbs_process.diagnosis.acceptance.gate import Gate
from kbs_process.diagnosis.acceptance.verdict import gated
from kbs_process.diagnosis.experiments.floor import declared
from kbs_process.diagnosis.experiments.hypothesis import Simulate
from kbs_process.diagnosis.experiments.thresholds import FIRST, MOSTLY_DONE, TOLERATED, WAYS
from kbs_process.diagnosis.nominal.joint import Own, Standing, with_extra
from kbs_process.diagnosis.proposing.tryout import extra_of, identity
from kbs_process.diagnosis.proposing.view import View
from kbs_process.diagnosis.screening.screen import Found
from kbs_process.diagnosis.selection import believed as believing
from kbs_process.diagnosis.selection import leaders as leading
from kbs_process.diagnosis.selection import race
from kbs_process.diagnosis.selection.believed import contested, continued, inherited, named_first, named_there
from kbs_process.diagnosis.selection.effort import Effort
from kbs_process.diagnosis.selection.leaders import leaders, tried, various
from kbs_process.diagnosis.selection.race import Runner, raced

pytestmark = pytest.mark.slow

RIGHT, WRONG, CURVE = ("ground_cable", "el"), ("harness", "el"), ("ground_angle_law", "el")
KIN = ("tether", "el")  # of the right one's family and place


@pytest.fixture(scope="module")
def view() -> View:
    made = with_cable(bench.experiment(bench.rig(), ROLES, 3), (0, 1, 2))
    return View.of(standing(made), lambda one: one.family in (RIGHT, WRONG, CURVE, KIN))


@pytest.fixture(scope="module")
def by_family(view: View) -> dict[tuple[str, str], Found]:
    return {one.suspect.family: one for one in view.screening.candidates}


def test_one_place_or_family_does_not_crowd_others_out(by_family: dict[tuple[str, str], Found]) -> None:
    order = [by_family[one] for one in (RIGHT, KIN, CURVE, WRONG)]
    assert [one.suspect.family for one in various(order)] == [RIGHT, WRONG, CURVE, KIN]
    assert various(order[:1]) == order[:1]


def test_the_right_law_comes_first_and_who_follows_gets_no_less_far(
    view: View, by_family: dict[tuple[str, str], Found]
) -> None:
    made = view.standing.known.experiment
    simulate = Effort(bench.serial(made), view.standing.known)
    chosen = [by_family[WRONG], by_family[RIGHT]]
    runners = raced(chosen, view, declared(made), simulate)
    assert [one.found.suspect.family for one in runners] == [RIGHT, WRONG]
    assert runners[0].cost < runners[1].cost
    for one in runners:
        extra = extra_of(one.found, view.standing, view.bench, view.scene)
        assert one.cost <= with_extra(view.standing, extra, simulate, FIRST).known.cost


@pytest.mark.parametrize(("better", "names"), [(0.5, [RIGHT]), (2.0, [RIGHT, CURVE])])
def test_a_law_keeps_its_name_beside_a_curve_that_does_a_little_more(
    view: View, by_family: dict[tuple[str, str], Found], better: float, names: list[tuple[str, str]]
) -> None:
    """A curve at the same place that leaves less, in units of what the plant is exact to."""
    known = view.standing.known
    left = [float(known.rows[k]) for k in range(len(known.rows))]
    share = 1.0 - better * TOLERATED * sum(left[k] for k in known.experiment.fit) / known.cost
    less = replace(known, residual=tuple(np.sqrt(share) * z for z in known.residual))
    passed = Gate(True, (), True, 0.0, (1.0, 1.0), ())

    def tried(family: tuple[str, str], with_known: object) -> Tried:
        told = replace(view.standing, known=with_known)
        return Tried(by_family[family], told, passed, view.screening, Own((), ()))

    law, curve = tried(RIGHT, known), tried(CURVE, less)
    assert identity(law.found.suspect).place.port == identity(curve.found.suspect).place.port
    assert [one.found.suspect.family for one in named_first([curve, law])] == names[::-1]
    # Where the curve alone passed, laws whose place it took are tried, too, but for those that were.
    assert [one.suspect.family for one in named_there([curve], [], view)] == [RIGHT, KIN]
    assert [one.suspect.family for one in named_there([curve], [identity(law.found.suspect)], view)] == [KIN]
    assert named_there([law], [], view) == []
    # One more action of a law that was found goes before another law likewise.
    found = [identity(law.found.suspect)]
    assert continued([curve, law], found) == ([law] if better < 1.0 else [curve, law])
    assert continued([curve, law], []) == [curve, law]


def told(view: View, found: Found, share: float, strained: bool = False) -> Tried:
    """A law that passed, whose residuals have `share` of the standing's power, one number nine sigmas off or none."""
    known = view.standing.known
    less = replace(known, residual=tuple(np.sqrt(share) * z for z in known.residual))
    if strained:
        value = known.value.copy()
        index = known.names.index("joint.el.drive.Ka")
        value[index] += 9.0 * known.parameters.sigma[index]
        less = replace(less, value=value)
    passed = Gate(True, (), True, 0.0, (1.0, 1.0), ())
    return Tried(found, replace(view.standing, known=less), passed, view.screening, Own(("k",), ("k",)))


def test_a_law_that_took_a_curves_name_has_the_curves_chance_against_laws_of_other_places(
    view: View, by_family: dict[tuple[str, str], Found]
) -> None:
    law, curve = told(view, by_family[RIGHT], 0.990), told(view, by_family[CURVE], 0.980)
    other = told(view, by_family[WRONG], 0.985)
    assert inherited([law, other], [law, other], 1000).argmax() == 1
    assert inherited([law, other], [curve, law, other], 1000).argmax() == 0
    assert inherited([law], [law], 1000) == pytest.approx([1.0])


@pytest.mark.parametrize(("second", "eased"), [(WRONG, 2), (KIN, 0)])
def test_numbers_are_let_go_again_beside_laws_of_several_places_that_leave_as_little(
    view: View,
    by_family: dict[tuple[str, str], Found],
    monkeypatch: pytest.MonkeyPatch,
    second: tuple[str, str],
    eased: int,
) -> None:
    seen: list[Standing] = []

    def released(standing: Standing, floor: object, simulate: Simulate) -> Standing:
        seen.append(standing)
        return view.standing

    monkeypatch.setattr(believing, "released", released)
    made = view.standing.known.experiment
    passed = [told(view, by_family[RIGHT], 0.98, strained=True), told(view, by_family[second], 0.98, strained=True)]
    after = contested(passed, declared(made), bench.serial(made))
    assert len(seen) == eased and [one.found for one in after] == [one.found for one in passed]
    assert all((one.standing is view.standing) == bool(eased) for one in after)
    far = told(view, by_family[WRONG], 2.0)
    assert contested([passed[0], far], declared(made), bench.serial(made)) == [passed[0], far]


def test_a_law_with_a_name_is_not_told_anew_as_a_curve(
    view: View, by_family: dict[tuple[str, str], Found], monkeypatch: pytest.MonkeyPatch
) -> None:
    made = view.standing.known.experiment
    floor, simulate = declared(made), bench.serial(made)
    law = told(view, by_family[RIGHT], 0.98)
    monkeypatch.setattr(leading, "bare", lambda standing, own, simulate: standing)
    monkeypatch.setattr(
        View, "of", lambda *_, **__: replace(view, screening=replace(view.screening, candidates=(by_family[CURVE],)))
    )
    assert leading._told_anew(law, view.standing, floor, simulate) is law


def test_a_plant_that_diverged_comes_last(view: View, by_family: dict[tuple[str, str], Found]) -> None:
    known = replace(view.standing.known, residual=tuple(np.nan * z for z in view.standing.known.residual))
    assert Runner(by_family[RIGHT], replace(view.standing, known=known)).cost == np.inf


@pytest.mark.parametrize(("sigmas", "share", "drawn"), [(9.0, 0.1, 1), (0.0, 0.1, 0), (9.0, 0.9, 0)])
def test_pulled_numbers_are_drawn_back_beside_a_promising_law_that_does_little(
    view: View,
    by_family: dict[tuple[str, str], Found],
    monkeypatch: pytest.MonkeyPatch,
    sigmas: float,
    share: float,
    drawn: int,
) -> None:
    """Of what the screen promised, `share` is done, beside numbers of which one is `sigmas` off."""
    standing = view.standing
    value = standing.known.value.copy()
    index = standing.known.names.index("joint.el.drive.Ka")
    value[index] += sigmas * standing.known.parameters.sigma[index]
    pulled = replace(standing, known=replace(standing.known, value=value))
    simulate = Effort(bench.serial(pulled.known.experiment), pulled.known)
    extra = extra_of(by_family[RIGHT], standing, view.bench, view.scene)
    done = pulled.known.cost - with_extra(pulled, extra, simulate, FIRST).known.cost
    chosen = replace(by_family[RIGHT], score=replace(by_family[RIGHT].score, gain=done / share))
    seen = []
    monkeypatch.setattr(race, "released", lambda standing, *_: seen.append(standing) or standing)
    raced([chosen], replace(view, standing=pulled), declared(standing.known.experiment), simulate)
    assert len(seen) == drawn


@pytest.mark.parametrize(("left", "first"), [(1.1, [RIGHT]), (3.0, [RIGHT, WRONG, CURVE, KIN])])
def test_where_much_is_left_all_are_raced_unless_one_does_nearly_all(
    view: View, left: float, first: list[tuple[str, str]]
) -> None:
    """In either case none is out of reach: those that do not run at once come one after the other."""
    best = view.able[0]
    assert best.suspect.family == RIGHT
    known = view.standing.known
    # As many numbers of noise as make what is left gross, and the best do a share of it.
    excess = left * best.score.gain
    level = excess / known.fit_rows + 1.0
    residual = tuple(np.sqrt(level * n / (z @ z)) * z for n, z in zip(known.rows, known.residual, strict=True))
    here = replace(view.standing, known=replace(known, residual=residual))
    assert here.known.excess == pytest.approx(excess, rel=1e-6)
    seen = replace(view, standing=here)
    assert here.known.gross
    ahead, others = leaders(seen, bench.serial(here.known.experiment))
    assert [one.suspect.family for one in ahead][: len(first)] == first[: len(ahead)]
    assert (len(ahead) < len(view.able)) == (left < 1.0 / MOSTLY_DONE)
    assert {one.suspect.family for one in (*ahead, *others)} == {one.suspect.family for one in view.able}


@pytest.mark.parametrize("once", [True, False])
def test_a_law_that_leaves_nothing_is_judged_once_others_have_settled_beside_it(
    view: View, by_family: dict[tuple[str, str], Found], monkeypatch: pytest.MonkeyPatch, once: bool
) -> None:
    """Refused `once` where its first steps ended, or wherever others settle."""
    made = view.standing.known.experiment
    simulate = Effort(bench.serial(made), view.standing.known)
    costs = list[float]()

    def strict(found: Found, before: Standing, after: Standing, own: Own, simulate: Simulate) -> Gate:
        costs.append(after.known.cost)
        verdict = gated(found, before, after, own, simulate)
        return verdict.but("too early") if len(costs) == 1 or not once else verdict

    monkeypatch.setattr(leading, "gated", strict)
    passed, refused = tried([by_family[RIGHT]], view, view.standing, declared(made), simulate)
    assert len(costs) == 2
    assert costs[1] <= costs[0]
    if once:
        assert passed[0].leapt
        assert passed[0].standing.known.cost == costs[1]
    else:
        assert passed == []
        assert refused[0].gate.reasons[-1] == "too early"


@pytest.mark.parametrize(("nothing_left", "goes_on", "ways"), [(False, True, WAYS), (True, True, 0), (False, False, 0)])
def test_the_next_law_looks_for_phases_too_while_something_is_left(
    view: View, monkeypatch: pytest.MonkeyPatch, nothing_left: bool, goes_on: bool, ways: int
) -> None:
    """A wrong law that leads would show all others a wrong way; a search that has cost too much looks no more."""
    made = view.standing.known.experiment
    looked: list[float] = []

    def unmoved(standing: Standing, _: object, *, leaps: bool) -> Standing:
        assert leaps
        looked.append(standing.known.cost)
        return standing

    monkeypatch.setattr(race, "moved_on", unmoved)
    monkeypatch.setattr(race, "at_floor", lambda *_: nothing_left)
    monkeypatch.setattr(race, "_near", lambda *_: True)
    simulate = Effort(bench.serial(made), view.standing.known)
    monkeypatch.setattr(simulate, "goes_on", lambda: goes_on)
    runners = race.raced(view.able[:3], view, declared(made), simulate)
    assert len(runners) == 3
    assert len(looked) == ways == sum(one.leapt for one in runners)
    assert len(set(looked)) == ways  # each once
