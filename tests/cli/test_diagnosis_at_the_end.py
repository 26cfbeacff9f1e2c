"""`kbs-process CAMPAIGN` ends with a diagnosis where the floor is exceeded: in its results, linked from the report."""

from __future__ import annotations

import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest

from campaign.campaign_folder import make_folder
from end_to_end.short_campaign import record
from kbs_process import cli
from kbs_process.campaign.config import Campaign
from kbs_process.campaign.load import load_campaign
from kbs_process.errors import OutputError, RecordingError
from kbs_process.progress import SilentProgress
from kbs_process.results.records import encode
from kbs_process.results.store import LIST
from kbs_process.studies.correlate.run import Outcome
from kbs_process.studies.diagnose import diagnosing
from report import sample
from studies.diagnose.test_report_diagnosis import results

NOISE = SimpleNamespace(source="declared", statement="what the data sheets say")
LINK = 'href="diagnosis/index.html"'


@pytest.fixture
def finished(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """What processing, which takes its time, leaves; nothing is read for the diagnosis either."""
    folder = sample.one_channel(tmp_path / "out")
    (folder / "index.html").write_text("as processed")

    def process(campaign: Campaign, target: Path, **_: object) -> Outcome:
        assert target == folder
        return Outcome(("done",), None, target / "index.html")

    fake = ModuleType("kbs_process.studies.correlate.run")
    fake.process = process  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, fake.__name__, fake)
    monkeypatch.setattr(diagnosing, "experiment_of", lambda *_: "experiment")
    return folder


def run(finished: Path, *options: str) -> int:
    folder = make_folder(finished.parent / "campaigns" / "EL089").path
    with pytest.raises(SystemExit) as caught:
        cli.main([str(folder), "-o", str(finished), "--no-pdf", "-q", *options])
        sys.exit(0)
    return int(caught.value.code or 0)


def detected(monkeypatch: pytest.MonkeyPatch, *, log_p: float) -> None:
    monkeypatch.setattr(diagnosing, "_detected", lambda _: (NOISE, SimpleNamespace(log_p=log_p, ratio=9.0)))


def test_a_mismatch_is_diagnosed_and_linked(
    finished: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def answered(campaign: Campaign, target: Path, **given: Any) -> Outcome:
        assert given["experiment"] == "experiment"
        assert given["verb"] == "", "the command that was typed has no verb"
        target.mkdir()
        (target / "results.json").write_bytes(encode(results()))
        return Outcome(("Left out: a harness.",), None, target / "index.html")

    detected(monkeypatch, log_p=-50.0)
    monkeypatch.setattr(diagnosing, "diagnose", answered)
    assert run(finished) == 0
    told = capsys.readouterr().out
    assert "differ by 3 times the repeatability (rms), all together." in told
    assert "With nominal parameters refitted within their uncertainties: Left out: a harness." in told
    assert "Repeatability: what the data sheets say." in told
    assert f"Diagnosis: {finished / 'diagnosis' / 'index.html'}" in told
    page = (finished / "index.html").read_text()
    assert LINK in page
    assert "Why do prediction and recordings differ?" in page
    assert [path.name for path in finished.glob(".*")] == [LIST]


def test_what_the_floor_explains_is_not_diagnosed(
    finished: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    detected(monkeypatch, log_p=-2.0)
    monkeypatch.setattr(diagnosing, "diagnose", lambda *_, **__: pytest.fail("nothing is to be diagnosed"))
    assert run(finished) == 0
    assert "there is nothing to diagnose" in capsys.readouterr().out
    assert (finished / "index.html").read_text() == "as processed"


def test_the_report_stays_when_a_diagnosis_fails(finished: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def failing(*_: object, **__: object) -> Outcome:
        raise ValueError("no such luck")

    detected(monkeypatch, log_p=-50.0)
    monkeypatch.setattr(diagnosing, "diagnose", failing)
    assert run(finished) == cli.INTERNAL
    assert (finished / "index.html").read_text() == "as processed"
    assert not (finished / "diagnosis").exists()


def unfit(*_: object) -> None:
    raise RecordingError("lasts 4 s", where="EL089P00_1.mcap", remedy="record longer")


@pytest.mark.parametrize(("options", "status"), [((), 0), (("--diagnose",), cli.BAD_INPUT)])
def test_recordings_that_allow_no_diagnosis_are_told_and_an_error_only_where_one_is_asked_for(
    finished: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    options: tuple[str, ...],
    status: int,
) -> None:
    monkeypatch.setattr(diagnosing, "experiment_of", unfit)
    assert run(finished, *options) == status
    told = capsys.readouterr()
    assert "lasts 4 s\n  -> record longer" in (told.err if options else told.out)
    assert (finished / "index.html").read_text() == "as processed"


def test_no_diagnosis_where_none_is_wanted(finished: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(diagnosing, "experiment_of", lambda *_: pytest.fail("nothing is to be read"))
    assert run(finished, "--no-diagnose") == 0


def test_what_interrupts_a_diagnosis_leaves_the_report_and_says_so(
    finished: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupted(*_: object, **__: object) -> Outcome:
        raise KeyboardInterrupt

    detected(monkeypatch, log_p=-50.0)
    monkeypatch.setattr(diagnosing, "diagnose", interrupted)
    assert run(finished) == cli.INTERRUPTED
    assert "the report is written" in capsys.readouterr().err
    assert (finished / "index.html").read_text() == "as processed"


def test_results_that_cannot_be_written_are_an_error(finished: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object, **__: object) -> Outcome:
        raise OutputError("no space is left")

    detected(monkeypatch, log_p=-50.0)
    monkeypatch.setattr(diagnosing, "diagnose", full)
    assert run(finished) == cli.BAD_INPUT


@pytest.mark.slow
def test_a_wrench_that_no_plant_makes_exceeds_the_floor(tmp_path: Path) -> None:
    """Recordings whose wrench is noise about a constant whatever the arm does."""
    folder = make_folder(tmp_path / "campaigns" / "EL089")
    for number, path in enumerate(sorted((folder.path / "recordings").iterdir())):
        record(path, noise=1e-3, seed=number)
    experiment = diagnosing.experiment_of(load_campaign(folder.path), SilentProgress())
    noise, found = diagnosing._detected(experiment)
    assert noise.source == "repeats"
    assert found.log_p < -50.0
