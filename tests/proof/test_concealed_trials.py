"""Trials: drawn alike whatever is concealed, made twice alike, telling nothing by names, sizes and numbers."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from engine.hardware import Hardware
from engine.ports import NONE
from proof.concealed import paths, ranges, trials
from proof.concealed.effects import PHYSICS
from proof.concealed.ranges import Phase, Range, share
from proof.concealed.recording import record
from proof.concealed.trials import Spec

pytestmark = pytest.mark.slow


def test_more_trials_begin_with_the_same_ones_and_every_physics_comes() -> None:
    many = trials.draw("development", 300, 4)
    assert trials.draw("development", 20, 4) == many[:20]
    first = {spec.physics[k] for spec in many for k in range(spec.count)}
    assert first == {physics.name for physics in PHYSICS}
    kinds = [spec.kind for spec in many]
    assert all(kinds.count(kind) > 10 for kind in ("nothing", "within", "beyond"))
    assert {spec.count for spec in many} == {0, 1, 2, 3}
    assert trials.draw("development", 20, 5) != many[:20]


def test_splits_draw_from_different_ranges() -> None:
    rng = np.random.default_rng(0)
    development, validation = ([share(rng, split) for _ in range(500)] for split in ("development", "validation"))
    assert all(0.3 <= u <= 0.7 for u in development)
    assert all(not 0.3 < u < 0.7 for u in validation)
    assert min(validation) < 0.02 and max(validation) > 0.98
    assert Phase().draw(rng, "validation") != Phase().draw(rng, "validation")


@pytest.mark.parametrize("split", ["development", "validation"])
def test_trajectories_stay_within_the_limits_and_move_both_axes(split: ranges.Split) -> None:
    for seed in range(30):
        drawn = paths.draw(np.random.default_rng(seed), split, 3)
        assert len(drawn) == 3
        assert all(np.all(np.ptp(path.position, axis=0) > 0.02) for path in drawn[:1])
        assert all(55.0 < path.t[-1] < 90.0 for path in drawn)


def files(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


def test_a_trial_comes_out_the_same_and_says_nothing_of_what_it_conceals(short: None, tmp_path: Path) -> None:
    within = trials.make(Spec("development", 3, 1, "within"), tmp_path / "a" / "x")
    spec = trials.chosen("development", 3, 1, ["channel that creeps"], 40.0)
    hidden = trials.make(spec, tmp_path / "b" / "x")
    again = trials.make(spec, tmp_path / "c" / "x")
    assert hidden == again and files(tmp_path / "b") == files(tmp_path / "c")
    assert within["kind"] == "within" and not within["effects"] and within["rho_eff"] == 0.0
    assert hidden["kind"] == "concealed" and hidden["effects"][0]["rho_eff"] == pytest.approx(40.0, rel=0.25)

    null, full = files(tmp_path / "a"), files(tmp_path / "b")
    assert null.keys() == full.keys()
    for name, content in null.items():
        if name.endswith(".mcap"):
            assert len(full[name]) == pytest.approx(len(content), rel=0.04)
        elif not name.endswith("campaign.toml"):
            assert full[name] == content
    described = [tomllib.loads(part["x/campaign.toml"].decode()) for part in (null, full)]
    for description in described:
        for entry in description["recording"]:
            del entry["sha256"]
    assert described[0] == described[1]
    roles = [entry["role"] for entry in described[0]["recording"]]
    assert roles == ["calibration", "fit", "fit", "fit", "fit", "held-out", "held-out"]
    assert described[0]["recording"][-1]["trajectory"] not in {
        entry["trajectory"] for entry in described[0]["recording"] if entry["role"] == "fit"
    }
    assert Range(1.0, 2.0).draw(np.random.default_rng(0), "development") < 2.0


def test_no_kind_of_null_has_just_the_nominal_numbers() -> None:
    nominal = Hardware.from_campaign(Path(__file__).parents[2] / "campaigns" / "EL089")
    for kind, most in (("nothing", 0.2), ("within", 4.0)):
        drawn = trials.hardware_of(kind, nominal, np.random.default_rng(4))  # type: ignore[arg-type]
        name = "joint.el.drive.Ka"
        away = abs(float(drawn[name] - nominal[name]) / float(nominal.sigmas[name]))
        assert 0.0 < away < most
        assert drawn.scalar("joint.el.drive.phi_cog") != nominal.scalar("joint.el.drive.phi_cog")


def test_when_messages_were_logged_says_nothing_of_what_their_clock_does() -> None:
    hardware = Hardware.from_campaign(Path(__file__).parents[2] / "campaigns" / "EL089", seed=5)
    path = paths.calibration(np.random.default_rng(0)).until(12.0)
    made = {}
    for clocks in ({}, {"wrench": lambda t: 0.05 * np.sin(0.8 * t)}):
        run = np.random.SeedSequence(1)
        made[bool(clocks)] = record(
            hardware, path, replace(NONE, clocks=clocks), seed=run, epoch_ns=0, wrench_hz=100.0, encoder_hz=50.0
        )
    moved = made[True].wrench.stamp - made[False].wrench.stamp
    assert np.ptp(moved) > 9e7  # ns
    for recording in made.values():
        late = 1e-9 * (recording.wrench.log - recording.wrench.stamp)
        slow = np.convolve(late, np.ones(100) / 100.0, mode="valid")
        assert np.ptp(slow) < 1e-3
