"""How one loss of a recording is told, with its time as far as that is known."""

from __future__ import annotations

import pytest

from kbs_process.campaign.validate import in_words
from kbs_process.signals.records import TRUNCATED, Loss


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
