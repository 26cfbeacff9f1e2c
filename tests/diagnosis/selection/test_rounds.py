"""From a screen to an accepted law: in the plant, on the readings, refused where held-out recordings do not show it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from scipy.stats import norm

from diagnosis import bench
from kbs_process.diagnosis.acceptance import gate as gate_of
from kbs_process.diagnosis.acceptance import supposed as supposed_laws
from kbs_process.diagnosis.acceptance.finding import Tried, as_it_stands, find_of
from kbs_process.diagnosis.acceptance.gate import Gate, gate
from kbs_process.diagnosis.acceptance.needed import Accepted
from kbs_process.diagnosis.acceptance.rivals import distance, probabilities
from kbs_process.diagnosis.acceptance.supposed import Noted
from kbs_process.diagnosis.acceptance.verdict import gated
from kbs_process.diagnosis.experiments.experiment import Experiment
from kbs_process.diagnosis.experiments.floor import declared
from kbs_process.diagnosis.experiments.hypothesis import Hypothesis, Simulate, predict
from kbs_process.diagnosis.experiments.thresholds import told_apart
from kbs_process.diagnosis.facts import Identity, Place
from kbs_process.diagnosis.nominal.joint import Own, Standing, with_extra
from kbs_process.diagnosis.nominal.known import Strain
from kbs_process.diagnosis.nominal.scatter import scattered
from kbs_process.diagnosis.nominal.settling import detected
from kbs_process.diagnosis.proposing.tryout import extra_of, identity
from kbs_process.diagnosis.screening.gls import Sums, score
from kbs_process.diagnosis.screening.scene import Scene
from kbs_process.diagnosis.screening.screen import Bench, Catalogued, Found, Screening, screen
from kbs_process.diagnosis.screening.suspects import Candidate
from kbs_process.diagnosis.selection import believed, effort, rounds
from kbs_process.diagnosis.selection.as_suspect import sigma_of, suspect_of
from kbs_process.diagnosis.selection.effort import Effort
from kbs_process.diagnosis.selection.race import own_of
from kbs_process.diagnosis.smoothing.search import Smoothed
from kbs_process.identification.output_error import Scalar
from kbs_process.plant.attach import attach
from kbs_process.plant.laws import CATALOGUE, SENSING, select
from kbs_process.signals.records import Array

pytestmark = pytest.mark.slow

FREE = (
    Scalar("body.antenna.cog", (0,)),
    Scalar("joint.el.drive.Ka"),
    Scalar("transducer.stiffness", (1,)),
    Scalar("joint.el.drive.b_m"),
)
CABLE = 0.4  # N m/rad
ROLES = ("fit", "fit", "held-out")


def candidate(name: str, site: str, **shape: float) -> Candidate:
    law = next(one for one in (*CATALOGUE, *SENSING) if one.name == name)
    middle = {p.name: p.prior.middle for p in law.parameters if p.role == "shape"}
    return Candidate(law, site, tuple((middle | shape).items()))


def with_cable(made: Experiment, trials: tuple[int, ...]) -> Experiment:
    """The experiment with a cable between elevation and laboratory in some of its trials."""
    effect = next(one for one in CATALOGUE if one.name == "ground_cable")
    rig = attach(made.rig, effect, {"cable_spring": CABLE}, joints=["el"])
    names = tuple(one.name for one in select([*made.effects, effect.name]))
    bare = predict(Hypothesis(made.rig, made.effects), made, 0).values
    added = predict(Hypothesis(rig, names), made, 0).values - bare
    return replace(
        made,
        trials=tuple(
            replace(trial, measured=trial.measured + (k in trials) * added * trial.valid[:, None])
            for k, trial in enumerate(made.trials)
        ),
    )


def standing(made: Experiment) -> Standing:
    return bench.standing(made, FREE)


def screened(here: Standing) -> tuple[Bench, Scene, Screening]:
    scene = Scene.of(here.known.experiment, here.hypothesis, here.predicted)
    tried = Bench.of(here.known, scene)
    suspects = [
        candidate("ground_cable", "el"),
        candidate("ground_cable", "az"),
        candidate("harness", "el"),
        candidate("channel_lag", "Tx"),
        candidate("channel_gain", "Fx"),
    ]
    return tried, scene, screen(tried, [Catalogued(one, scene) for one in suspects])


@pytest.fixture(scope="module")
def made() -> Experiment:
    return bench.experiment(bench.rig(), ROLES, 3)


@pytest.fixture(scope="module")
def cable(made: Experiment) -> Standing:
    return standing(with_cable(made, (0, 1, 2)))


def test_nothing_is_found_where_nothing_is(made: Experiment) -> None:
    _, _, found = screened(standing(made))
    assert not any(one.significant for one in found.candidates)
    assert found.candidates[0].log_evidence < 0.0


def test_a_cable_is_found_refitted_in_the_plant_and_accepted(made: Experiment, cable: Standing) -> None:
    tried, scene, found = screened(cable)
    best = found.candidates[0]
    assert best.suspect.family == ("ground_cable", "el")
    assert best.log_evidence > np.log(99.0) + max(0.0, found.candidates[1].log_evidence)
    assert (identity(best.suspect).place.port, identity(best.suspect).family) == ("external wrench", "cable")
    begin = len(cable.known.value)
    after = with_extra(cable, extra_of(best, cable, tried, scene), bench.serial(made))
    spring, sigma = after.known.value[begin], after.known.sigma[begin]  # wide: a CoG does nearly the same
    assert spring == pytest.approx(CABLE, abs=4.0 * sigma)
    verdict = gate(cable.known, after.known, range(begin, begin + len(best.suspect.amplitudes)))
    assert verdict.passed and verdict.held_out, verdict.reasons
    fold = verdict.folds[0]
    assert fold.after < 1.3 < fold.before
    assert verdict.whiteness[1] < verdict.whiteness[0]


def test_a_law_that_held_out_recordings_do_not_show_is_refused(made: Experiment) -> None:
    here = standing(with_cable(made, (0, 1)))
    tried, scene, found = screened(here)
    after = with_extra(here, extra_of(found.candidates[0], here, tried, scene), bench.serial(made))
    verdict = gate(here.known, after.known, range(len(FREE), len(FREE) + len(found.candidates[0].suspect.amplitudes)))
    assert not verdict.passed and "r2 predicted worse" in verdict.reasons


@pytest.mark.parametrize("of_much", [True, False])
def test_a_few_sigmas_of_parts_do_where_nothing_of_much_is_left(
    made: Experiment, cable: Standing, monkeypatch: pytest.MonkeyPatch, of_much: bool
) -> None:
    """By the noise a law has to be off zero as ever."""
    tried, scene, found = screened(cable)
    best = found.candidates[0]
    after = with_extra(cable, extra_of(best, cable, tried, scene), bench.serial(made))
    places = range(len(FREE), len(FREE) + len(best.suspect.amplitudes))
    monkeypatch.setattr(gate_of, "_all_of_much", lambda *_: of_much)
    monkeypatch.setattr(gate_of, "_elsewhere", lambda *_: False)
    for parts, passes in ((6.0, of_much), (1.0, False)):
        monkeypatch.setattr(gate_of, "_evenly", lambda *_, it=parts: it)
        verdict = gate(cable.known, after.known, places)
        assert verdict.passed == passes and verdict.sigmas < 8.0
        assert verdict.uneven != passes
    monkeypatch.setattr(gate_of, "_evenly", lambda *_: 6.0)
    assert not gate(cable.known, after.known, places, least=1e6).passed


def test_without_held_out_recordings_each_is_left_out_in_turn(made: Experiment, cable: Standing) -> None:
    fit_only = replace(cable.known.experiment, trials=cable.known.experiment.trials[:2])
    here = standing(fit_only)
    tried, scene, found = screened(here)
    after = with_extra(here, extra_of(found.candidates[0], here, tried, scene), bench.serial(made))
    verdict = gate(here.known, after.known, range(len(FREE), len(FREE) + len(found.candidates[0].suspect.amplitudes)))
    assert not verdict.held_out and [fold.trial for fold in verdict.folds] == ["r0", "r1"]
    assert verdict.passed, verdict.reasons


def test_numbers_of_each_recording_count_as_those_of_the_model_do(cable: Standing) -> None:
    known = cable.known
    assert probabilities([known, known], 1000) == pytest.approx([0.5, 0.5])
    odds = 1000.0**2  # Schwarz: half the logarithm of the rows for each of four numbers
    assert probabilities([known, known], 1000, (0, 4)) == pytest.approx([odds / (1 + odds), 1 / (1 + odds)])


def test_a_law_is_judged_where_its_numbers_have_settled(made: Experiment, cable: Standing) -> None:
    tried, scene, found = screened(cable)
    best = found.candidates[0]
    after = with_extra(cable, extra_of(best, cable, tried, scene), bench.serial(made))
    begun = Tried(
        best,
        after,
        gated(best, cable, after, own_of(best, cable, after), bench.serial(made)),
        found,
        own_of(best, cable, after),
    )
    assert begun.gate.passed
    known = after.known
    worse = replace(known, residual=tuple(5.0 * one for one in known.residual))
    told = believed._judged_again(replace(begun, standing=replace(after, known=worse)), cable, bench.serial(made))
    assert not told.gate.passed and any("predicted worse" in reason for reason in told.gate.reasons)
    floor = declared(known.experiment)
    assert rounds._explains_all(begun, floor)
    assert not rounds._explains_all(replace(begun, standing=cable), floor)
    sigma = np.where(known.stated, known.parameters.sigma, 0.0)
    pulled = replace(known, value=known.value + 8.0 * sigma)
    assert not rounds._explains_all(replace(begun, standing=replace(after, known=pulled)), floor)
    alone = replace(begun, own=Own((), ()))  # of what is each recording's own the verdict stays
    assert believed._judged_again(alone, cable, bench.serial(made)) is alone


def test_a_law_of_the_readings_needs_no_plant_and_its_rival_is_told_apart(made: Experiment) -> None:
    law = candidate("channel_gain", "Fz")
    plain = standing(made)
    scene = Scene.of(made, plain.hypothesis, plain.predicted)
    moves = Catalogued(candidate("channel_lag", "Ty"), scene).outputs(0)[:, :, 0]
    size = 40.0 / np.linalg.norm(plain.known.metric[0](moves))
    trials = tuple(replace(t, measured=t.measured + size * moves * t.valid[:, None]) for t in made.trials)
    here = standing(replace(made, trials=trials))
    scene = Scene.of(here.known.experiment, here.hypothesis, here.predicted)
    tried = Bench.of(here.known, scene)
    suspects = [Catalogued(one, scene) for one in (law, candidate("channel_lag", "Ty"), candidate("harness", "el"))]
    found = screen(tried, suspects)
    assert found.candidates[0].suspect.family == ("channel_lag", "Ty")
    assert identity(found.candidates[0].suspect).place.channels == ("Ty",)
    by_family: dict[tuple[str, str], Found] = {one.suspect.family: one for one in found.candidates}
    right, wrong = (
        with_extra(here, extra_of(by_family[family], here, tried, scene), bench.serial(made))
        for family in (("channel_lag", "Ty"), ("channel_gain", "Fz"))
    )
    share, time = right.known.value[-2:]
    assert share == pytest.approx(size, abs=4.0 * right.known.sigma[-2])
    # What the search learns of the known numbers' slopes on its way is not the law's doing.
    slower = right.laws["law.channel_lag.Ty.lag_time"][0]
    columns = {k: m(np.stack([moves, slower], axis=2)) for k, m in enumerate(here.known.metric[:2])}
    linear = score(tried.background, Sums.over(tried.background, columns)).covariance
    prior = np.diag([0.0, right.known.parameters.sigma[-1] ** -2.0])
    alone = np.linalg.inv(np.linalg.inv(linear) + prior)
    assert right.known.sigma[-2:] == pytest.approx(np.sqrt(np.diag(alone)), rel=0.15)
    assert np.allclose(right.shown(0) - right.predicted[0].values, share * moves + time * slower)
    apart = distance(right.known, wrong.known)
    assert apart > 20.0 and apart > told_apart(300.0) and norm.sf(0.5 * apart) < 1e-20
    assert distance(right.known, right.known) < told_apart(0.0)


def passed(here: Standing, tried: Bench, scene: Scene, found: Screening, law: str) -> Tried:
    """A law at elevation as it is after its refit."""
    one = next(one for one in found.candidates if one.suspect.family == (law, "el"))
    after = with_extra(here, extra_of(one, here, tried, scene), bench.serial(here.known.experiment))
    own = own_of(one, here, after)
    return Tried(one, after, gated(one, here, after, own, bench.serial(here.known.experiment)), found, own)


def test_an_error_of_an_encoder_that_no_law_has_is_measured_with_a_band(made: Experiment) -> None:
    """A sawtooth of its disc, on recordings that were not used, too; its curve is the sawtooth's."""
    el, order = made.channels.index("el"), 180.0
    height = 4e-4

    def sawtooth(angle: Array) -> Array:
        return np.asarray(height * ((order * angle / (2.0 * np.pi)) % 1.0 - 0.5))

    trials = []
    for trial in made.trials:
        shown = np.zeros_like(trial.measured)
        shown[:, el] = sawtooth(trial.measured[:, el])
        trials.append(replace(trial, measured=trial.measured + shown * trial.valid[:, None]))
    here = standing(replace(made, trials=tuple(trials)))
    scene = Scene.of(here.known.experiment, here.hypothesis, here.predicted)
    tried = Bench.of(here.known, scene)
    period = 2.0 * np.pi / order
    some = (candidate("encoder_profile", "el", profile_period=period), candidate("encoder_step", "el"))
    found = screen(tried, [Catalogued(one, scene) for one in some])
    told = passed(here, tried, scene, found, "encoder_profile")
    assert told.gate.passed, told.gate.reasons
    find = find_of([told], np.ones(1), here, None)
    assert not find.named and (find.identity.place.port, find.identity.place.site) == ("encoder", "el")
    assert find.held_out_variance is not None and find.held_out_variance > 0.9
    assert {one.unit for one in find.estimates} == {"rad"}
    assert find.curve is not None
    assert np.ptp(find.curve.x) <= period * (1.0 + 1e-9)
    away = find.curve.value - sawtooth(find.curve.x)
    # A spline rounds the jump off, and its mean is the encoder's offset.
    between = np.abs((order * find.curve.x / (2.0 * np.pi) + 0.5) % 1.0 - 0.5) > 0.15
    assert np.std(away[between]) < 0.1 * height
    assert find.curve.sigma.max() < 0.1 * height  # not that of an offset, which nothing shows
    again = as_it_stands(find, told.own, told.standing.known)
    assert again.curve is not None
    np.testing.assert_array_equal(again.curve.value, find.curve.value)
    taken = suspect_of(find, scene)
    assert taken is not None
    suspect, amplitude = taken
    np.testing.assert_allclose(suspect.outputs(0)[:, el] @ amplitude, tried.signatures([suspect], 0)[:, el] @ amplitude)
    sigma = sigma_of(find, suspect, amplitude)
    assert sigma.shape == amplitude.shape and (sigma > 0.0).all()


