"""A report says which document it is, and when the test was."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import pytest

from campaign.campaign_folder import make_folder
from kbs_process.campaign.load import load_campaign
from kbs_process.studies.correlate.summary import date_of

DAY_NS = 86_400 * 10**9
FIRST_NS = 9296 * DAY_NS  # 1995-06-15


@pytest.mark.parametrize(
    ("starts_ns", "said"),
    [
        ([FIRST_NS, FIRST_NS + 5000], "1995-06-15"),
        ([FIRST_NS + DAY_NS, FIRST_NS], "1995-06-15 to 1995-06-16"),
        ([FIRST_NS, 7_000_000_000], ""),  # a clock that counts from its own start tells no day
        ([], ""),
    ],
)
def test_the_date_of_the_test_is_that_of_its_recordings(starts_ns: list[int], said: str) -> None:
    runs = [SimpleNamespace(run=SimpleNamespace(epoch_ns=start)) for start in starts_ns]
    assert date_of(runs) == said  # type: ignore[arg-type]


def test_a_campaign_states_its_document(tmp_path: Path) -> None:
    folder = make_folder(tmp_path / "campaigns" / "EL089")
    assert load_campaign(folder.path, checksums=False).document == {}
    path = folder.path / "campaign.toml"
    path.write_text(path.read_text() + '\n[document]\nnumber = "TR-1"\nserial_number = "007"\n')
    assert load_campaign(folder.path, checksums=False).document == {"number": "TR-1", "serial_number": "007"}
