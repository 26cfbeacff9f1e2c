"""Hand-made answers and truths that have to score to known numbers."""

from __future__ import annotations

import math

import pytest
from scipy.stats import binom, norm

from proof.__main__ import failed
from proof.aims import AIMS, beaten, find, reached
from proof.answer import Answer, Candidate, Claim, Estimate, HeldOut, Suspect, decode, encode
from proof.match import covered, error_over_bound, match, superfluous
from proof.rates import clopper_pearson, decibels_from_clairvoyant, equivalent_distance, median_interval
from proof.score import Row, score
from proof.truth import Beyond, Concealed, TrueParameter, Truth

COGGING = Suspect(port="motor torque", axis="el", family="cogging")
RIPPLE = Suspect(port="motor torque", axis="el", family="motor order")


def concealed(trial: str, *effects: Concealed, level: float = 300.0) -> Truth:
    return Truth(trial=trial, kind="concealed", split="development", level=level, effects=effects, rho_eff=level)


def effect(suspect: Suspect = COGGING, **more: object) -> Concealed:
    given = {"port": suspect.port, "axis": suspect.axis, "channels": suspect.channels, "family": suspect.family}
    return Concealed(**(given | {"name": "law", "rho": 310.0, "rho_eff": 300.0} | more))  # type: ignore[arg-type]


def claim(suspect: Suspect = COGGING, **more: object) -> Claim:
    given = {"port": suspect.port, "axis": suspect.axis, "channels": suspect.channels, "family": suspect.family}
    return Claim(**(given | more))  # type: ignore[arg-type]


def answer(trial: str, *finds: Claim, **more: object) -> Answer:
    given: dict[str, object] = {
        "method": "kbs-process", "trial": trial, "detected": bool(finds), "finds": finds, "seconds": 10.0,
        "verdict": "physics" if finds else "none",
    }  # fmt: skip
    return Answer(**(given | more))  # type: ignore[arg-type]


def value(rows: tuple[Row, ...], metric: str, group: str = "all", method: str = "kbs-process") -> float | None:
    row = find(rows, method, metric, group)
    assert row is not None, (metric, group)
    return row.value


def test_exact_interval_covers_with_what_it_claims() -> None:
    assert clopper_pearson(0, 300)[1] == pytest.approx(0.01222, abs=1e-5)  # published tables
    for share in (0.01, 0.3, 0.9):
        inside = 0.0
        for k in range(41):
            low, high = clopper_pearson(k, 40)
            inside += float(binom.pmf(k, 40, share)) * (low <= share <= high)
        assert inside >= 0.95
    with pytest.raises(ValueError):
        clopper_pearson(3, 2)


def test_interval_of_a_median_comes_from_order_statistics() -> None:
    assert median_interval(range(1, 11)) == (5.5, 2.0, 9.0)  # 97.9 %: the first within which 95 % is reached
    assert median_interval([3.0, 1.0, 2.0]) == (2.0, -math.inf, math.inf)


def test_distance_from_a_p_value_agrees_with_the_normal_and_does_not_underflow() -> None:
    assert equivalent_distance(math.log10(norm.sf(5.0))) == pytest.approx(5.0, rel=1e-9)
    assert equivalent_distance(-19544.0) == pytest.approx(300.0, rel=1e-3)  # Q(300), beyond all doubles
    assert decibels_from_clairvoyant(300.0, math.log10(norm.sf(30.0))) == pytest.approx(20.0, abs=1e-6)
    assert decibels_from_clairvoyant(300.0, 0.0) == math.inf


def test_answers_survive_being_written_and_refuse_what_nobody_knows() -> None:
    given = answer("A", claim(alternatives=(Candidate(**_fields(RIPPLE), probability=0.2),)))
    assert decode(encode(given)) == given
    with pytest.raises(ValueError, match="unknown"):
        decode(encode(given).replace(b'"verdict"', b'"unknown"'))


def _fields(suspect: Suspect) -> dict[str, object]:
    return {"port": suspect.port, "axis": suspect.axis, "family": suspect.family}


def test_place_and_physics_are_judged_apart() -> None:
    (right,) = match(answer("A", claim()), [effect()])
    assert right.port and right.place and right.physics
    (other_axis,) = match(answer("A", claim(Suspect(port="motor torque", axis="az", family="cogging"))), [effect()])
    assert other_axis.port and not other_axis.place and not other_axis.physics
    (other_law,) = match(answer("A", claim(RIPPLE)), [effect()])
    assert other_law.place and not other_law.physics
    (nothing,) = match(answer("A"), [effect()])
    assert not nothing.port and not nothing.place_in_top


