"""Where the residual lives: tables of its size over the floor in windows of time by frequencies, by trajectory."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from kbs_process.diagnosis.selection.outcome import Outcome, Place
from kbs_process.results.tables import write_table
from kbs_process.signals.records import Array

MAPS = "residual_map"


def write_maps(folder: Path, outcome: Outcome) -> None:
    """Write a table for each trajectory that was fitted: rms over the floor before any find, and after all."""
    before, after = outcome.place, outcome.left
    if before is None or after is None or len(before.cells.t) != len(after.cells.t):
        return
    cells = before.cells
    sizes = {"before": _size(before), "after": _size(after)}
    found = before.test.significant.astype(np.float64)
    trials = outcome.standing.known.experiment.trials
    for number in np.unique(cells.trajectory):
        own = cells.trajectory == number
        recording = next(trial.name for trial in trials if trial.trajectory == number)
        columns = {"t": cells.t[own], "f": cells.f[own]} | {name: size[own] for name, size in sizes.items()}
        columns["significant"] = found[own]
        units = dict.fromkeys(columns, "1") | {"t": "s", "f": "Hz"}
        path = folder / "tables" / MAPS / f"{number}.parquet"
        write_table(path, columns, units, frame="T", recording=recording)


def _size(place: Place) -> Array:
    """(cells,) rms of the whitened mean residual over all channels that are seen; 1 at the floor."""
    power = np.sum(np.abs(place.cells.z) ** 2, axis=1)
    return np.asarray(np.sqrt(power / np.maximum(place.cells.seen, 1)), dtype=np.float64)
