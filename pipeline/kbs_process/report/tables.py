"""The tables of a results folder, read when asked for."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from kbs_process.results.tables import read_columns
from kbs_process.signals.records import WRENCH_CHANNELS, Array, Mask


@dataclass(frozen=True, slots=True, eq=False)
class Table:
    """Columns of equal length with their units."""

    columns: dict[str, Array]
    units: dict[str, str]

    @property
    def valid(self) -> Mask:
        """Which rows are neither invented nor within a filter's edge; all, where the table does not say."""
        flags = self.columns.get("valid")
        if flags is None:
            return np.ones(len(self), dtype=np.bool_)
        mask: Mask = flags > 0.5
        return mask

    @property
    def channels(self) -> tuple[str, ...]:
        """Channels with a measured column, wrench channels first and in their usual order."""
        found = [name.removesuffix(".measured") for name in self.columns if name.endswith(".measured")]
        known = [channel for channel in WRENCH_CHANNELS if channel in found]
        return (*known, *(channel for channel in found if channel not in WRENCH_CHANNELS))

    def unit(self, column: str) -> str:
        """Unit of a column, or of a channel's measured column."""
        return self.units.get(column) or self.units.get(f"{column}.measured", "")

    def __len__(self) -> int:
        return len(next(iter(self.columns.values()), ()))


@dataclass(frozen=True, slots=True)
class Tables:
    """`tables/` of a results folder; a table that is not there, or has no rows, is None."""

    folder: Path

    def gravity(self, recording: str) -> Table | None:
        """Measured wrench, static model and residual of a recording."""
        return self.read("gravity", recording)

    def band(self, recording: str, band: str, frame: str) -> Table | None:
        """Measured and predicted wrench of a recording in one band, in frame T or S."""
        return self.read("spacecraft" if frame == "S" else "bands", f"{recording}.{band}")

    def spectrum(self, recording: str) -> Table | None:
        """Power spectral densities of a recording."""
        return self.read("spectrum", recording)

    def read(self, kind: str, stem: str) -> Table | None:
        """Table `tables/KIND/STEM.parquet`."""
        directory = self.folder / "tables" / kind
        name = f"{stem}.parquet"
        # Looked up among the files that are there, so that no name can lead out of the folder.
        if not directory.is_dir() or name not in {entry.name for entry in directory.iterdir()}:
            return None
        content, about = read_columns(directory / name)
        if not content.num_rows:
            return None
        columns = {
            name: np.asarray(column.to_numpy(), dtype=np.float64)
            for name, column in zip(content.column_names, content.columns, strict=True)
        }
        return Table(columns, about.get("units", {}))