def test_a_law_that_fell_in_the_plant_is_none_that_the_find_cannot_be_told_from(cable: Standing) -> None:
    tried, scene, found = screened(cable)
    told = passed(cable, tried, scene, found, "ground_cable")
    fell = Identity(Place("joint torque", "el"), "harness", "harness")
    with_it, without_it = (find_of([told], np.ones(1), cable, None, refused).alternatives for refused in ((), (fell,)))
    assert fell in {one.identity for one in with_it}
    assert {one.identity for one in with_it} - {one.identity for one in without_it} >= {fell}


def test_the_second_law_that_passed_is_believed_where_the_first_falls(
    cable: Standing, monkeypatch: pytest.MonkeyPatch
) -> None:
    tried, scene, found = screened(cable)
    first, second = (passed(cable, tried, scene, found, law) for law in ("ground_cable", "harness"))
    assert first.standing.known.cost < second.standing.known.cost
    seen = SimpleNamespace(scene=scene, bench=tried, screening=found)
    monkeypatch.setattr(rounds.View, "of", lambda _: seen)
    monkeypatch.setattr(rounds, "place_of", lambda *_: None)
    monkeypatch.setattr(believed, "named_first", list)
    monkeypatch.setattr(rounds, "_passed", lambda *_: iter([[first, second]]))
    monkeypatch.setattr(believed, "_settled", lambda one, *_: replace(one, gate=replace(one.gate, reasons=())))
    floor = declared(cable.known.experiment)
    simulate = Effort(bench.serial(cable.known.experiment), cable.known)
    for fallen, kept in ((("harness",), "ground_cable"), (("ground_cable",), "harness")):
        monkeypatch.setattr(
            believed, "_stands_in", lambda told, *_, no=fallen: ("falls",) if believed._law(told).law in no else ()
        )
        done = rounds._round(cable, cable, floor, simulate, [])
        assert done.accepted is not None and done.accepted.find.identity.law == kept
        assert [one.identity.law for one in done.noted.refused] == ([] if kept == "ground_cable" else list(fallen))
    # Those that are each recording's own are looked at where none of the others stands.
    monkeypatch.setattr(rounds, "_passed", lambda *_: iter([[first], [second]]))
    done = rounds._round(cable, cable, floor, simulate, [])
    assert done.accepted is not None and done.accepted.find.identity.law == "harness"
    monkeypatch.setattr(believed, "_stands_in", lambda *_: ("falls",))
    assert rounds._round(cable, cable, floor, simulate, []).accepted is None


