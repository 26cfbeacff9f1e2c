"""Requirements as a campaign's files state them, their limits in SI."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from kbs_process.campaign.config import PointingRequirement, Requirement
from kbs_process.campaign.documents import Document, Key
from kbs_process.campaign.formats.kind import GREATEST
from kbs_process.campaign.problems import Problems
from kbs_process.campaign.units import UnitMismatchError, factor

if TYPE_CHECKING:
    from kbs_process.campaign.formats.campaign_file import PointingTable, RequirementTable
    from kbs_process.campaign.formats.tables import LimitTable, PointingLimitTable


def disturbance(table: RequirementTable, key: Key, document: Document, problems: Problems) -> Requirement:
    """Return the limit on a torque or force that `table` states at `key` of its file."""
    unit = "N m" if table.quantity == "torque" else "N"
    low, high = table.band_Hz
    return Requirement(
        name=table.name,
        quantity=table.quantity,
        frame=table.frame,
        statistic=table.statistic,
        limit=_limit(table.limit, unit, key, document, problems),
        unit=unit,
        band=(low, high),
        source=table.source,
        axes=tuple(sorted(table.axes or ("x", "y", "z"))),
    )


def pointing(
    tables: Sequence[PointingTable | PointingLimitTable], key: Key, document: Document, problems: Problems
) -> tuple[PointingRequirement, ...]:
    """Return the limits on pointing errors that `tables` state at `key` of their file."""
    limits = [_limit(table.limit, "rad", (*key, index), document, problems) for index, table in enumerate(tables)]
    return tuple(
        PointingRequirement(table.name, table.statistic, limit, table.source)
        for table, limit in zip(tables, limits, strict=True)
    )


def _limit(limit: LimitTable, unit: str, key: Key, document: Document, problems: Problems) -> float:
    scale = 1.0
    try:
        scale = factor(limit.unit, unit)
    except UnitMismatchError as error:
        problems.add(document.place((*key, "limit", "unit")), str(error), error.remedy)
    if not limit.value * scale <= GREATEST[unit]:
        what = f"is {limit.value * scale:.3g} {unit}: nothing on a test bench is so large"
        problems.add(
            document.place((*key, "limit")), what, f"check number and unit; give at most {GREATEST[unit]:g} {unit}"
        )
    return limit.value * scale
