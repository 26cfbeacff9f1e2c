"""Requirements as a campaign's files state them, their limits in SI."""

from __future__ import annotations

from kbs_process.campaign.config import PointingRequirement, Requirement
from kbs_process.campaign.documents import Document, Key, Tree
from kbs_process.campaign.problems import Problems
from kbs_process.campaign.units import UnitMismatchError, factor


def disturbance(table: Tree, key: Key, document: Document, problems: Problems) -> Requirement:
    """Return the limit on a torque or force that `table` states at `key` of its file."""
    unit = "N m" if table["quantity"] == "torque" else "N"
    low, high = table["band_Hz"]
    return Requirement(
        name=table["name"],
        quantity=table["quantity"],
        frame=table["frame"],
        statistic=table["statistic"],
        limit=_limit(table, unit, key, document, problems),
        unit=unit,
        band=(float(low), float(high)),
        source=table["source"],
    )


def pointing(table: Tree, key: Key, document: Document, problems: Problems) -> PointingRequirement:
    """Return the limit on a pointing error that `table` states at `key` of its file."""
    limit = _limit(table, "rad", key, document, problems)
    return PointingRequirement(table["name"], table["statistic"], limit, table["source"])


def _limit(table: Tree, unit: str, key: Key, document: Document, problems: Problems) -> float:
    scale = 1.0
    try:
        scale = factor(table["limit"]["unit"], unit)
    except UnitMismatchError as error:
        problems.add(document.place((*key, "limit", "unit")), str(error), error.remedy)
    return float(table["limit"]["value"]) * scale
