"""The day that docs/1996.md puts beside the paper's."""

from __future__ import annotations

import numpy as np
import pytest

from mission.search import made, search

FOUND = np.array([4.0 + 41.0 / 60.0 + 10.0 / 3600.0, 189.955, np.degrees(2.41292), 1569.0, 4470.0, 6394.0])


def test_the_day_found_has_the_published_ends_and_one_fast_slew() -> None:
    one = made(FOUND)
    assert one is not None
    ends = [one.ends[name] for name in ("1", "2", "3", "4", "5a", "5b")]
    assert ends == pytest.approx([1500.0, 1800.0, 4400.0, 4700.0, 5800.0, 6600.0], abs=75.0)
    assert list(one.rates.values()) == pytest.approx([1.15, 1.88, 1.23], abs=0.05)
    assert one.azimuth == pytest.approx((-139.0, 154.0), abs=1.0)


def test_a_search_never_ends_with_a_worse_day_and_repeats_itself() -> None:
    start = FOUND + np.array([0.0, 2.0, 0.0, 0.0, 0.0, 0.0])
    before, one, again = made(start), search(start, 8, 1), search(start, 8, 1)
    assert before is not None and one.cost <= before.cost
    assert (one.x == again.x).all()