def test_what_numbers_gain_where_they_were_drawn_back_is_no_law_s(
    cable: Standing, monkeypatch: pytest.MonkeyPatch
) -> None:
    """They are believed once they have settled, law or none; laws are looked for from where they were drawn back."""
    tried, scene, found = screened(cable)
    back, alone = (_lower(cable, share) for share in (0.9, 0.6))
    asked: list[tuple[Standing, Standing]] = []

    def none_passed(view: SimpleNamespace, before: Standing, *_: object) -> Iterator[list[Tried]]:
        asked.append((view.standing, before))
        yield from ()

    monkeypatch.setattr(rounds, "drawn_back", lambda *_: back)
    monkeypatch.setattr(rounds, "resettled", lambda one, *_, leaps: alone if one is back else one)
    monkeypatch.setattr(
        rounds.View, "of", lambda one: SimpleNamespace(standing=one, scene=scene, bench=tried, screening=found)
    )
    monkeypatch.setattr(rounds, "place_of", lambda *_: None)
    monkeypatch.setattr(rounds, "_passed", none_passed)
    experiment = cable.known.experiment
    floor, search = declared(experiment), Effort(bench.serial(experiment), cable.known)
    done = rounds._round(cable, back, floor, search, [])
    assert (done.seen, done.standing) == (back, alone)
    assert asked == [(back, alone)]
    told = rounds._diagnosed(cable.known, floor, search, detected(cable, floor, experiment.fit))
    assert told.standing.known.residual is alone.known.residual
    # What they are known to is told by their scatter, too.
    np.testing.assert_array_equal(told.standing.known.covariance, scattered(alone.known))
    assert told.after.ratio < told.before.ratio
    # Numbers that nothing has pulled stay where they are.
    rounds._diagnosed(cable.known, floor, search, detected(cable, floor, experiment.fit), pulled=False)
    assert asked[-1][0].known is cable.known


