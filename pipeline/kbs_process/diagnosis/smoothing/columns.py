"""Columns of rows that are zero in most of them: by row, those that are not."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kbs_process.signals.records import Array

Places = NDArray[np.intp]
Entry = tuple[int, int, Array]  # row, place, series (n,)


@dataclass(frozen=True, slots=True, eq=False)
class Columns:
    """`count` columns of n samples of some rows."""

    n: int
    count: int
    parts: tuple[tuple[int, Places, Array], ...]  # row, places of columns that it has (k,), their series (n, k)

    @classmethod
    def of(cls, n: int, count: int, entries: Iterable[Entry]) -> Columns:
        """Of single series; a row has a column once."""
        by_row: dict[int, list[tuple[int, Array]]] = {}
        for row, place, series in entries:
            by_row.setdefault(row, []).append((place, series))
        parts = [
            (row, np.array([place for place, _ in own], dtype=np.intp), np.stack([one for _, one in own], axis=1))
            for row, own in sorted(by_row.items())
        ]
        return cls(n, count, tuple(parts))

    @classmethod
    def of_dense(cls, values: Array) -> Columns:
        """Of all rows (n, rows, count)."""
        parts = []
        for row in range(values.shape[1]):
            places = np.flatnonzero(values[:, row].any(axis=0))
            if len(places):
                parts.append((row, places, values[:, row, places]))
        return cls(len(values), values.shape[2], tuple(parts))

    @classmethod
    def beside(cls, every: Sequence[Columns]) -> Columns:
        """Columns of several, one after the other."""
        by_row: dict[int, list[tuple[Places, Array]]] = {}
        before = 0
        for one in every:
            for row, places, values in one.parts:
                by_row.setdefault(row, []).append((places + before, values))
            before += one.count
        parts = [
            (row, np.concatenate([places for places, _ in own]), np.hstack([values for _, values in own]))
            for row, own in sorted(by_row.items())
        ]
        return cls(every[0].n, before, tuple(parts))

    def placed(self, places: Places, count: int) -> Columns:
        """The same as some among more."""
        return Columns(self.n, count, tuple((row, places[own], values) for row, own, values in self.parts))

    def divided(self, most: int) -> tuple[Places, Places]:
        """Places of columns that have no more than so many rows, and of those that have more."""
        rows = np.zeros(self.count, dtype=int)
        for _, places, _ in self.parts:
            rows[places] += 1
        return np.flatnonzero(rows <= most), np.flatnonzero(rows > most)

    def chosen(self, places: Places) -> Columns:
        """Some of them, in rising order."""
        parts = []
        for row, own, values in self.parts:
            there = np.isin(own, places)
            if there.any():
                parts.append((row, np.searchsorted(places, own[there]), values[:, there]))
        return Columns(self.n, len(places), tuple(parts))

    def weighed(self, root: Array) -> Columns:
        """Times factors (n, rows)."""
        return Columns(
            self.n, self.count, tuple((row, own, values * root[:, row, None]) for row, own, values in self.parts)
        )

    def dense(self, rows: int) -> Array:
        """All rows (n, rows, count)."""
        out = np.zeros((self.n, rows, self.count))
        for row, places, values in self.parts:
            out[:, row, places] = values
        return out

    def times(self, by: Array, rows: int) -> Array:
        """Sum of columns times `by` (count,), (n, rows)."""
        out = np.zeros((self.n, rows))
        for row, places, values in self.parts:
            out[:, row] = values @ by[places]
        return out

    def products(self, other: Columns) -> Array:
        """With those of another (count, count of the other)."""
        out = np.zeros((self.count, other.count))
        theirs = {row: (places, values) for row, places, values in other.parts}
        for row, places, values in self.parts:
            if row in theirs:
                out[np.ix_(places, theirs[row][0])] += values.T @ theirs[row][1]
        return out

    def squares(self, owner: Places) -> Array:
        """With each other (count, count), those of one `owner` (count,) alone."""
        out = np.zeros((self.count, self.count))
        for _, places, values in self.parts:
            out[np.ix_(places, places)] += within(values, owner[places])
        return out


def within(columns: Array, owner: Places) -> Array:
    """Products (m, m) of columns (n, m) with those of the same owner, which are beside each other."""
    m = len(owner)
    out = np.zeros((m, m))
    for apart in range(int(np.bincount(owner).max(initial=0))):
        one = np.arange(m - apart)
        same = owner[one] == owner[one + apart]
        product = np.einsum("ij,ij->j", columns[:, : m - apart], columns[:, apart:])
        out[one[same], one[same] + apart] = out[one[same] + apart, one[same]] = product[same]
    return out
