"""How one loss of a recording is told, with its time as far as that is known."""

from __future__ import annotations

from pathlib import Path

import pytest

from kbs_process.campaign.config import RecordingEntry
from kbs_process.signals.records import PUT_IN_ORDER, TRUNCATED, Loss
from kbs_process.studies.correlate import results
from kbs_process.studies.correlate.notices import lost
from kbs_process.studies.validate.run import in_words


@pytest.mark.parametrize(
    ("loss", "said"),
    [
        (Loss("gap", "a.mcap, wrench", 3, 1.0, 2.5), "3 x gap, 1.0000 to 2.5000 s, a.mcap, wrench"),
        (Loss("crc", "a.mcap", 1, 1.0, 1.0), "1 x crc at 1.0000 s, a.mcap"),
        (Loss("crc", "a.mcap", 1), "1 x crc, a.mcap"),
        # What would have followed a break, nobody knows: a broken chunk's own end is no end of it.
        (Loss(TRUNCATED, "a.mcap", 1, 110.0, 120.0), "1 x truncated, from 110.0000 s on, a.mcap"),
    ],
)
def test_a_loss_is_told_with_its_time(loss: Loss, said: str) -> None:
    assert in_words(loss) == said


@pytest.mark.parametrize(("also", "severity"), [((), "info"), (("gap",), "warning")])
def test_what_was_put_in_order_alone_is_no_warning(also: tuple[str, ...], severity: str) -> None:
    entry = RecordingEntry("a", Path("a.mcap"), "A", "fit", 1, None, None, None)
    losses = [Loss(kind, "a: wrench", 3) for kind in (PUT_IN_ORDER, *also)]
    (notice,) = lost(entry, losses)
    assert notice.severity == severity
    assert "put in order: 3" in notice.what
    listed = tuple(Loss(kind=one.kind, where=one.where, count=one.count) for one in losses)
    recording = results.Recording(
        name="a", file="a.mcap", trajectory="A", role="fit", repeat=1, sha256="0" * 64, duration_s=1.0,
        losses=listed,
    )  # fmt: skip
    assert [one.kind for one in recording.lost] == list(also)