@pytest.mark.parametrize("costly", [True, False])
def test_a_search_that_has_cost_too_much_ends_with_what_it_has_found(
    cable: Standing, monkeypatch: pytest.MonkeyPatch, costly: bool
) -> None:
    tried, scene, found = screened(cable)
    first = passed(cable, tried, scene, found, "ground_cable")
    told = find_of([first], np.ones(1), cable, None)
    asked: list[int] = []

    def look(here: Standing, seen: Standing, _: object, __: object, accepted: list[Accepted]) -> rounds.Round:
        asked.append(len(accepted))
        law = None if accepted else Accepted(first, told, cable)
        return rounds.Round(law, first.standing if law else here, seen, found, Noted(), None)

    monkeypatch.setattr(rounds, "_round", look)
    monkeypatch.setattr(rounds, "drawn_back", lambda one, *_: one)
    monkeypatch.setattr(rounds, "_goes_on", lambda *_: True)
    monkeypatch.setattr(rounds, "place_of", lambda *_: None)
    monkeypatch.setattr(rounds, "needed", lambda accepted, here, *_: (accepted, here, ()))
    if costly:
        monkeypatch.setattr(effort, "EFFORT", -1.0)
    experiment = cable.known.experiment
    floor = declared(experiment)
    search = Effort(bench.serial(experiment), cable.known)
    done = rounds._diagnosed(cable.known, floor, search, detected(cable, floor, experiment.fit))
    assert asked == ([0] if costly else [0, 1])
    assert done.ended == costly
    assert [one.identity.law for one in done.finds] == ["ground_cable"]


