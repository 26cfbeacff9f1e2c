"""Processing again keeps a diagnosis of the same inputs, and says before it removes one of others."""

from __future__ import annotations

import sys
from pathlib import Path

import msgspec
import pytest

from end_to_end.short_campaign import short_campaign
from kbs_process import cli
from kbs_process.campaign.load import load_campaign
from kbs_process.results import provenance
from kbs_process.results.records import encode
from kbs_process.results.store import writing
from kbs_process.studies.correlate.earlier_diagnosis import earlier_diagnosis
from studies.diagnose.test_report_diagnosis import results

pytestmark = pytest.mark.slow

LINK = 'href="diagnosis/index.html"'


def run(*arguments: str | Path) -> int:
    with pytest.raises(SystemExit) as caught:
        cli.main([*map(str, arguments), "--no-pdf", "--no-diagnose", "-q"])
        sys.exit(0)
    return int(caught.value.code or 0)


def diagnose(campaign: Path, results_folder: Path) -> None:
    """Leave what a diagnosis of the campaign as it is leaves."""
    loaded = load_campaign(campaign)
    made = provenance.made("diagnose", loaded.folder, loaded.files)
    corrected = results_folder / "diagnosis" / "corrected"
    corrected.mkdir(parents=True)
    (corrected / "campaign.toml").write_text("hours of work")
    found = msgspec.structs.replace(results(), provenance=made)
    (results_folder / "diagnosis" / "results.json").write_bytes(encode(found))


def test_a_diagnosis_of_the_same_inputs_is_kept_and_linked_and_one_of_others_is_told_before_it_goes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, out = short_campaign(tmp_path / "campaigns" / "EL089"), tmp_path / "out"
    with writing(out) as private:
        diagnose(folder.path, private)
        (private / "results.json").write_text("{}")  # of the processing that came before

    assert run(folder.path, "-o", out) == 0
    told = capsys.readouterr()
    assert (out / "diagnosis" / "corrected" / "campaign.toml").read_text() == "hours of work"
    assert LINK in (out / "index.html").read_text()
    assert f"kept from before: {out / 'diagnosis'}" in told.out
    assert "removed" not in told.err

    folder.append("campaign.toml", "# another remark\n")
    assert run(folder.path, "-o", out) == 0
    told = capsys.readouterr()
    assert not (out / "diagnosis").exists()
    assert LINK not in (out / "index.html").read_text()
    assert f"the diagnosis in {out / 'diagnosis'} is of other inputs (campaign.toml changed" in told.err
    assert "name another folder with --output" in told.err
    assert "kept" not in told.out


def test_a_diagnosis_that_nobody_can_read_is_outdated(tmp_path: Path) -> None:
    folder, out = short_campaign(tmp_path / "campaigns" / "EL089"), tmp_path / "out"
    campaign = load_campaign(folder.path)
    assert earlier_diagnosis(campaign, out) is None
    diagnose(folder.path, out)
    found = earlier_diagnosis(campaign, out)
    assert found is not None and not found.outdated
    (out / "diagnosis" / "results.json").write_text('{"kind": "diagnosis", "schema": 99}')
    found = earlier_diagnosis(campaign, out)
    assert found is not None and "another version" in found.warning[0]


def test_where_no_folder_can_be_there_is_no_diagnosis(tmp_path: Path) -> None:
    folder = short_campaign(tmp_path / "campaigns" / "EL089")
    assert earlier_diagnosis(load_campaign(folder.path), tmp_path / ("n" * 256)) is None
