"""What a method says reaches the score as it was meant, and what fails is told."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from kbs_process.report.records.common import Conclusion, Provenance, encode
from kbs_process.report.records.diagnosis import DiagnosisResults, Find, Fitted, Moved, Place, Rival, Trial
from proof import answer, methods
from proof.bundle import pack
from proof.diagnosis import answer_of
from proof.methods import Job, answer_trial
from proof.words import OURS


def trial(name: str, role: str, known: float, corrected: float) -> Trial:
    return Trial(
        recording=name,
        trajectory="A",
        role=role,  # type: ignore[arg-type]
        nominal=9.0,
        known=known,
        corrected=corrected,
        log10_p=-1.0,
        channels={},
    )


def rival(family: str, place: Place, distance: float | None, probability: float) -> Rival:
    return Rival(
        name=family, family=family, place=place, gain=10.0, distance=distance, probability=probability
    )


def results(port: str = "motor torque") -> DiagnosisResults:
    motor, channel = Place(port=port, site="el"), Place(port="transducer", site="Tx<-Fz")
    find = Find(
        name="motor_order", family="motor order", named=True, place=motor, says="", equation="", reference="",
        parameters=(Fitted(name="amplitude", unit="N m", value=2.0, sigma=0.1, low=1.8, high=2.2),),
        probability=0.9, distance=300.0, absorbed=0.1, band_Hz=(0.1, 2.0),
        rivals=(rival("cross-coupling", channel, 80.0, 0.01), rival("cogging", motor, 3.0, 0.09)), gate=(),
    )  # fmt: skip
    off = Moved(
        name="joint.az.drive.Ka", unit="N m", prior=1e4, prior_sigma=1e3, value=1.5e4, sigma=9.0, sigmas=5.0
    )
    near = Moved(
        name="joint.el.drive.Ka", unit="N m", prior=1e4, prior_sigma=1e3, value=1.1e4, sigma=9.0, sigmas=1.0
    )
    return DiagnosisResults(
        name="T1", title="", article="", verdict=Conclusion(status="none", sentence=""),
        provenance=Provenance(version="1", python="3", libraries={}, platform="", command=""),
        answer="physics", paragraph="", floor="", log10_p=-250.0, moved=(off, near), finds=(find,),
        trials=(trial("1", "fit", 5.0, 3.0), trial("2", "held-out", 3.0, 1.0), trial("3", "held-out", 4.0, 1.0)),
    )  # fmt: skip


def test_a_diagnosis_is_translated_word_by_word() -> None:
    said = answer_of(encode(results()), "T1", 12.0)
    (claim,) = said.finds
    assert (said.method, said.trial, said.detected, said.verdict, said.log10_p) == (
        OURS,
        "T1",
        True,
        "physics",
        -250.0,
    )
    assert (claim.port, claim.axis, claim.family, claim.probability) == (
        "motor torque",
        "el",
        "motor order",
        0.9,
    )
    assert [entry.family for entry in claim.alternatives] == ["cogging", "cross-coupling"]
    assert claim.alternatives[1].axis == "" and claim.alternatives[1].channels == ("Tx",)
    assert [entry.family for entry in claim.indistinguishable_from] == ["cogging"]
    assert claim.parameters[0].low == 1.8 and [entry.name for entry in said.moved] == ["joint.az.drive.Ka"]
    assert (
        said.held_out is not None
        and said.held_out.before == pytest.approx(12.5**0.5)
        and said.held_out.after == 1.0
    )


def test_words_that_the_bench_does_not_know_are_told() -> None:
    with pytest.raises(ValueError, match="gearbox"):
        answer_of(encode(results(port="gearbox")), "T1", 12.0)
    with pytest.raises(ValueError, match=r"results\.json"):
        answer_of(b"{}", "T1", 12.0)


def test_a_method_that_fails_has_answered_with_its_failure(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "campaign.toml").write_text("schema = 1\n")
    job = Job("T1", pack(tmp_path), (OURS,))
    given = answer.decode(answer_trial(job)[OURS])
    assert given.verdict == "undecided" and not given.detected and "exit status 2" in given.failure
    monkeypatch.setattr(methods, "DIAGNOSE", (sys.executable, "-c", "import time; time.sleep(60)"))
    late = answer.decode(answer_trial(Job("T1", pack(tmp_path), (OURS,), timeout_s=0.5))[OURS])
    assert late.failure == "no answer within 0.5 s"
