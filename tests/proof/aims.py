"""What the diagnosis has to reach on trials that it was not developed on, and where a rival is better."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from proof.score import ALL, LESS_IS_BETTER, STRONG, Row
from proof.words import OURS


@dataclass(frozen=True, slots=True)
class Aim:
    """A number of the table and its limits, either of which may be missing."""

    metric: str
    group: str
    least: float | None = None
    most: float | None = None


AIMS = (
    Aim("false find", ALL, most=0.01),
    Aim("place", STRONG, least=0.95),
    Aim("physics", STRONG, least=0.90),
    Aim("place", "100", least=0.85),
    Aim("physics", "100", least=0.75),
    Aim("decibels from the clairvoyant", ALL, most=6.0),
    Aim("held-out residual over floor, after", STRONG, most=1.1),
    Aim("all of several", STRONG, least=0.80),
    Aim("port, in no catalogue", STRONG, least=0.90),
    Aim("held-out variance of a law in no catalogue", STRONG, least=0.90),
    Aim("error over Cramer-Rao bound", STRONG, most=1.5),
    Aim("interval covers", ALL, least=0.90, most=0.98),
    Aim("seconds", ALL, most=120.0),
)

_NOT_COMPARED = {"answered", "held-out residual over floor, before"}
Reached = Literal["reached", "missed", "not tried"]


def find(rows: Sequence[Row], method: str, metric: str, group: str) -> Row | None:
    """Return a number of the table, if there is one."""
    wanted = (method, metric, group)
    return next((row for row in rows if (row.method, row.metric, row.group) == wanted), None)


def reached(aim: Aim, row: Row | None) -> Reached:
    """Compare the number itself, not its interval: with few trials that says little, and the page shows how little."""
    if row is None:
        return "not tried"
    if row.value is None:
        return "missed"
    low = aim.least is None or row.value >= aim.least
    return "reached" if low and (aim.most is None or row.value <= aim.most) else "missed"


def beaten(rows: Sequence[Row]) -> tuple[tuple[Row, Row], ...]:
    """Pairs of our number and the best rival's, wherever a rival's is better."""
    pairs = []
    for ours in rows:
        untold = ours.metric in _NOT_COMPARED or (ours.metric == "seconds" and ours.group != ALL)
        if ours.method != OURS or untold:
            continue
        sign = -1.0 if ours.metric in LESS_IS_BETTER else 1.0
        others = [
            row
            for row in rows
            if row.method != OURS and (row.metric, row.group) == (ours.metric, ours.group) and row.value is not None
        ]
        best = max(others, key=lambda row: sign * (row.value or 0.0), default=None)
        if best is not None and (ours.value is None or sign * (best.value or 0.0) > sign * ours.value):
            pairs.append((ours, best))
    return tuple(pairs)