@pytest.mark.parametrize(("count", "believes"), [(1, True), (1, False), (0, False)])
def test_where_smoothing_has_looked_nothing_else_is_searched(
    cable: Standing, monkeypatch: pytest.MonkeyPatch, count: int, believes: bool
) -> None:
    tried, scene, found = screened(cable)
    first = passed(cable, tried, scene, found, "ground_cable")
    law = Accepted(first, find_of([first], np.ones(1), cable, None), cable)
    asked: list[int] = []

    def look(here: Standing, seen: Standing, *_: object) -> rounds.Round:
        asked.append(1)
        return rounds.Round(None, here, seen, found, Noted(), None)

    def judge(_: object, here: Standing, seen: Standing, *__: object) -> rounds.Round:
        return rounds.Round(
            law if believes else None, first.standing if believes else here, seen, found, Noted(), None
        )  # fmt: skip

    monkeypatch.setattr(rounds, "_round", look)
    monkeypatch.setattr(rounds, "_pair", lambda *_: ())
    monkeypatch.setattr(rounds, "proposed", judge)
    monkeypatch.setattr(rounds, "numbers_beside", lambda *_: cable)
    monkeypatch.setattr(rounds, "nothing", lambda *_: rounds.Round(None, cable, cable, found, Noted(), None))
    monkeypatch.setattr(rounds, "drawn_back", lambda one, *_: one)
    monkeypatch.setattr(rounds, "place_of", lambda *_: None)
    monkeypatch.setattr(rounds, "needed", lambda accepted, here, *_: (accepted, here, ()))
    alone, beside = Strain(500.0, 50), Strain(50.0, 50)
    fits = {"alone": SimpleNamespace(strain=alone), "beside": SimpleNamespace(strain=beside)}
    smoothed = cast("Smoothed", SimpleNamespace(proposals=(None,) * count, **fits))
    experiment = cable.known.experiment
    floor, search = declared(experiment), Effort(bench.serial(experiment), cable.known)
    before = detected(cable, floor, experiment.fit)
    done = rounds._diagnosed(cable.known, floor, search, before, smoothed)
    assert asked == []
    assert len(done.finds) == (1 if believes else 0)
    # Whether numbers are off together is told beside what is believed.
    assert done.strain == (beside if believes else alone)


