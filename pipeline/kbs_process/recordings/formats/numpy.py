"""NumPy: one array of one or two dimensions, columns "[1]", "[2]"... along its shorter side, or records by field.

In a .npz, which holds several, their names come before: "forces[2]", "run[Fx]".
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from kbs_process.recordings.formats import Format, Text
from kbs_process.recordings.tables import Item, SeriesTable, matrix_of, series_of


def read_numpy(path: Path, _: Text) -> SeriesTable:
    """Open a .npy or .npz file."""
    data = _numbers(partial(np.load, mmap_mode="r", allow_pickle=False), path)
    if isinstance(data, np.ndarray):
        return SeriesTable(path, _columns(data, ""))
    return SeriesTable(path, (one for name in data.files for one in _columns(_numbers(data.get, name), name)))


def _numbers(load: Callable[..., Any], what: Path | str) -> Any:
    """Load, without the advice to run what an unknown file says."""
    try:
        return load(what)
    except ValueError:
        raise ValueError("it holds no numbers that NumPy can read: damaged, or objects") from None


def _columns(data: Any, name: str) -> Iterator[Item]:
    if not data.dtype.names or data.ndim != 1:
        yield from series_of(data, name)
        return
    for field in data.dtype.names:
        label = f"{name}[{field}]" if name else field
        if data[field].ndim == 2:
            yield from matrix_of(data[field], label, upright=True)
        else:
            yield from series_of(data[field], label)


FORMAT = Format(suffixes=(".npy", ".npz"), read=read_numpy)
