"""Every archived campaign gives the results that were committed for it.

After a change that is meant to change them: `python -m end_to_end.expected`, from tests/.
"""

from __future__ import annotations

import copy
from collections.abc import Callable

import pytest

from archived import each
from end_to_end.archive_run import Processed
from end_to_end.expected import EXPECTED_FOLDER, differences, expected, extract
from engine.campaigns import CAMPAIGNS


def test_every_campaign_has_them() -> None:
    assert {path.stem for path in EXPECTED_FOLDER.glob("*.json")} == set(CAMPAIGNS)


@pytest.mark.parametrize("name", each(CAMPAIGNS))
def test_results(archived: Callable[[str], Processed], name: str) -> None:
    found = list(differences(extract(archived(name)), expected(name)))
    assert len(found) > 300
    beyond = [f"{what}: {distance:.3g} of its limit" for what, distance in found if distance > 1.0]
    assert not beyond, "\n".join(beyond[:20])


def test_small_changes_are_seen() -> None:
    """A thousandth of a sigma of a fitted value, a thousandth of an rms, another verdict."""
    stated = expected("EL089")
    assert max(distance for _, distance in differences(stated, stated)) == 0.0
    *_, merit = stated
    moved = copy.deepcopy(stated)
    moved["parameters"]["body.antenna.cog[0]"][0] += 1e-3 * stated["parameters"]["body.antenna.cog[0]"][1]
    moved[merit]["EL089P00_2 lt1Hz S"]["Ty N m"][0] *= 1.001
    moved["verdict"] = "fail"
    beyond = {what for what, distance in differences(moved, stated) if distance > 1.0}
    assert beyond == {
        "verdict fail, expected pass",
        "body.antenna.cog[0]: value",
        "EL089P00_2 lt1Hz S Ty N m measured_rms",
    }
