"""The test that comes next: within limits, readable, and better at its question than what was recorded."""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from diagnosis import bench
from kbs_process.diagnosis.acceptance.gate import Gate
from kbs_process.diagnosis.acceptance.outcome import Alternative, Find
from kbs_process.diagnosis.experiments.floor import declared
from kbs_process.diagnosis.facts import Estimate, Identity, Place
from kbs_process.diagnosis.nominal.joint import Standing
from kbs_process.diagnosis.selection.next_test import Proposal, propose
from kbs_process.diagnosis.selection.trajectories import family, limits_of
from kbs_process.identification.output_error import Scalar
from kbs_process.reduction.commands import read_commands
from kbs_process.studies.diagnose.output import commands_of
from kbs_process.studies.diagnose.records import next_test

pytestmark = pytest.mark.slow

FREE = (Scalar("joint.el.drive.Ka"), Scalar("joint.el.drive.b_m"))
VISCOUS = Identity(Place("joint torque", "el"), "viscous", "joint_viscous")
COULOMB = Identity(Place("joint torque", "el"), "friction", "coulomb")


@pytest.fixture(scope="module")
def standing() -> Standing:
    return bench.standing(bench.experiment(bench.rig(), ("fit", "held-out"), 1), FREE)


def found(sigma: float, *rivals: Identity) -> Find:
    """Friction whose number is known to a standard deviation."""
    others = tuple(Alternative(rival, 0.4, 1.0, True, True) for rival in rivals)
    return Find(
        identity=VISCOUS,
        named=True,
        equation="",
        reference="",
        estimates=(Estimate("joint_viscous", "N m s/rad", 1.0, sigma),),
        probability=0.6,
        rho_eff=1.0 / sigma,
        kappa=0.0,
        gate=Gate(True, (), True, 20.0, (1.0, 1.0), ()),
        alternatives=others,
        ports_alike=(),
        held_out_variance=None,
        curve=None,
    )


def simulating(made):  # type: ignore[no-untyped-def]
    return nullcontext(bench.serial(made))


def test_trajectories_stay_where_the_rig_has_been_and_rest_at_both_ends(standing: Standing) -> None:
    experiment = standing.known.experiment
    limits = limits_of(experiment.drives, experiment.dt)
    every = family(limits, ("az", "el"), 100.0)
    assert len({one.words for one in every}) == len(every) == 18
    for one in every:
        s = one.schedule
        acceleration = np.abs(np.gradient(s.rate, s.t, axis=0)).max(axis=0)
        assert (s.position >= limits.low).all() and (s.position <= limits.high).all(), one.words
        assert (np.abs(s.rate) <= 1.001 * limits.rate).all(), one.words
        assert (acceleration <= 1.001 * limits.acceleration).all(), one.words
        assert np.abs(s.rate[[*range(10), *range(-5, 0)]]).max() < 1e-12, one.words
    assert all(one.words.startswith("el") for one in family(limits, ("az", "el"), 100.0, "el"))


def test_viscous_and_coulomb_friction_are_told_apart_by_changes_of_the_rate(standing: Standing) -> None:
    floor = declared(standing.known.experiment)
    proposal = propose(standing, [found(0.01, COULOMB)], floor, simulating)
    assert proposal is not None
    assert proposal.rivals == (COULOMB,)
    worth = [one.worth for one in proposal.tried]
    assert worth == sorted(worth, reverse=True)
    # At one slow rate the two are alike.
    slowest = next(one.worth for one in proposal.tried if "scans of the whole range at 0.06" in one.trajectory)
    assert worth[0] > 3.0 * slowest
    # Known parameters that are refitted take some of it.
    assert 0.0 < proposal.distance <= worth[0] * 1.001
    assert proposal.recordings == max(1, int(np.ceil((4.65 / proposal.distance) ** 2)))


@pytest.fixture(scope="module")
def proposal(standing: Standing) -> Proposal:
    """For a number that is known to a third."""
    made = propose(standing, [found(0.3)], declared(standing.known.experiment), simulating)
    assert made is not None
    return made


def test_a_number_that_is_weakly_known_is_measured_better(standing: Standing, proposal: Proposal) -> None:
    assert proposal.rivals == ()
    assert proposal.sigma < 0.9
    # What is known better by now gains less.
    better = propose(standing, [found(0.11)], declared(standing.known.experiment), simulating)
    assert better is not None
    assert proposal.sigma < better.sigma < 1.0


def test_what_an_encoder_alone_shows_is_measured_with_it(standing: Standing) -> None:
    """Where a joint moves in a planned recording, its encoder is looked at."""
    law = Identity(Place("encoder", "el"), "eccentricity", "encoder_eccentricity")
    numbers = {"eccentric_sin": 1e-4, "eccentric_cos": 5e-5}
    fitted = tuple(Estimate(name, "rad", value, 0.5 * value) for name, value in numbers.items())
    disc = replace(found(0.3), identity=law, estimates=(*fitted, Estimate("eccentric_order", "1", 300.0, 0.0)))
    proposal = propose(standing, [disc], declared(standing.known.experiment), simulating)
    assert proposal is not None
    assert proposal.sigma < 0.5


def test_its_commands_are_read_as_they_were_planned(standing: Standing, proposal: Proposal, tmp_path: Path) -> None:
    file = tmp_path / "next.csv"
    file.write_text(commands_of(proposal, standing.known.experiment.rig))
    read, planned = read_commands(file, ("az", "el")), proposal.trajectory.schedule
    np.testing.assert_allclose(read.position, planned.position, atol=1e-9)
    np.testing.assert_allclose(read.rate, planned.rate, atol=1e-9)
    record = next_test(proposal)
    assert record.sigma == proposal.sigma
    assert record.distance is None


def test_nothing_is_proposed_where_nothing_is_open(standing: Standing) -> None:
    floor = declared(standing.known.experiment)
    assert propose(standing, [found(0.01)], floor, simulating) is None
    assert propose(standing, [], floor, simulating) is None
    # Both were found: none of them stands for the other.
    both = [found(0.01, COULOMB), replace(found(0.01), identity=COULOMB)]
    assert propose(standing, both, floor, simulating) is None
    driven = standing.known.experiment
    still = replace(driven, drives=tuple(replace(one, schedule=None) for one in driven.drives))
    known = replace(standing.known, experiment=still)
    assert propose(replace(standing, known=known), [found(0.3)], floor, simulating) is None