def _lower(standing: Standing, share: float) -> Standing:
    """Some numbers that leave less, in the readings too."""
    known = standing.known
    shown = standing.predicted[0].values
    trials = tuple(
        replace(one, measured=(shown + np.sqrt(share) * (one.measured - shown)) * one.valid[:, None])
        for one in known.experiment.trials
    )
    return replace(
        standing,
        known=replace(
            known,
            experiment=replace(known.experiment, trials=trials),
            residual=tuple(np.sqrt(share) * z for z in known.residual),
        ),
    )


@pytest.mark.parametrize(
    ("left", "some", "looked"), [(True, True, True), (True, False, True), (False, False, True), (False, True, False)]
)
def test_what_each_recording_has_of_its_own_is_not_looked_for_where_a_law_leaves_nothing(
    cable: Standing, monkeypatch: pytest.MonkeyPatch, left: bool, some: bool, looked: bool
) -> None:
    """`some` law was found before; it would take up what that one's formula lacks."""
    tried, scene, found = screened(cable)
    first = passed(cable, tried, scene, found, "ground_cable")
    told = find_of([first], np.ones(1), cable, None)
    accepted = [Accepted(first, told, cable)] if some else []
    own, repeating = (
        SimpleNamespace(suspect=SimpleNamespace(each_trial=each, family=("drift", str(each)))) for each in (True, False)
    )
    asked: list[object] = []

    def simulated(chosen: list[object], *_: object) -> tuple[list[Tried], list[Tried]]:
        asked.extend(chosen)
        return [], []

    def led(view: SimpleNamespace, _: Simulate, among: Callable[[object], bool]) -> tuple[list[object], list[object]]:
        return [one for one in (repeating, own) if among(one)], []

    monkeypatch.setattr(rounds, "detected", lambda *_: SimpleNamespace(left=left))
    monkeypatch.setattr(rounds, "promises_little", lambda *_: "")
    monkeypatch.setattr(rounds, "in_the_shade", lambda *_: ())
    monkeypatch.setattr(rounds, "leaders", led)
    monkeypatch.setattr(rounds, "tried", simulated)
    view = SimpleNamespace(able=[], unrepeated=[own], standing=cable, screening=SimpleNamespace(candidates=()))
    floor = declared(cable.known.experiment)
    simulate = Effort(bench.serial(cable.known.experiment), cable.known)
    assert list(rounds._passed(view, cable, floor, simulate, accepted, Noted())) == []  # type: ignore[arg-type]
    assert asked[0] is repeating
    assert (own in asked) == looked


