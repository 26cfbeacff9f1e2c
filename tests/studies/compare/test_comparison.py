"""Results side by side: in the order of their tests, judged alike only where they are, and apart by both sigmas."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import msgspec
import numpy as np
import pandas as pd
import pytest

from kbs_process.errors import OutputError
from kbs_process.results.records import FILE, encode, load
from kbs_process.results.store import writing
from kbs_process.results.tables import read_table
from kbs_process.studies.compare.results import ComparisonResults, far
from kbs_process.studies.compare.run import compare, find
from kbs_process.studies.correlate.results import DocumentHead, FittedParameter, Results
from report.sample import command_results, six_channels

pytestmark = pytest.mark.fast
replace = msgspec.structs.replace


@pytest.fixture
def processed(tmp_path: Path) -> Callable[..., Path]:
    """Write results of a test at a date, with one fitted number and one requirement's limit and peak."""

    def made(name: str, *, date: str, mass: float, sigma: float, peak: float = 0.02, limit: float = 0.06) -> Path:
        results = command_results()
        assert results.gravity is not None
        number = FittedParameter(
            name="body.antenna.mass", unit="kg", prior=8.0, prior_sigma=0.1, value=mass, sigma=sigma
        )
        requirement = replace(results.requirements[0], value=peak, limit=limit)
        folder = tmp_path / name
        folder.mkdir()
        (folder / FILE).write_bytes(
            encode(
                replace(
                    results,
                    campaign=replace(results.campaign, name=name),
                    document=DocumentHead(date=date),
                    gravity=replace(results.gravity, parameters=(number,)),
                    requirements=(requirement,),
                )
            )
        )
        return folder

    return made


def test_results_stand_in_the_order_of_their_tests_and_differ_by_both_sigmas(
    processed: Callable[..., Path], tmp_path: Path
) -> None:
    late = processed("LATE", date="2026-05-02", mass=8.5, sigma=0.04, peak=0.05)
    unknown = processed("UNKNOWN", date="", mass=8.0, sigma=0.5)
    early = processed("EARLY", date="2026-03-01", mass=8.0, sigma=0.03)
    told = compare([late, unknown, early], tmp_path / "out", pdf=False)
    found = load(tmp_path / "out", ComparisonResults)
    assert [(one.mark, one.name) for one in found.compared] == [("A", "EARLY"), ("B", "LATE"), ("C", "UNKNOWN")]
    (requirement,) = found.requirements
    assert requirement.value == (0.02, 0.05, 0.02)
    (number,) = found.numbers
    assert number.value == (8.0, 8.5, 8.0)
    assert number.distance == pytest.approx(0.5 / 0.05)  # 0.03 and 0.04 make 0.05
    assert "peak from 0.0200 to 0.0500 N\u00a0m; limit 0.06 N\u00a0m" in told.lines[0]
    assert "1 fitted number differs by more than 3.3 sigma, body.antenna.mass most" in told.lines[0]
    page = (tmp_path / "out" / "index.html").read_text(encoding="utf-8")
    assert "EARLY" in page and "Numbers that differ" in page


def test_what_is_judged_by_another_limit_is_another_requirement(processed: Callable[..., Path], tmp_path: Path) -> None:
    one = processed("ONE", date="2026-03-01", mass=8.0, sigma=0.1)
    other = processed("OTHER", date="2026-03-02", mass=8.1, sigma=0.1, limit=0.03)
    told = compare([one, other], tmp_path / "out", pdf=False)
    found = load(tmp_path / "out", ComparisonResults)
    assert [(one.limit, one.value) for one in found.requirements] == [(0.06, (0.02, None)), (0.03, (None, 0.02))]
    assert "No fitted number differs by more than 3.0 sigma" in told.lines[0]


def test_an_archive_is_searched_and_becomes_an_index_with_tables(
    processed: Callable[..., Path], tmp_path: Path
) -> None:
    """A mass that drifts by a tenth of its sigma a month; what is no result of processing is passed over."""
    for month in range(1, 11):
        folder = processed(f"M{month:02}", date=f"2026-{month:02}-01", mass=8.0 + 0.01 * month, sigma=0.1)
        (folder / "index.html").write_text("")
    other = tmp_path / "M01" / "notes"
    other.mkdir()
    (other / FILE).write_text("[]")
    compare(find([tmp_path]), tmp_path / "index", pdf=False)
    assert find([tmp_path]) == sorted(tmp_path.glob("M??"))  # and no comparison
    found = load(tmp_path / "index", ComparisonResults)
    assert (found.compared[9].name, found.compared[9].page) == ("M10", "../M10/index.html")
    numbers = pd.read_parquet(tmp_path / "index" / "tables" / "numbers.parquet")
    assert np.polyfit(range(10), numbers[numbers.name == "body.antenna.mass"].value, 1)[0] == pytest.approx(0.01)
    requirements = pd.read_parquet(tmp_path / "index" / "tables" / "requirements.parquet")
    assert list(requirements.date) == [f"2026-{month:02}-01" for month in range(1, 11)]
    page = (tmp_path / "index" / "index.html").read_text(encoding="utf-8")
    assert 'href="../M10/index.html"' in page


def test_nothing_differs_by_chance_however_many_results_there_are() -> None:
    rng = np.random.default_rng(7)
    for count in (2, 10, 40):
        apart = np.ptp(rng.standard_normal((4000, count)), axis=1) / np.sqrt(2.0)
        assert np.mean(apart > far(count)) < 0.005


def test_spectra_of_the_deciding_channels_are_kept(tmp_path: Path) -> None:
    one, other = six_channels(tmp_path / "one"), six_channels(tmp_path / "other")
    compare([one, other], tmp_path / "out", pdf=False)
    decisive = load(one, Results).requirements[0]
    source = read_table(one / "tables" / "spectrum" / f"{decisive.recording}.parquet")
    kept = read_table(tmp_path / "out" / "tables" / "spectra" / "1.parquet")
    assert list(kept["0.measured"]) == list(source[f"{decisive.channel}.measured"])


def test_results_that_were_changed_by_hand_are_refused(processed: Callable[..., Path], tmp_path: Path) -> None:
    one, other = (processed(name, date="", mass=8.0, sigma=0.1) for name in ("ONE", "OTHER"))
    with writing(tmp_path / "kept") as folder:
        (folder / FILE).write_bytes((other / FILE).read_bytes())
    compare([one, tmp_path / "kept"], tmp_path / "out", pdf=False)
    kept = (tmp_path / "kept" / FILE).read_text()
    (tmp_path / "kept" / FILE).write_text(kept.replace("0.06", "0.07"))
    with pytest.raises(OutputError, match="was changed since kbs-process wrote it"):
        compare([one, tmp_path / "kept"], tmp_path / "out", pdf=False)


def test_results_of_another_kind_are_refused_by_name(processed: Callable[..., Path], tmp_path: Path) -> None:
    one, other = (processed(name, date="", mass=8.0, sigma=0.1) for name in ("ONE", "OTHER"))
    compare([one, other], tmp_path / "out", pdf=False)
    with pytest.raises(OutputError, match="holds results of kind 'comparison'") as refused:
        compare([one, tmp_path / "out"], tmp_path / "again", pdf=False)
    assert "kbs-process CAMPAIGN" in str(refused.value)
    with pytest.raises(OutputError, match="no results here"):
        compare([one, tmp_path / "nowhere"], tmp_path / "again", pdf=False)
    alone = subprocess.run(
        [sys.executable, "-m", "kbs_process", "compare", str(one)], check=False, capture_output=True, text=True
    )
    assert alone.returncode == 2
    assert "at least two folders of results" in alone.stderr
