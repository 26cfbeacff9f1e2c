"""A law has to take more of the recordings than two searches of the known numbers differ by."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis import bench
from diagnosis.selection.test_rounds import ROLES, screened, standing, with_cable
from kbs_process.diagnosis.acceptance.remains import missed, promises_little, taken, too_little
from kbs_process.diagnosis.experiments.experiment import Experiment
from kbs_process.diagnosis.experiments.floor import declared
from kbs_process.diagnosis.experiments.thresholds import LEAST_RHO, TAKEN, TOLERATED
from kbs_process.diagnosis.nominal.joint import Standing, with_extra
from kbs_process.diagnosis.nominal.settling import detected
from kbs_process.diagnosis.proposing import view as views
from kbs_process.diagnosis.proposing.tryout import extra_of
from kbs_process.diagnosis.proposing.view import View
from kbs_process.diagnosis.selection import rounds

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def made() -> Experiment:
    return bench.experiment(bench.rig(), ROLES, 3)


@pytest.fixture(scope="module")
def cabled(made: Experiment) -> Experiment:
    return with_cable(made, (0, 1, 2))


def seen(before: Standing) -> tuple[View, Standing]:
    """The screen, and what is believed with its best suspect."""
    tried, scene, found = screened(before)
    after = with_extra(
        before, extra_of(found.candidates[0], before, tried, scene), bench.serial(before.known.experiment)
    )
    return View(before, tried, scene, (), found), after


def weaker(made: Experiment, cabled: Experiment, share: float) -> Experiment:
    """The experiment with a share of what the cable does."""
    trials = tuple(
        replace(bare, measured=bare.measured + share * (full.measured - bare.measured))
        for bare, full in zip(made.trials, cabled.trials, strict=True)
    )
    return replace(made, trials=trials)


def test_a_law_that_takes_nearly_all_is_one(cabled: Experiment) -> None:
    floor = declared(cabled)
    before = standing(cabled)
    view, after = seen(before)
    there, here = (detected(one, floor, cabled.fit) for one in (before, after))
    assert there.left and not here.left
    assert too_little(before, after, floor) == ()
    assert taken(there, here) == pytest.approx(1.0, abs=0.05)
    assert promises_little(view, there) == ""
    # a screen's gain over the rows of the mean is what the power over the floor falls by
    assert view.able[0].score.gain / there.rows[0] == pytest.approx(there.ratio - here.ratio, rel=0.3)
    assert there.ratios == {0: pytest.approx(there.ratio)}


def test_a_law_that_takes_as_much_as_searches_differ_by_is_none(made: Experiment, cabled: Experiment) -> None:
    floor = declared(made)
    plain, strong = (detected(standing(one), floor, made.fit) for one in (made, cabled))
    share = np.sqrt(0.2 * TOLERATED / (strong.ratio - plain.ratio))
    before, after = standing(weaker(made, cabled, float(share))), standing(made)
    assert not detected(before, floor, made.fit).left
    (reason,) = too_little(before, after, floor)
    assert "of the repeatability's power" in reason


@pytest.mark.parametrize(("gained", "reasons"), [(0.9 * LEAST_RHO**2, 1), (1.1 * LEAST_RHO**2, 0)])
def test_a_law_that_brings_pulled_numbers_back_has_to_be_likelier_than_they_are(
    made: Experiment, gained: float, reasons: int
) -> None:
    """Where nothing is left, by as much as any law has to bring."""
    floor, here = declared(made), standing(made)
    known = here.known
    prior = known.parameters
    far = replace(prior, value=prior.value - 8.0 * np.where(known.stated, prior.sigma, 0.0))
    # As if recordings told all of them.
    pulled = replace(here, known=replace(known, parameters=far, covariance=1e-2 * known.covariance))
    assert pulled.known.strained and not detected(pulled, floor, made.fit).left
    more = pulled.known.cost - known.cost - gained  # is to be left of recordings that are fitted
    assert more > 0.0
    times = np.sqrt(1.0 + more / float(known.chi2[list(made.fit)].sum()))
    with_it = replace(here, known=replace(known, residual=tuple(times * z for z in known.residual)))
    assert len(too_little(pulled, with_it, floor)) == reasons


def test_nothing_is_simulated_that_promises_as_little(cabled: Experiment) -> None:
    view, _ = seen(standing(cabled))
    there = detected(view.standing, declared(cabled), cabled.fit)
    times = view.able[0].score.gain / (0.3 * TOLERATED) / there.rows[0]
    long = replace(there, cells=tuple(replace(cell, rows=times * cell.rows) for cell in there.cells))
    assert promises_little(view, long) == ""  # there is something to explain
    assert "minima" in promises_little(view, replace(long, ratio=1.0))
    assert promises_little(view, replace(there, ratio=1.0)) == ""
    # along one of two trajectories it may be much
    short = tuple(replace(cell, trajectory=1) for cell in there.cells)
    assert promises_little(view, replace(long, cells=(*long.cells, *short), ratio=1.0)) == ""
    assert len(long.rows) == 1 and replace(long, cells=(*long.cells, *short)).rows[1] == there.rows[0]


def test_a_law_that_leaves_most_follows_something_else(cabled: Experiment, made: Experiment) -> None:
    floor = declared(cabled)
    share = 1.0 - np.sqrt(1.0 - 0.5 * TAKEN)
    before, after = standing(cabled), standing(weaker(made, cabled, float(1.0 - share)))
    (reason,) = too_little(before, after, floor)
    assert "follows another cause" in reason
    assert too_little(before, after, floor, more=True) == ()  # one more action of what that is
    assert missed(before.known, after.known) == ()  # an eighth of what was not fitted is enough


def test_a_law_has_to_take_as_much_of_recordings_that_were_not_used(cabled: Experiment, made: Experiment) -> None:
    before, after = standing(cabled), standing(with_cable(made, (2,)))
    assert too_little(before, after, declared(cabled)) == ()  # another law may be what the held-out one shows
    (reason,) = missed(before.known, after.known)
    assert reason == "takes 0 % of the excess of r2"


@pytest.mark.parametrize(("strength", "verdict"), [(0.0, "none"), (8.0, "undecided")])
def test_what_held_out_recordings_alone_show_is_said_to_be_there(
    made: Experiment, strength: float, verdict: str
) -> None:
    floor = declared(made)
    here = standing(weaker(made, with_cable(made, (2,)), strength))
    there = detected(here, floor, made.fit)
    outcome = rounds.diagnose(here.known, floor, bench.serial(made), there)
    assert outcome.verdict == verdict and not outcome.finds
    assert outcome.unforeseen == bool(strength) and not there.left


@pytest.mark.parametrize(("sigmas", "elsewhere"), [(3.0, False), (40.0, False), (40.0, True)])
def test_a_law_beside_numbers_that_stayed_is_likelier_than_numbers_beyond_belief(
    made: Experiment, cabled: Experiment, monkeypatch: pytest.MonkeyPatch, sigmas: float, elsewhere: bool
) -> None:
    """Numbers that explain all, some sigmas from their prior, against those that leave a cable to be found.

    Of all suspects two do: each that is tried in the plant is compiled.
    """
    every = views.suspects_of
    few = lambda *given: [one for one in every(*given) if one.family[0] in ("ground_cable", "harness")]  # noqa: E731
    monkeypatch.setattr(views, "suspects_of", few)
    floor = declared(made)
    near, explained = standing(cabled).known, standing(made).known
    stiffness = explained.names.index("joint.el.drive.Ka")
    value = explained.value.copy()
    value[stiffness] += sigmas * explained.parameters.sigma[stiffness]
    far = replace(explained, value=value)
    monkeypatch.setattr(rounds, "refit", lambda *_, **__: explained if elsewhere else far)
    there = detected(standing(made), floor, made.fit)
    outcome = rounds.diagnose(far, floor, bench.serial(cabled), there, near)
    if elsewhere or sigmas**2 < LEAST_RHO**2:
        assert not outcome.finds and outcome.verdict == "none" and not outcome.otherwise
        assert outcome.known.cost == (explained if elsewhere else far).cost
        return
    assert outcome.verdict == "physics" and outcome.known is near
    (moved,) = outcome.otherwise
    assert moved.name == "joint.el.drive.Ka" and moved.sigmas == pytest.approx(sigmas)
