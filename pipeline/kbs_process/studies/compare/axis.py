"""Where results stand along an axis: at the dates of their tests, or one after another."""

from __future__ import annotations

from datetime import date
from typing import Any

import matplotlib.dates
import numpy as np
from matplotlib.axes import Axes

from kbs_process.signals.records import Array
from kbs_process.studies.compare.results import ComparisonResults

_DATES: Any = matplotlib.dates  # whose classes have no types
FEW = 8  # results, each of which has a column of its own, and a name under a figure


def places(results: ComparisonResults) -> Array:
    """Days where all tests have a date and not all the same, else 0, 1, 2 ..."""
    days = _days(results)
    return days if days is not None else np.arange(len(results.compared), dtype=np.float64)


def mark(axis: Axes, results: ComparisonResults) -> None:
    """Label the axis by dates, or by the marks of few results, their names with them where there is room."""
    where = places(results)
    room = 0.04 * float(np.ptp(where)) if _days(results) is not None else 0.5
    axis.set_xlim(float(where.min()) - room, float(where.max()) + room)
    if _days(results) is not None:
        locator = _DATES.AutoDateLocator(minticks=3, maxticks=7)
        axis.xaxis.set_major_locator(locator)
        axis.xaxis.set_major_formatter(_DATES.ConciseDateFormatter(locator))
    elif len(where) <= FEW:
        axis.set_xticks(where, [one.mark for one in results.compared])
    else:
        shown = where[:: -(-len(where) // FEW)].astype(np.intp)
        axis.set_xticks(shown, [results.compared[place].mark for place in shown])


def _days(results: ComparisonResults) -> Array | None:
    try:
        days = np.array([date.fromisoformat(one.date[:10]).toordinal() for one in results.compared], dtype=np.float64)
    except ValueError:  # in words, or none
        return None
    return days - date(1970, 1, 1).toordinal() if np.ptp(days) > 0.0 else None
