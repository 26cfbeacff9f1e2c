"""Every channel of every recording is judged by its own uncertainty; the one closest to failing is told."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from msgspec.structs import replace as replace_of

import archived
from kbs_process.reduction.analysis import Pair
from kbs_process.reduction.judging import coverage_below, decided, judged
from kbs_process.results.judged import Budget, BudgetItem, Doubt, Requirement
from kbs_process.signals.records import WRENCH_CHANNELS, WRENCH_UNITS, Signal
from kbs_process.stages.bandpass import Band
from kbs_process.stages.six_channels import Together
from kbs_process.studies.correlate.summary import conclusion

BAND = Band("lt1Hz", 0.01, 1.0)


def recorded(name: str, peak: float, gaps: Sequence[tuple[float, float]] = ()) -> SimpleNamespace:
    values = np.zeros((100, 6))
    values[40, 4] = -peak
    valid = np.ones(100, dtype=bool)
    signal = Signal(0.0, 0.05, values, WRENCH_CHANNELS, WRENCH_UNITS, "S", valid)
    run = SimpleNamespace(gaps=np.array(gaps).reshape(-1, 2))
    pairs = {("S", "lt1Hz"): Pair(signal, None)}
    return SimpleNamespace(entry=SimpleNamespace(name=name), pairs=pairs, run=run, residual=signal)


def stated(name: str, sigma: float) -> list[Budget]:
    return [
        Budget(channel=channel, unit=unit, frame="S", band="lt1Hz", contributions=(), total=sigma, recording=name)
        for channel, unit in zip(WRENCH_CHANNELS, WRENCH_UNITS, strict=True)
    ]


def verdict(quiet: tuple[float, float], noisy: tuple[float, float], doubts: tuple[Doubt, ...] = ()) -> Requirement:
    """Judge two recordings, each with a peak and a sigma in N m, against 0.06 N m."""
    campaign = archived.campaign("EL089")
    requirement = replace(campaign.requirements[0], limit=0.06)
    runs = [recorded("quiet", quiet[0]), recorded("noisy", noisy[0])]
    budgets = [*stated("quiet", quiet[1]), *stated("noisy", noisy[1])]
    return judged(campaign, requirement, runs, budgets, doubts)


def test_a_channel_that_nothing_shows_to_respond_is_said_beside_the_verdict() -> None:
    met = replace_of(verdict((0.01, 0.001), (0.02, 0.001)), mute=("Tz",))
    assert conclusion([met]).sentence.endswith(" Nothing shows a response of Tz, only noise.")
    broken = replace_of(met, verdict="fail")
    assert "response" not in conclusion([broken]).sentence


def test_a_verdict_for_which_no_sign_was_tested_says_so() -> None:
    campaign = archived.campaign("EL089")
    runs, budgets = [recorded("test", 0.01)], stated("test", 0.001)
    blind = judged(campaign, campaign.requirements[0], runs, budgets, unconfirmed=WRENCH_CHANNELS)
    assert "No sign and no axis was tested" in conclusion([blind]).sentence
    seen = judged(campaign, campaign.requirements[0], runs, budgets, unconfirmed=WRENCH_CHANNELS[:5])
    assert "No sign" not in conclusion([seen]).sentence


def test_a_silent_channel_that_may_be_swapped_with_a_loud_one_meets_nothing() -> None:
    campaign = archived.campaign("EL089")
    about_x = replace(campaign.requirements[0], limit=0.06, axes=("x", "z"))
    runs, budgets = [recorded("test", 0.07)], stated("test", 0.001)
    found = judged(campaign, about_x, runs, budgets, mute=("Tx",), unconfirmed=("Tx", "Ty"))
    assert found.verdict == "undecided" and "Tx, and Ty, which is not judged" in found.doubt
    assert judged(campaign, about_x, runs, budgets, mute=("Tx",), unconfirmed=("Tx",)).verdict == "pass", (
        "gravity is Ty"
    )
    assert judged(campaign, about_x, runs, budgets, unconfirmed=("Tx", "Ty")).verdict == "pass", "Tx responds"


def both_ways(moved: float, together: float, chi_square: float = 1.0) -> Requirement:
    """Judge a peak that is `moved` by measured forces, +- 0.006 N m, and by all six channels `together`, +- 0.001."""
    campaign, one = archived.campaign("EL089"), recorded("test", moved)
    likely = Together(
        recorded("test", together).pairs["S", "lt1Hz"].measured, np.full(6, 1e-3), np.zeros(6), chi_square
    )
    requirement = replace(campaign.requirements[0], limit=0.06)
    return judged(campaign, requirement, [one], stated("test", 0.006), together={("test", "lt1Hz"): likely})


def test_all_six_channels_at_once_count_where_they_agree_with_what_was_moved() -> None:
    found = both_ways(0.018, 0.004)
    assert (found.verdict, found.value, found.sigma) == ("pass", pytest.approx(0.004), pytest.approx(0.001))
    assert found.together
    (way,) = [one for one in found.ways if one.channel == "Ty"]
    assert way.agree and way.moved[0] == pytest.approx(0.018) and way.together[0] == pytest.approx(0.004)
    said = conclusion([found]).sentence
    assert "By all six channels at once; moved by the measured forces, it is 0.0180" in said


@pytest.mark.parametrize(("moved", "together"), [(0.1, 0.004), (0.004, 0.1)])
def test_where_the_two_disagree_the_worse_counts(moved: float, together: float) -> None:
    found = both_ways(moved, together)
    assert (found.verdict, found.value, found.together) == ("fail", pytest.approx(0.1), together > moved)
    assert "They disagree, so the worse counts." in conclusion([found]).sentence


def test_channels_that_rigid_bodies_do_not_explain_count_as_moved() -> None:
    found = both_ways(0.018, 0.004, chi_square=10.4)
    assert (found.value, found.together, found.ways) == (pytest.approx(0.018), False, ())


def test_what_is_not_known_of_a_gain_counts_in_both_ways() -> None:
    campaign, one = archived.campaign("EL089"), recorded("test", 0.05)
    grows = BudgetItem(stage="transducer", source="gain", sigma=0.05 * 0.1 * 0.05, grows=True)  # of an rms of 0.05 / 10
    budgets = [replace_of(row, contributions=(grows,), total=0.006) for row in stated("test", 0.006)]
    likely = Together(one.pairs["S", "lt1Hz"].measured, np.full(6, 1e-3), np.zeros(6), 1.0)
    found = judged(campaign, campaign.requirements[0], [one], budgets, together={("test", "lt1Hz"): likely})
    assert found.together and found.sigma == pytest.approx(np.hypot(1e-3, 0.05 * 0.05), rel=0.01)


def test_a_lower_peak_that_is_less_well_known_decides() -> None:
    found = verdict((0.05, 0.001), (0.04, 0.02))
    assert (found.verdict, found.recording, found.channel) == ("undecided", "noisy", "Ty")
    assert (found.value, found.sigma) == pytest.approx((0.04, 0.02))
    assert (found.low, found.high) == pytest.approx((0.0, 0.08))


def test_a_recording_that_fails_is_told_before_one_that_may() -> None:
    found = verdict((0.07, 0.0005), (0.05, 0.02))
    assert (found.verdict, found.recording) == ("fail", "quiet")
    assert found.low is not None and found.low > found.limit


def test_others_noise_does_not_widen_a_well_known_recording() -> None:
    found = verdict((0.05, 0.001), (0.01, 0.01))
    below = coverage_below("peak", [one.pairs["S", "lt1Hz"].measured for one in (recorded("", 0.0),) * 2], BAND)
    assert (found.verdict, found.recording) == ("pass", "quiet")
    assert (found.low, found.high) == pytest.approx((0.05 - 0.001 * below, 0.052))
    (channel,) = [one for one in found.channels if one.channel == "Ty"]
    assert (channel.low, channel.high, channel.sigma) == (found.low, found.high, found.sigma)


def test_a_doubt_forbids_met_and_may_forbid_not_met() -> None:
    small, large = ((0.05, 0.001), (0.01, 0.01)), ((0.07, 0.0005), (0.05, 0.02))
    found = verdict(*small, (Doubt("so", of_failed=False),))
    assert (found.verdict, found.doubt) == ("undecided", "so")
    assert verdict(*large, (Doubt("so", of_failed=False),)).verdict == "fail"
    assert verdict(*large, (Doubt("so"),)).verdict == "undecided"


def test_short_gaps_widen_the_interval_of_their_recording_by_what_a_line_may_err() -> None:
    campaign = archived.campaign("EL089")
    plain, wide = (
        judged(campaign, campaign.requirements[0], [recorded("a", 0.05, gaps)], stated("a", 1e-4))
        for gaps in ((), [(1.0, 1.1), (3.0, 5.0)])
    )
    assert plain.value == wide.value
    error = (2.0 * np.pi * 0.1) ** 2 / 8.0 * 0.2
    assert plain.sigma == pytest.approx(1e-4) and wide.sigma == pytest.approx(np.hypot(1e-4, error * 0.05))


def test_what_is_not_known_of_a_gain_counts_at_the_peak() -> None:
    campaign, one = archived.campaign("EL089"), recorded("a", 0.05)
    rms = 0.05 / np.sqrt(100.0)
    budgets = [
        replace_of(
            row,
            total=float(np.hypot(1e-4, 0.03 * rms)),
            contributions=(
                BudgetItem(stage="noise", source="", sigma=1e-4),
                BudgetItem(stage="cross-coupling", source="", sigma=0.03 * rms, grows=True),
            ),
        )
        for row in stated("a", 0.0)
    ]
    found = judged(campaign, campaign.requirements[0], [one], budgets)
    assert found.sigma == pytest.approx(np.hypot(1e-4, 0.03 * 0.05))


def test_what_may_be_a_knock_is_judged_where_both_ways_agree() -> None:
    met, broken = verdict((0.02, 0.001), (0.02, 0.001)), verdict((0.08, 0.001), (0.02, 0.001))
    assert decided([met, broken], [broken, met], ["", ""]) == (met, broken)
    assert decided([met], [met], ["a knock"]) == (met,) and decided([broken], [broken], ["a knock"]) == (broken,)
    for one, other in ((met, [broken]), (broken, [met]), (met, [])):
        (found,) = decided([one], other, ["a knock"])
        assert (found.verdict, found.doubt, found.value) == ("undecided", "a knock", one.value)


@pytest.mark.parametrize(("at", "told"), [(92, True), (60, True), (30, False), (99, False)])
def test_what_was_recorded_next_to_an_end_or_a_gap_forbids_met_and_is_in_no_figure(at: int, told: bool) -> None:
    """Of five seconds the first ones are known; at 1.5 s there is nothing, and beside it the band is not known."""
    campaign = archived.campaign("EL089")
    one = recorded("a", 0.01)
    signal = one.pairs["S", "lt1Hz"].measured
    signal.values[at, 4] = 0.2
    recorded_at = np.ones(100, dtype=bool)
    recorded_at[[*range(25, 35), *range(90, 100)]] = False
    known = np.arange(100) < 20
    known[40:55] = True
    one.pairs["S", "lt1Hz"] = Pair(replace(signal, valid=known), None)
    one.residual = replace(signal, valid=recorded_at)
    found = judged(campaign, campaign.requirements[0], [one], stated("a", 1e-4))
    assert found.value == 0.01
    assert found.verdict == ("undecided" if told else "pass")
    what = (
        f"whether Ty of a stays within 0.06 N m at {0.05 * at:.2f} s is not known: about 0.2000 +- 0.0002 N m by what"
    )
    assert not told or found.doubt.startswith(what)
