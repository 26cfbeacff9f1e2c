"""How many intervals of known numbers hold the truth is counted against hardware that a trial's seed draws again."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from proof import coverage
from proof.answer import Moved
from proof.concealed import trials
from proof.concealed.trials import Spec

SPEC = Spec("development", 5, 0, "within")


def entry(name: str, prior: float, spread: float, value: float, sigma: float) -> dict[str, Any]:
    return {"name": name, "prior": prior, "prior_sigma": spread, "value": value, "sigma": sigma}


@pytest.fixture(scope="module")
def moved() -> list[dict[str, Any]]:
    """A drive's number told rightly, one of a matrix told wrongly, one of a vector hardly told."""
    nominal, true = coverage.hardware(SPEC)
    tmax = "joint.az.drive.parameters.Tmax"
    key = tmax if tmax in nominal.values else tmax.replace(".parameters", "")
    gain, cog = (name for name in ("transducer.cross_coupling", "body.antenna.cog"))
    spread = float(np.asarray(nominal.sigmas[key]))
    return [
        entry("joint.az.drive.Tmax", float(nominal[key]), spread, float(true[key]) + 0.1 * spread, 0.1 * spread),
        entry(f"{gain}[1][3]", nominal[gain][1, 3], 0.1, true[gain][1, 3] + 0.03, 0.01),
        entry(f"{cog}[2]", nominal[cog][2], 0.01, true[cog][2], 0.009),
    ]


def test_errors_are_told_in_sigmas_of_the_files(moved: list[dict[str, Any]]) -> None:
    found = list(coverage.numbers(moved, *coverage.hardware(SPEC)))
    assert [one.error for one in found] == pytest.approx([0.1, 0.3, 0.0], abs=1e-9)
    assert [(one.told, one.covered) for one in found] == [(True, True), (True, False), (False, True)]


def test_numbers_of_an_effect_that_was_found_are_none_of_the_rig(moved: list[dict[str, Any]]) -> None:
    found = entry("joint.el.drive.kinematic_sin", 0.0, 1e-2, 3e-4, 1e-6)
    assert len(list(coverage.numbers([*moved, found], *coverage.hardware(SPEC)))) == len(moved)
    told = Moved(name=found["name"], value=3e-4, sigma=1e-6, sigmas=0.03)
    assert not list(coverage.answered([told], *coverage.hardware(SPEC)))


def test_results_of_another_trial_are_refused(moved: list[dict[str, Any]]) -> None:
    with pytest.raises(ValueError, match="in the trial of that name"):
        list(coverage.numbers(moved, *coverage.hardware(Spec("development", 6, 0, "within"))))


def test_the_share_is_printed(moved: list[dict[str, Any]], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / trials.name_of(SPEC)
    folder.mkdir()
    (folder / "results.json").write_text(json.dumps({"answer": "none", "moved": moved}))
    asked = ["--seed", "5", "--count", "2", "--null", "within", str(tmp_path)]
    coverage.main(asked)
    said = capsys.readouterr().out
    assert "1 of 2  transducer.cross_coupling[1][3] +3.0" in said and "all: 1 of 2, 50 %" in said
    with pytest.raises(SystemExit, match="none of these"):
        coverage.main([*asked[:1], "6", *asked[2:]])
