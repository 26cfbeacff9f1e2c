"""Units drawn from the uncertainties of a rig, and what is concluded from a sample of outcomes."""

import itertools
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import kstest, norm

from kbs_process.campaign.load import load_campaign
from kbs_process.plant.laws import select
from kbs_process.plant.sampling import draw, uncertain, values
from kbs_process.rig.model import substitute
from kbs_process.studies.flight.propagation import by_chance, importance, probability, upper_bound
from kbs_process.studies.flight.unit import in_orbit

pytestmark = pytest.mark.slow

EL089 = Path(__file__).parents[3] / "campaigns" / "EL089"


@pytest.fixture(scope="module")
def campaign():
    return load_campaign(EL089, checksums=False, flight=True)


@pytest.fixture(scope="module")
def numbers(campaign):
    return uncertain(in_orbit(campaign.rig), select(campaign.effects))


def test_every_uncertain_number_of_the_article_and_none_of_the_bench_is_drawn(campaign, numbers):
    names = {number.name for number in numbers}
    assert {"joint.el.drive.Ka", "joint.az.drive.phi_cog", "body.antenna.mass", "body.antenna.cog[2]"} <= names
    assert not any(name.startswith(("transducer", "gravity")) for name in names)
    assert "joint.el.drive.ratio" not in names  # exact


def test_drawn_numbers_have_their_stated_mean_and_sigma(numbers):
    drawn = draw(numbers, 4000, seed=1)
    for number, column in zip(numbers, drawn.T, strict=True):
        assert column.std() == pytest.approx(number.sigma, rel=0.03), number.name
        if number.cyclic:
            assert column.mean() == pytest.approx(0.0, abs=0.01)
        else:  # a lognormal number's median is its value
            assert np.median(column) == pytest.approx(number.value, abs=0.01 * number.sigma), number.name


def test_a_phase_of_which_nothing_is_known_is_uniform_and_a_stiffness_is_positive(numbers):
    drawn = dict(zip((n.name for n in numbers), draw(numbers, 2000, seed=2).T, strict=True))
    assert kstest(drawn["joint.el.drive.phi_stat"], "uniform", (-np.pi, 2 * np.pi)).pvalue > 0.9  # evenly spread
    assert np.log(drawn["joint.el.drive.Ka"] / 1.2e4).std() == pytest.approx(0.125, rel=0.03)
    assert drawn["joint.el.drive.Ts0"].min() > 0.0


def test_the_same_seed_gives_the_same_units_and_another_one_others(numbers):
    assert np.array_equal(draw(numbers, 20, 3), draw(numbers, 20, 3))
    assert not np.array_equal(draw(numbers, 20, 3), draw(numbers, 20, 4))


def test_a_drawn_row_reaches_the_rig(campaign, numbers):
    row = draw(numbers, 2, seed=0)[1]
    rig = substitute(campaign.rig, values(campaign.rig, numbers, row))
    for number, value in zip(numbers, row, strict=True):
        assert rig.quantities()[number.quantity].value[number.index] == value


def test_in_orbit_there_is_no_gravity_and_no_elastic_bench(campaign):
    rig = in_orbit(campaign.rig)
    assert float(rig.gravity) == 0.0
    assert rig.transducer.stiffness is None
    assert rig.bodies == campaign.rig.bodies


def test_the_interval_of_a_probability_covers_at_its_nominal_rate():
    rng = np.random.default_rng(5)
    for true in (0.5, 0.8, 0.95, 0.99):
        counts = rng.binomial(100, true, 2000)
        found = {count: probability(int(count), 100) for count in np.unique(counts)}
        covered = np.mean([found[count].low <= true <= found[count].high for count in counts])
        assert 0.92 < covered <= 1.0, true


def test_the_bound_holds_the_content_with_the_confidence():
    rng = np.random.default_rng(6)
    bounds = [upper_bound(rng.standard_normal(100), 0.95, 0.95) for _ in range(2000)]
    held = np.mean(norm.cdf(np.array(bounds)) >= 0.95)
    assert 0.94 < held < 0.985  # ranks are whole: 95 % or a little more
    assert upper_bound(np.zeros(58), 0.95, 0.95) is None
    assert upper_bound(np.arange(59.0), 0.95, 0.95) == 58.0


def test_importance_finds_what_matters_and_chance_is_bounded():
    rng = np.random.default_rng(7)
    x = rng.standard_normal((200, 30))
    phase = rng.uniform(-np.pi, np.pi, 200)
    cyclic = np.array([False] * 30 + [True])
    outcome = np.exp(x[:, 4] + 0.7 * np.cos(phase - 1.0))  # neither linear nor monotone in the phase
    shares = importance(np.column_stack([x, phase]), cyclic, outcome)
    assert set(np.flatnonzero(shares > by_chance(200, 31))) == {4, 30}
    false = [
        importance(rng.standard_normal((200, 30)), np.zeros(30, dtype=bool), rng.standard_normal(200)).max()
        > by_chance(200, 30)
        for _ in range(300)
    ]
    assert np.mean(false) < 0.09


def test_any_share_may_be_chance_for_three_units_and_less_for_more() -> None:
    assert by_chance(2, 31) == by_chance(3, 31) == 1.0
    shares = [by_chance(n, 31) for n in (4, 10, 100, 1000)]
    assert all(0.0 < later < earlier <= 1.0 for earlier, later in itertools.pairwise(shares))