@pytest.mark.parametrize("stands", [False, True])
def test_a_law_that_leaves_less_and_is_too_uneven_settles_before_another_is_believed(
    cable: Standing, monkeypatch: pytest.MonkeyPatch, stands: bool
) -> None:
    """What passes beside it follows what it does: believed is the one that leaves least, or none."""
    tried, scene, found = screened(cable)
    best, other = (passed(cable, tried, scene, found, law) for law in ("ground_cable", "harness"))
    scattered = replace(best.gate, sigmas=5.0, scattered=True).but("its coefficients are 5.0 sigma off zero")
    uneven = replace(best, gate=scattered)
    worse = replace(best, gate=best.gate.but("r2 predicted worse"))
    assert best.gate.passed and uneven.gate.uneven and not worse.gate.uneven and not best.gate.uneven
    assert believed.beaten([other], [uneven]) is uneven
    assert believed.beaten([other], [worse]) is None
    assert believed.beaten([best], [replace(other, gate=uneven.gate)]) is None
    settled: list[str] = []

    def settle(one: Tried, *_: object) -> Tried:
        settled.append(believed._law(one).law)
        return best if stands else replace(one, gate=uneven.gate)

    monkeypatch.setattr(believed, "_settled", settle)
    monkeypatch.setattr(believed, "_stands_in", lambda *_: ())
    view = SimpleNamespace(scene=scene, bench=tried, screening=found)
    floor, simulate = declared(cable.known.experiment), bench.serial(cable.known.experiment)
    noted = Noted()
    noted.fell(uneven)
    told = believed.believed([other], view, cable, None, floor, simulate, [], noted)
    assert (told is not None) == stands
    assert told is None or told.find.identity.law == "ground_cable"
    assert settled == ["ground_cable"]
    refused = [(one.identity.law, one.reasons[-1]) for one in noted.refused]
    fell = [("ground_cable", "nor with all numbers settled"), ("harness", "ground_cable leaves less")]
    assert refused == ([] if stands else fell)
    assert believed.beaten([other], noted.fallen) is None
    if stands:
        # What stands in for something else is not made good by what follows it.
        noted.fell(uneven)
        monkeypatch.setattr(believed, "_stands_in", lambda *_: ("falls",))
        assert believed.believed([other], view, cable, None, floor, simulate, [], noted) is None
        assert settled == ["ground_cable"] * 2


