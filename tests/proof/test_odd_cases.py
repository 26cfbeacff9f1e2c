"""Odd campaigns: the table says what is right and wrong of each, and what is odd is really in the files."""

from __future__ import annotations

import json
import re
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

from engine.ports import OUT
from proof.concealed import paths
from proof.odd import aslant, latch, maker, motions
from proof.odd.__main__ import main
from proof.odd.cases import BY_NUMBER, CASES, Case
from proof.truth import Truth

pytestmark = pytest.mark.slow


def altered(number: str, **odd: Any) -> Case:
    """A case with some entries of its own."""
    return msgspec.structs.replace(BY_NUMBER[number], **odd)


def described(folder: Path) -> dict[str, Any]:
    return tomllib.loads((folder / "campaign.toml").read_text())


def messages(folder: Path, file: str) -> dict[str, list[Any]]:
    """Messages of a recording by topic."""
    found: dict[str, list[Any]] = {}
    with (folder / file).open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        for _, channel, _, message in reader.iter_decoded_messages():
            found.setdefault(channel.topic, []).append(message)
    return found


def test_every_case_says_which_answers_are_right_and_which_are_wrong() -> None:
    assert len(CASES) == len(BY_NUMBER) == len({case.name for case in CASES}) == 17
    for case in CASES:
        assert case.title and case.done.endswith(".") and case.right and case.wrong, case.number
        assert not set(case.right) & set(case.wrong), case.number
        assert len(case.bounds) in (0, case.trajectories)
        assert all(one.physics in maker.PHYSICS for one in case.effects)
        told = maker.truth(case)
        truth = msgspec.convert({key: told[key] for key in told.keys() & set(Truth.__struct_fields__)}, Truth)
        assert len(truth.effects) == len(case.effects) and len(truth.beyond) == len(case.moved)


def test_the_readme_lists_the_cases() -> None:
    text = (Path(maker.__file__).parent / "README.md").read_text()
    listed = re.findall(r"^\| (\d+[a-c]?) \| (A\d\d) \| ([^|]+) \|", text, flags=re.MULTILINE)
    assert [tuple(map(str.strip, row)) for row in listed] == [(c.number, c.name, c.title) for c in CASES]


def test_one_recording_only_and_the_same_bytes_again(short: None, tmp_path: Path) -> None:
    for attempt in ("first", "second"):
        main(["--only", "5", "--out", str(tmp_path / attempt)])
    folder = tmp_path / "first" / "A11"
    (entry,) = described(folder)["recording"]
    assert (entry["trajectory"], entry["role"], entry["repeat"]) == ("TRACK1", "fit", 1)
    assert [f"recordings/{file.name}" for file in (folder / "recordings").iterdir()] == [entry["file"]]
    assert described(tmp_path / "second" / "A11") == described(folder)
    truth = json.loads((tmp_path / "first-truth" / "A11.json").read_text())
    assert truth["effects"][0]["name"] == "Bouc-Wen cable to the ground" and truth["right"] and truth["wrong"]


def test_a_channel_stays_at_its_bound_but_not_in_the_calibration(short: None, tmp_path: Path) -> None:
    case = altered("11", bounds=(-0.25,), trajectories=1, runs=((-1, "calibration", 1), (0, "fit", 1)))
    maker.make(case, tmp_path / "x")
    calibration, bounded = (
        np.array([m.wrench.torque.z for m in messages(tmp_path / "x", entry["file"])["/transducer/wrench"]])
        for entry in described(tmp_path / "x")["recording"]
    )
    assert np.sum(bounded == bounded.max()) > 20 and bounded.max() == case.bounds[0] > bounded.min()
    assert calibration.max() > case.bounds[0]


@pytest.mark.parametrize(("encoder", "drive"), [("command in its place", "motion"), ("left out", "command")])
def test_no_encoders(encoder: Any, drive: str, short: None, tmp_path: Path) -> None:
    maker.make(altered("7b", encoder=encoder, runs=((0, "fit", 1),)), tmp_path / "x")
    campaign = described(tmp_path / "x")
    topics = messages(tmp_path / "x", campaign["recording"][0]["file"])
    assert set(topics) == {"/transducer/wrench", "/command", "/motor/field"}
    assert len(topics["/command"]) == 31
    assert campaign["drive"] == drive
    instead = campaign["topics"].get("encoder")
    assert instead == ({"topic": "/command", "fields": ["position[az]", "position[el]"]} if drive == "motion" else None)


def test_the_clip_goes_over_at_either_end_of_its_sector() -> None:
    effect = maker.effect(BY_NUMBER["12"].effects[0])
    acting = latch.extra(replace(effect, amplitude=2.0, shapes=(-0.1, 0.1, 0.01)))
    memory, torques = np.zeros((1, acting.states)), []
    for angle in (0.0, -0.2, 0.0, 0.09, 0.11, 0.0, -0.09, -0.11, 0.0):
        motion = np.zeros((3, 7))
        motion[0, 4] = angle
        for _ in range(500):
            out = np.zeros(OUT)
            acting.act(0.0, 1e-3, acting.numbers, memory, motion, np.zeros((2, 21)), out)
        torques.append(out[4])
    assert np.allclose(torques, 2.0 * np.array([-1, 1, 1, 1, -1, -1, -1, 1, 1]))


def test_a_spring_aslant_acts_along_its_own_axis_alone_and_holds_back() -> None:
    acting = aslant.extra(replace(maker.effect(BY_NUMBER["13"].effects[0]), amplitude=3.0, shapes=(2.0, 0.0, 2.0)))

    def torque(*phi: float) -> list[float]:
        motion, out = np.zeros((3, 7)), np.zeros(OUT)
        motion[0, :3] = phi
        acting.act(0.0, 1e-3, acting.numbers, np.zeros((1, acting.states)), motion, np.zeros((2, 21)), out)
        return list(out)

    assert np.allclose(torque(0.1, 0.0, 0.1)[:3], [-0.3, 0.0, -0.3]) and not any(torque(0.1, 0.0, 0.1)[3:])
    assert np.allclose(torque(0.1, 0.5, -0.1), 0.0)


def test_motions_rest_or_last_as_long_as_the_table_says() -> None:
    def drawn(number: str) -> list[paths.Commands]:
        rngs = (np.random.default_rng(k) for k in (1, 2))
        return motions.driven(BY_NUMBER[number], "development", *rngs)

    resting, long = drawn("10"), drawn("9")
    assert all(np.ptp(path.position, axis=0)[0] == 0.0 < np.ptp(path.position, axis=0)[1] for path in resting)
    assert [round(path.t[-1]) > 200 for path in long] == [False, True, False, False]
    assert long[1].t[-1] == 10800.0 and np.all(np.ptp(long[1].position, axis=0) > 0.2)