def test_channel_is_part_of_the_place_at_the_transducer() -> None:
    truth = effect(Suspect(port="transducer", channels=("Tx",), family="gain"))
    for channels, expected in ((("Tx", "Fz"), True), (("Fz", "Tx"), False), ((), False)):
        (judged,) = match(answer("A", claim(Suspect(port="transducer", channels=channels, family="gain"))), [truth])
        assert judged.place is expected and judged.port


def test_only_the_first_three_candidates_count() -> None:
    wrong = [Candidate(port="clock", axis=str(index), family="skew") for index in range(3)]
    right = Candidate(port="motor torque", axis="el", family="cogging")
    other = Suspect(port="clock", axis="wrench", family="offset")
    for place, expected in ((1, True), (2, False)):
        alternatives = (*wrong[:place], right)
        (judged,) = match(answer("A", claim(other, alternatives=alternatives)), [effect()])
        assert judged.place_in_top is expected and not judged.place


def test_a_law_in_no_catalogue_has_to_be_called_unnamed() -> None:
    bump = effect(Suspect(port="joint torque", axis="az", family="unnamed"), catalogued=False)
    place = {"port": "joint torque", "axis": "az", "family": "local torque"}
    (named,) = match(answer("A", Claim(**place)), [bump])  # type: ignore[arg-type]
    (unnamed,) = match(answer("A", Claim(**place, named=False, held_out_variance=0.93)), [bump])  # type: ignore[arg-type]
    assert named.place and not named.physics and unnamed.physics


def test_undecided_is_right_only_if_it_is_said_and_true() -> None:
    both = effect(equivalents=(RIPPLE,))
    (told,) = match(answer("A", claim(RIPPLE, indistinguishable_from=(COGGING,))), [both])
    (guessed,) = match(answer("A", claim(RIPPLE)), [both])
    (alone,) = match(answer("A", claim(RIPPLE, indistinguishable_from=(COGGING,))), [effect(equivalents=())])
    assert told.physics and not guessed.physics and not alone.physics
    truths = [concealed(name, both) for name in "AB"]
    rows = score(truths, [answer("A", claim(RIPPLE, indistinguishable_from=(COGGING,))), answer("B", claim(RIPPLE))])
    assert value(rows, "indistinguishable, and told") == 0.5


def test_two_effects_are_assigned_to_claims_in_any_order() -> None:
    second = effect(Suspect(port="joint torque", axis="az", family="harness"))
    finds = (claim(second), claim(Suspect(port="clock", axis="wrench", family="skew")), claim())
    judged = match(answer("A", *finds), [effect(), second])
    assert [entry.physics for entry in judged] == [True, True]
    assert superfluous(answer("A", *finds), judged) == 1
    rows = score([concealed("A", effect(), second), concealed("B", effect(), second)],
                 [answer("A", *finds), answer("B", claim())])  # fmt: skip
    assert value(rows, "all of several") == 0.5 and value(rows, "one of several") == 1.0
    assert value(rows, "superfluous find") == 0.5


def test_parameters_are_measured_by_the_bound_and_phases_on_the_circle() -> None:
    truth = TrueParameter(name="phi_cog", unit="rad", value=3.1, sigma_cr=0.05)
    near = Estimate(name="phi_cog", unit="rad", value=-3.1, low=-3.2, high=-3.0)
    assert error_over_bound(near, truth) == pytest.approx((2 * math.pi - 6.2) / 0.05)
    far = Estimate(name="phi_cog", unit="rad", value=3.0, low=2.9, high=3.05)
    assert covered(near, truth) and not covered(far, truth)
    amplitude = TrueParameter(name="tcog", unit="N m", value=6e-3, sigma_cr=1e-4)
    law = effect(parameters=(amplitude,))
    estimates = [
        Estimate(name="tcog", unit="N m", value=value, low=value - 2e-4, high=value + 2e-4)
        for value in (6.06745e-3, 5.8651e-3, 6.4e-3)
    ]
    finds = [claim(parameters=(estimate,)) for estimate in estimates]
    rows = score([concealed(n, law) for n in "ABC"], [answer(n, f) for n, f in zip("ABC", finds, strict=True)])
    assert value(rows, "error over Cramer-Rao bound") == pytest.approx(2.0)
    assert value(rows, "interval covers") == pytest.approx(2 / 3)


