"""What a method says reaches the score as it was meant, and what fails is told."""

from __future__ import annotations

from pathlib import Path
from typing import Any, TypeVar, get_args, get_origin

import msgspec
import pytest
from msgspec.structs import replace

from kbs_process.diagnosis.facts import Moved, Place
from kbs_process.plant.laws import CATALOGUE, SENSING
from kbs_process.results.records import Conclusion, Provenance, encode
from kbs_process.studies.diagnose.results import DiagnosisResults, Find, Fitted, Rival, Trial
from proof import answer
from proof.bundle import pack
from proof.diagnosis import answer_of
from proof.methods import Job, answer_trial
from proof.words import OURS, Family, Port

pytestmark = pytest.mark.slow

R = TypeVar("R", bound=msgspec.Struct)


def filled(record: type[R], **given: Any) -> R:
    """A record of which only what the translation reads is given; all else is empty."""
    empty = {float: 0.0, str: "", bool: True}
    rest = {
        field.name: empty.get(field.type, () if get_origin(field.type) is tuple else {})
        for field in msgspec.structs.fields(record)
        if field.required and field.name not in given
    }
    return record(**rest, **given)


def rival(family: str, place: Place, distance: float, probability: float) -> Rival:
    return filled(Rival, family=family, place=place, distance=distance, probability=probability)


def results(port: str = "motor torque") -> DiagnosisResults:
    motor, channel = Place(port=port, site="el"), Place(port="transducer", site="Tx<-Fz")
    find = filled(
        Find,
        family="motor order",
        place=motor,
        parameters=(Fitted(name="amplitude", unit="N m", value=2.0, sigma=0.1, low=1.8, high=2.2),),
        probability=0.9,
        rivals=(rival("cross-coupling", channel, 80.0, 0.01), rival("cogging", motor, 3.0, 0.09)),
    )
    off = filled(Moved, name="joint.az.drive.Ka", prior_sigma=1e3, sigmas=5.0)
    near = filled(Moved, name="joint.el.drive.Ka", prior_sigma=1e3, sigmas=-1.0)
    phase = filled(Moved, name="joint.el.drive.phi_cog", prior_sigma=None, sigmas=None)
    return filled(
        DiagnosisResults,
        verdict=Conclusion(status="none", sentence=""),
        provenance=Provenance(version="1", python="3", libraries={}, platform="", command=""),
        answer="physics",
        log10_p=-250.0,
        moved=(off, near, phase),
        finds=(find,),
        trials=(
            filled(Trial, role="fit", known=5.0, corrected=3.0),
            filled(Trial, role="held-out", known=3.0, corrected=1.0),
            filled(Trial, role="held-out", known=4.0, corrected=1.0),
        ),
    )


def test_a_diagnosis_is_translated_word_by_word() -> None:
    said = answer_of(encode(results()), "T1", 12.0)
    (claim,) = said.finds
    assert (said.method, said.trial, said.detected, said.verdict, said.log10_p) == (OURS, "T1", True, "physics", -250.0)
    assert (claim.port, claim.axis, claim.family, claim.probability) == ("motor torque", "el", "motor order", 0.9)
    assert [entry.family for entry in claim.alternatives] == ["cogging", "cross-coupling"]
    assert claim.alternatives[1].axis == "" and claim.alternatives[1].channels == ("Tx",)
    assert [entry.family for entry in claim.indistinguishable_from] == ["cogging"]
    assert claim.parameters[0].low == 1.8 and [entry.name for entry in said.moved] == ["joint.az.drive.Ka"]
    assert said.held_out is not None and said.held_out.before == pytest.approx(12.5**0.5) and said.held_out.after == 1.0


def test_a_place_without_a_law_is_a_claim() -> None:
    ports = (Place(port="motor torque", site="az"), Place(port="joint torque", site="az"))
    without = replace(results(), answer="undecided", finds=(), located=ports)
    (claim,) = answer_of(encode(without), "T1", 12.0).finds
    assert (claim.port, claim.axis, claim.family, claim.named) == ("motor torque", "az", "unnamed", False)
    assert [(one.port, one.axis) for one in claim.indistinguishable_from] == [("joint torque", "az")]
    assert answer_of(encode(replace(without, located=())), "T1", 12.0).finds == ()


def test_words_that_the_bench_does_not_know_are_told() -> None:
    with pytest.raises(ValueError, match="gearbox"):
        answer_of(encode(results(port="gearbox")), "T1", 12.0)
    with pytest.raises(ValueError, match=r"results\.json"):
        answer_of(b"{}", "T1", 12.0)


def test_a_method_that_fails_has_answered_with_its_failure(tmp_path: Path) -> None:
    (tmp_path / "campaign.toml").write_text("schema = 1\n")
    job = Job("T1", pack(tmp_path), (OURS,))
    given = answer.decode(answer_trial(job)[OURS])
    assert given.verdict == "undecided" and not given.detected and "exit status 2" in given.failure
    late = answer.decode(answer_trial(Job("T1", pack(tmp_path), (OURS,), timeout_s=0.01))[OURS])
    assert late.failure == "no answer within 0.01 s"


def test_whatever_a_diagnosis_may_name_the_score_has_a_word_for() -> None:
    laws = [law for law in (*CATALOGUE, *SENSING) if law.family]
    assert {law.family for law in laws} <= {*get_args(Family)}
    assert {law.port_word for law in laws} <= {*get_args(Port)}
