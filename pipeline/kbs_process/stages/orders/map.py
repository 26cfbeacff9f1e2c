"""Order spectra over a joint's angle or rate (a waterfall), condensed to a few hundred cells of each channel."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kbs_process.signals.records import Array
from kbs_process.stages.orders.tracking import LEAST, OVER, Track, windows

_ROWS, _COLUMNS = 24, 160
_PARTS = 5  # windows of a map in one of the spectrum, where that has few
_MANY = 12  # windows, from which on the spectrum's own do
_APART = 1e-9  # of the greatest: rows that are closer are one, of a motion that repeats itself
_VARIES = 1.5  # greatest rate over the least, from which on a map is over the rate


@dataclass(frozen=True, slots=True, eq=False)
class Waterfall:
    """Amplitudes (rows, columns, c) over rate or angle, and over order; not a number where nothing shows."""

    over: str  # "rate" (turns/s) or "angle" (turns)
    at: Array  # (rows + 1,) edges
    order: Array  # (columns + 1,) edges
    amplitude: Array


def waterfall(track: Track, loads: Array, length: float, count: int) -> Waterfall:
    """Return the map of loads (n, c), of whose spectrum `count` windows of `length` turns were averaged."""
    length = length if count >= _MANY else length / _PARTS
    hop = 0.5 if count >= _MANY else 0.25
    nothing = np.zeros((len(track.turns), 1))
    found = [(one.turns, one.rate, len(one.power)) for one in windows(track, nothing, length, hop)]
    turns, rates, lines = (np.array(values) for values in zip(*found, strict=True))
    over = "rate" if rates.max() > _VARIES * rates.min() else "angle"
    places = rates if over == "rate" else turns
    rows = max(1, min(_ROWS, len(places) // 2))
    edges = np.unique(np.quantile(places, np.linspace(0.0, 1.0, rows + 1)))
    edges = edges[np.diff(edges, prepend=-np.inf) > _APART * np.abs(edges).max()]
    if len(edges) < 2:
        edges = places[0] + np.array([-0.5, 0.5]) * max(abs(places[0]), 1.0)
    rows = len(edges) - 1
    first, last = LEAST / length, (lines.max() - 1) / (OVER * length)
    order = np.geomspace(first, max(last, 2.0 * first), _COLUMNS + 1)
    powers, counts = np.zeros((rows, _COLUMNS, loads.shape[1])), np.zeros((rows, _COLUMNS, 1))
    for place, one in zip(places, windows(track, loads, length, hop), strict=True):
        row = min(int(np.searchsorted(edges, place, side="right")) - 1, rows - 1)
        shown, cells = _condensed(one.power, order * OVER * length)
        powers[row], counts[row] = powers[row] + cells, counts[row] + shown
    amplitude = np.sqrt(np.divide(powers, counts, out=np.full_like(powers, np.nan), where=counts > 0.0))
    return Waterfall(over, edges, order, amplitude)


def _condensed(power: Array, edges: Array) -> tuple[Array, Array]:
    """Which cells between edges (in lines) a spectrum reaches (columns, 1), and its greatest power in each."""
    starts = np.minimum(np.floor(edges).astype(np.int64), len(power) - 1)
    cells = np.maximum.reduceat(power, starts)[:-1]
    shown = (edges[1:] <= len(power))[:, None]
    return shown.astype(np.float64), np.where(shown, cells, 0.0)