def test_a_few_sigmas_place_no_law_where_others_do_as_well_elsewhere(cable: Standing) -> None:
    """Of what known numbers had taken up nearly all; where much was left no other minimum does it."""
    tried, scene, found = screened(cable)
    one = passed(cable, tried, scene, found, "ground_cable")
    few = replace(one, gate=replace(one.gate, sigmas=3.0))
    other = passed(cable, tried, scene, found, "harness")
    as_good = replace(other, standing=one.standing)
    here = replace(one, found=one.found)
    little = replace(cable, known=replace(cable.known, residual=one.standing.known.residual))
    assert not little.known.gross
    assert believed._as_well_elsewhere(few, [here, as_good], little)
    assert not believed._as_well_elsewhere(few, [here], little)
    assert not believed._as_well_elsewhere(one, [here, as_good], little)
    loud = tuple(5.0 * z for z in cable.known.residual)
    assert not believed._as_well_elsewhere(
        few, [here, as_good], replace(cable, known=replace(cable.known, residual=loud))
    )


@pytest.mark.parametrize(
    ("cost", "passes", "kept"), [(5.0, True, ["b", "h"]), (8.0, True, ["a", "b"]), (5.0, False, ["a", "b"])]
)
def test_of_a_law_tried_from_two_places_the_better_counts(
    monkeypatch: pytest.MonkeyPatch, cost: float, passes: bool, kept: list[str]
) -> None:
    """`h` is the law of `a`, which leaves 7; one that leaves no less than there was is refused, with a reason."""

    def one(name: str, law: str, left: float, passed: bool = True) -> Tried:
        gate = Gate(passed, (), True, 9.0, (1.0, 1.0), () if passed else ("x",))
        told = SimpleNamespace(known=SimpleNamespace(cost=left, excess=left, fit_rows=1.0))
        score = SimpleNamespace(rho_eff=1.0)
        return Tried(SimpleNamespace(suspect=law, score=score), told, gate, None, Own((name,), ()))  # type: ignore[arg-type]

    for place in (rounds, supposed_laws):
        monkeypatch.setattr(place, "identity", lambda suspect: suspect)
    noted = Noted()
    before = SimpleNamespace(known=SimpleNamespace(cost=10.0))
    passed = [one("a", "one", 7.0), one("b", "two", 6.0)]
    hidden = [one("h", "one", cost, passes), one("far", "three", 11.0)]
    joined = rounds._joined(passed, hidden, before, noted)  # type: ignore[arg-type]
    assert [two.own.names[0] for two in joined] == kept
    told = {two.own.names[0]: two.gate.reasons for two in noted.fallen}
    assert told == {"far": ("no less is left with it than without",)}
