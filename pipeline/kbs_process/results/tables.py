"""The tables of a results folder: Parquet with units, frame and history in the file's metadata."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from kbs_process.errors import OutputError
from kbs_process.signals.grid import overlap
from kbs_process.signals.records import Array, Envelope, Mask, Signal, Spectrum

if TYPE_CHECKING:  # takes its time to import
    from pandas import DataFrame


@dataclass(frozen=True, slots=True)
class TableWriter:
    """Writes the tables of one recording below `folder`/tables."""

    folder: Path
    recording: str

    def aligned(self, wrench: Signal, others: Mapping[str, Signal]) -> None:
        """Raw wrench at the working rate, beside the signals of the joints ("angle", "command")."""
        signals = overlap(wrench, *others.values())
        base, joints = signals[0], dict(zip(others, signals[1:], strict=True))
        columns: dict[str, Array | Mask] = {"t": base.t, "valid": base.valid}
        units = {"t": "s"}
        for channel, unit in zip(base.channels, base.units, strict=True):
            columns[channel], units[channel] = base.column(channel), unit
        for kind, signal in joints.items():
            for channel, unit in zip(signal.channels, signal.units, strict=True):
                name = f"{kind}.{channel}"
                columns[name], units[name] = signal.column(channel), unit
        self._write("aligned", self.recording, columns, units, base.frame, base.history)

    def gravity(self, measured: Signal, static: Signal, residual: Signal) -> None:
        """Decoupled wrench, the static model, and what is left."""
        self._together("gravity", self.recording, {"measured": measured, "static": static, "residual": residual})

    def band(self, kind: str, band: str, measured: Signal, predicted: Signal | None) -> None:
        """Measured and predicted wrench in one band; `kind` is "bands" (frame T) or "spacecraft" (frame S)."""
        signals = {"measured": measured} | ({} if predicted is None else {"predicted": predicted})
        self._together(kind, f"{self.recording}.{band}", signals)

    def envelope(self, envelope: Envelope, channels: Sequence[str], units: Sequence[str]) -> None:
        """Least and greatest values of the decoupled wrench at its full rate."""
        columns: dict[str, Array | Mask] = {"t": envelope.t}
        named = {"t": "s"}
        for index, (channel, unit) in enumerate(zip(channels, units, strict=True)):
            for side, values in (("low", envelope.low), ("high", envelope.high)):
                columns[f"{channel}.{side}"], named[f"{channel}.{side}"] = values[:, index], unit
        self._write("envelope", self.recording, columns, named, "T", ())

    def spectrum(self, measured: Spectrum, predicted: Spectrum | None, units: Mapping[str, str]) -> None:
        """Power spectral densities on the measurement's frequencies, up to where both have them."""
        columns: dict[str, Array | Mask] = {"f": measured.f}
        named = {"f": "Hz"}
        for kind, spectrum in (("measured", measured), ("predicted", predicted)):
            if spectrum is None:
                continue
            for index, channel in enumerate(spectrum.channels):
                density = np.real(spectrum.S[:, index, index])
                name = f"{channel}.{kind}"
                columns[name] = np.interp(measured.f, spectrum.f, density, right=np.nan)
                named[name] = f"({units[channel]})^2/Hz"
        self._write("spectrum", self.recording, columns, named, "T", ())

    def _together(self, kind: str, stem: str, signals: Mapping[str, Signal]) -> None:
        common = dict(zip(signals, overlap(*signals.values()), strict=True))
        first = next(iter(common.values()))
        columns: dict[str, Array | Mask] = {
            "t": first.t,
            "valid": np.logical_and.reduce([signal.valid for signal in common.values()]),
        }
        units = {"t": "s"}
        for name, signal in common.items():
            for channel, unit in zip(signal.channels, signal.units, strict=True):
                columns[f"{channel}.{name}"], units[f"{channel}.{name}"] = signal.column(channel), unit
        self._write(kind, stem, columns, units, first.frame, first.history)

    def _write(
        self,
        kind: str,
        stem: str,
        columns: Mapping[str, Array | Mask],
        units: Mapping[str, str],
        frame: str,
        history: Sequence[str],
    ) -> None:
        path = self.folder / "tables" / kind / f"{stem}.parquet"
        write_table(path, columns, units, frame=frame, history=history, recording=self.recording)


def write_table(
    path: Path,
    columns: Mapping[str, Array | Mask],
    units: Mapping[str, str],
    *,
    frame: str = "",
    history: Sequence[str] = (),
    recording: str = "",
) -> None:
    """Write one table, and what its columns are into the file's metadata; folders are made."""
    about = {"recording": recording, "frame": frame, "units": units, "history": list(history)}
    table = pa.table({name: pa.array(values) for name, values in columns.items()})
    table = table.replace_schema_metadata({"kbs": json.dumps(about, sort_keys=True)})
    path.parent.mkdir(parents=True, exist_ok=True)
    pq.write_table(table, path, compression="zstd")


def read_table(path: Path | str) -> DataFrame:
    """Return a table as a DataFrame, whose rows are times (s) or frequencies (Hz).

    Its `attrs` hold the "units" of the columns, and the "frame", "history" and "recording" of the signals. Raises
    OutputError where the file cannot be read.
    """
    content, about = read_columns(Path(path))
    frame: DataFrame = content.to_pandas()
    frame = frame.set_index(content.column_names[0])
    frame.attrs.update(about)
    return frame


def _is_number(kind: pa.DataType) -> bool:
    return bool(pa.types.is_floating(kind) or pa.types.is_integer(kind) or pa.types.is_boolean(kind))


def read_columns(path: Path) -> tuple[pa.Table, dict[str, Any]]:
    """Read one table as it is stored, and what its metadata say of it."""
    try:
        content = pq.read_table(path)
        about = json.loads((content.schema.metadata or {}).get(b"kbs", b"{}"))
        kinds = content.schema.types
        if not kinds or not all(map(_is_number, kinds)) or not isinstance(about, dict):
            raise ValueError("its columns are no numbers")
        return content, about
    except (OSError, ValueError, pa.ArrowException) as error:
        raise OutputError(
            f"not a readable table: {error}", where=str(path), remedy="process the campaign again: kbs-process CAMPAIGN"
        ) from None
