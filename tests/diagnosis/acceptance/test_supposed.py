"""Two laws of which neither passes alone: one is supposed, and both have to pass beside each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from diagnosis import bench
from diagnosis.selection.test_rounds import ROLES, passed, screened, standing, with_cable
from kbs_process.diagnosis.acceptance.finding import Tried
from kbs_process.diagnosis.acceptance.needed import Accepted
from kbs_process.diagnosis.acceptance.supposed import Noted, enough, supposed, wanting
from kbs_process.diagnosis.experiments.experiment import Experiment
from kbs_process.diagnosis.experiments.floor import declared
from kbs_process.diagnosis.experiments.thresholds import MOSTLY_DONE, PROMISED, TAKEN, WAYS
from kbs_process.diagnosis.nominal.joint import Own, Standing
from kbs_process.diagnosis.nominal.known import Known
from kbs_process.diagnosis.selection import rounds
from kbs_process.diagnosis.selection.effort import Effort
from kbs_process.diagnosis.selection.proposed import Round

pytestmark = pytest.mark.slow


def leaving(known: Known, share: float) -> Known:
    """The same with residuals that leave a share of what it leaves beyond the noise."""
    left = share * known.excess + known.fit_rows
    size = np.sqrt(left / (known.excess + known.fit_rows))
    return replace(known, residual=tuple(size * one for one in known.residual))


@pytest.fixture(scope="module")
def made() -> Experiment:
    return with_cable(bench.experiment(bench.rig(), ROLES, 3), (0, 1, 2))


@pytest.fixture(scope="module")
def cable(made: Experiment) -> Standing:
    return standing(made)


@pytest.fixture(scope="module")
def laws(cable: Standing) -> dict[str, Tried]:
    tried, scene, found = screened(cable)
    return {law: passed(cable, tried, scene, found, law) for law in ("ground_cable", "harness")}


def with_left(one: Tried, before: Known, share: float) -> Tried:
    known = one.standing.known
    scaled = leaving(before, share).residual
    return replace(one, standing=replace(one.standing, known=replace(known, residual=scaled)))


def test_those_are_supposed_that_take_some_the_one_that_leaves_least_first(
    cable: Standing, laws: dict[str, Tried]
) -> None:
    known = cable.known
    assert known.gross
    more, less = with_left(laws["harness"], known, 0.3), with_left(laws["ground_cable"], known, 0.6)
    little = with_left(laws["ground_cable"], known, 1.01 - TAKEN)
    assert supposed([less, more], known) == [more, less]
    assert supposed([less, more, with_left(laws["harness"], known, 0.4)], known) == [more, less]
    assert len(supposed([less, more], known)) <= WAYS
    assert supposed([little], known) == []
    # What was taken off each recording has no numbers that go on, and where little is left nothing hides another.
    assert supposed([replace(more, own=Own((), ()))], known) == []
    assert supposed([less, more], leaving(known, 0.5 * known.fit_rows / known.excess)) == []


def test_two_leave_enough_where_they_leave_little(cable: Standing) -> None:
    known = cable.known
    assert enough(known, leaving(known, 0.99 - MOSTLY_DONE))
    assert not enough(known, leaving(known, 1.01 - MOSTLY_DONE))
    assert wanting(known, leaving(known, 0.5)) == pytest.approx((0.5 - 1.0 + MOSTLY_DONE) * known.excess)


@pytest.mark.parametrize(
    ("left", "alone"), [((0.15, 0.1), False), ((0.15, 0.3), False), ((0.5, 0.1), False), ((0.15, 0.1), True)]
)
def test_each_of_a_pair_has_to_be_found_beside_the_other(
    cable: Standing, laws: dict[str, Tried], monkeypatch: pytest.MonkeyPatch, left: tuple[float, float], alone: bool
) -> None:
    """`left` by both, in either order; `alone`: the supposed law is not found again beside the other."""
    known, made = cable.known, cable.known.experiment
    first, second = laws["ground_cable"], laws["harness"]
    refused = first.gate.but("predicted worse")
    noted = Noted()
    noted.fell(replace(with_left(first, known, 0.5), gate=refused))
    assert [one.identity.law for one in noted.refused] == ["ground_cable"]
    asked: list[list[str]] = []

    def look(
        here: Standing, seen: Standing, _: object, __: object, accepted: Sequence[Accepted], least: float = 0.0
    ) -> Round:
        asked.append([one.find.identity.law for one in accepted])
        wanted = wanting(known, here.known) if len(asked) == 1 else 0.0
        assert least == pytest.approx(wanted)
        share = left[len(asked) - 1]
        one = second if len(asked) == 1 else first
        there = replace(here, known=leaving(known, share))
        told = rounds.find_of([one], np.ones(1), cable, None)
        found = None if alone and len(asked) == 2 else Accepted(replace(one, standing=there), told, here)
        return Round(found, there, seen, one.screening, Noted(), None)

    monkeypatch.setattr(rounds, "_round", look)
    for name in ("without", "bare"):
        monkeypatch.setattr(rounds, name, lambda here, *_: here)
    empty = Round(None, cable, cable, first.screening, noted, None)
    over = Effort(bench.serial(made), known)
    monkeypatch.setattr(over, "goes_on", lambda: False)
    assert rounds._pair(empty, declared(made), over, []) == () and not asked
    pair = rounds._pair(empty, declared(made), Effort(bench.serial(made), known), [])
    assert asked[0] == ["ground_cable"]
    if left[0] > 1.0 - MOSTLY_DONE:
        assert len(asked) == 1
    else:
        assert asked[1] == ["harness"]
    if alone or max(left) > 1.0 - MOSTLY_DONE:
        assert pair == ()
    else:
        assert [one.accepted.find.identity.law for one in pair if one.accepted] == ["harness", "ground_cable"]


@pytest.mark.parametrize("hopeful", [False, True])
def test_no_law_is_simulated_where_the_best_would_leave_far_too_much(
    cable: Standing, monkeypatch: pytest.MonkeyPatch, hopeful: bool
) -> None:
    tried, scene, found = screened(cable)
    law = passed(cable, tried, scene, found, "ground_cable")
    floor = declared(cable.known.experiment)
    simulate = Effort(bench.serial(cable.known.experiment), cable.known)
    view = SimpleNamespace(able=[law.found], unrepeated=[], standing=cable, screening=SimpleNamespace(candidates=()))
    monkeypatch.setattr(rounds, "leaders", lambda *_: ([law.found], []))
    monkeypatch.setattr(rounds, "tried", lambda *_: ([law], []))
    noted = Noted()
    least = (0.9 if hopeful else 1.1) * PROMISED * law.found.score.gain
    simulated = list(rounds._passed(view, cable, floor, simulate, [], noted, least))
    assert simulated == ([[law]] if hopeful else [])
    assert ["would leave far too much" in "".join(one.reasons) for one in noted.refused] == [True] * (not hopeful)