def test_a_parameter_of_another_formula_is_known_by_its_unit_if_it_is_the_only_one() -> None:
    law = effect(parameters=(TrueParameter(name="amplitude", unit="N m", value=1.0, sigma_cr=0.1),))
    torque, rate = Estimate(name="T_c", unit="N m", value=1.1), Estimate(name="w_s", unit="rad/s", value=1.0)
    (one,) = match(answer("A", claim(parameters=(rate, torque))), [law])
    (two,) = match(answer("A", claim(parameters=(torque, torque))), [law])
    assert [estimate.name for estimate, _ in one.parameters] == ["T_c"] and two.parameters == ()


def test_nulls_count_finds_and_parameters_off() -> None:
    kinds = ("nothing", "within", "beyond", "beyond")
    off = {"beyond": (Beyond(name="joint.az.drive.Ka", sigmas=5.0),)}
    truths = [
        Truth(trial=str(k), kind=kind, split="development", beyond=off.get(kind, ()))  # type: ignore[arg-type]
        for k, kind in enumerate(kinds)
    ]
    given = [answer("0"), answer("1", claim()), answer("2", verdict="parameters off", detected=True), answer("3")]
    rows = score(truths, given)
    assert value(rows, "false find") == 0.25 and value(rows, "false find", "within") == 1.0
    assert value(rows, "false alarm") == 0.5  # that parameters are off, beyond sigma, is no false alarm
    assert value(rows, "called parameters off") == 0.5
    assert value(rows, 'said "none", and is') == 0.5, "of the first and the last, whose numbers are off"
    assert value(rows, 'said "parameters off", and are') == 1.0
    assert value(rows, 'find of "physics" at its place') == 0.0, "it is a null's"
    assert find(rows, "kbs-process", 'find of "undecided" at its place', "all") is None
    assert reached(AIMS[0], find(rows, "kbs-process", "false find", "all")) == "missed"


def test_detection_strength_and_residual_are_grouped() -> None:
    truths = [concealed("A", effect(), level=40.0), concealed("B", effect(), level=1000.0)]
    log10_p = math.log10(norm.sf(20.0))
    given = [
        answer("A", log10_p=log10_p),
        answer("B", claim(), log10_p=-43429.15, held_out=HeldOut(before=9.0, after=1.05)),
    ]
    rows = score(truths, given)
    assert value(rows, "mismatch detected", "40") == 0.0 and value(rows, "mismatch detected", "1000") == 1.0
    assert value(rows, "decibels from the clairvoyant", "40") == pytest.approx(6.02, abs=0.01)
    # A p-value that was cut off says that the effect was seen, and not how well.
    assert find(rows, "kbs-process", "decibels from the clairvoyant", "1000") is None
    beyond = [given[0], answer("B", claim(), log10_p=math.log10(math.e) * -(1000.0**2) / 2.0)]
    rows = score(truths, beyond)
    assert value(rows, "decibels from the clairvoyant", "1000") == pytest.approx(0.0, abs=0.01)
    rows = score(truths, given)
    assert value(rows, "held-out residual over floor, after", ">=300") == 1.05


def test_a_method_that_gives_up_is_wrong_and_one_without_answers_is_refused() -> None:
    truths = [concealed("A", effect()), concealed("B", effect())]
    given = [answer("A", claim()), answer("B", verdict="undecided", failure="exit status 70")]
    rows = score(truths, given)
    assert value(rows, "place") == 0.5 and value(rows, "answered") == 0.5
    with pytest.raises(ValueError, match="'B'"):
        score(truths, given[:1])


def test_better_rivals_are_named() -> None:
    truths = [concealed("A", effect())]
    rival = answer("A", claim(), method="grey box", seconds=30.0)
    rows = score(truths, [answer("A", claim(RIPPLE)), rival])
    found = {ours.metric for ours, best in beaten(rows) if best.method == "grey box"}
    assert "physics" in found and "seconds" not in found and "place" not in found


def test_a_truth_that_contradicts_itself_is_refused() -> None:
    with pytest.raises(ValueError, match="0 effects"):
        Truth(trial="A", kind="concealed", split="development")


def test_a_bench_fails_by_a_false_find_or_a_missing_answer() -> None:
    null = Truth(trial="A", kind="nothing", split="development")
    assert not failed(score([null], [answer("A")]))
    assert failed(score([null], [answer("A", claim())]))
    assert failed(score([null], [answer("A", failure="exit status 70", verdict="undecided")]))
    assert not failed(score([null], [answer("A", claim(), method="sparse")]))  # a rival's is no fault of ours
