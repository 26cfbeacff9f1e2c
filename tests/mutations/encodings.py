"""A table with careless values, in the ways that its format has to write it."""

from __future__ import annotations

import random
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

Columns = dict[str, np.ndarray]
Write = Callable[[Path, Columns], None]
_VALUES = (float("nan"), float("inf"), -float("inf"), 1e300, 5e-324, -0.0, 0.0, -1.0, 2.0**53 + 2.0)
_KINDS = ("f4", "i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8")


def careless(rng: random.Random, columns: Columns) -> tuple[Columns, str]:
    """Return a table with one value changed, a channel of another type, or times that repeat or go back."""
    name = rng.choice([name for name in columns if name != "t"])
    values, at = columns[name].copy(), rng.randrange(len(columns["t"]) - 1)
    match rng.randrange(4):
        case 0:
            return columns, "as it was"
        case 1:
            value = rng.choice(_VALUES)
            values[at] = value
            return columns | {name: values}, f"value {at} of {name} is {value}"
        case 2:
            kind = np.dtype(rng.choice(_KINDS))
            least, most = (-3, 3) if kind.kind == "f" else (np.iinfo(kind).min, np.iinfo(kind).max)
            whole = np.clip(np.rint(values * 2.0 ** rng.randrange(40)), float(least), float(most) / 2)
            return columns | {name: whole.astype(kind)}, f"{name} as {kind}"
        case _:
            times = columns["t"].copy()
            times[at + 1] = times[at] - rng.choice((0.0, 0.001, 0.5))
            return columns | {"t": times}, f"time {at + 1} is {times[at + 1]}"


def _matlab(**options: Any) -> Write:
    def write(path: Path, columns: Columns) -> None:
        from scipy.io import savemat

        savemat(path, {name: x[:, None] for name, x in columns.items()}, **options)

    return write


def _matlab_structure(path: Path, columns: Columns) -> None:
    from scipy.io import savemat

    savemat(path, {"unused": {"in": columns}, "t": columns["t"]} | columns, oned_as="row")


def _matlab_7_3(path: Path, columns: Columns) -> None:
    import h5py

    with h5py.File(path, "w", userblock_size=512) as file:
        for name, x in columns.items():
            file.create_dataset(name, data=x[None, :], compression="gzip", shuffle=True)
            file[name].attrs["MATLAB_class"] = np.bytes_({"f4": "single", "f8": "double"}.get(x.dtype.str[1:], "int8"))
    with path.open("r+b") as opened:
        opened.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\0\2IM")


def _mdf(version: str, **options: Any) -> Write:
    def write(path: Path, columns: Columns) -> None:
        from asammdf import MDF, Signal

        with MDF(version=version) as file:
            for group in (("Fx", "Fy"), ("Fz", "angle")):
                file.append([Signal(columns[name], columns["t"], name=name) for name in group])
            file.start_time = pd.Timestamp("1970-01-01T00:00:00Z").to_pydatetime()
            # Of MDF3, asammdf adds the suffix that it thinks right.
            written = Path(file.save(path.with_suffix(".mdf" if version < "4" else ".mf4"), overwrite=True, **options))
            written.replace(path)

    return write


def _mdf_converted(path: Path, columns: Columns) -> None:
    """Whole numbers with a factor and an offset; some samples are marked as not valid."""
    from asammdf import MDF, Signal

    invalid = np.zeros(len(columns["t"]), dtype=np.bool_)
    invalid[5:9] = True
    with MDF(version="4.10") as file:
        signals = [
            Signal(
                np.clip(np.nan_to_num(100.0 * x.astype(np.float64)), -30000, 30000).astype(np.int16),
                columns["t"],
                name=name,
                conversion={"a": 0.01, "b": 1.0},
                invalidation_bits=invalid if name == "Fy" else None,
            )
            for name, x in columns.items()
            if name != "t"
        ]
        file.append(signals)
        file.start_time = pd.Timestamp("1970-01-01T00:00:00Z").to_pydatetime()
        file.save(path, overwrite=True)


def _tdms(pieces: int) -> Write:
    def write(path: Path, columns: Columns) -> None:
        from nptdms import ChannelObject, TdmsWriter

        with TdmsWriter(path) as writer:
            for part in np.array_split(np.arange(len(columns["t"])), pieces):
                writer.write_segment(
                    [
                        ChannelObject("run", name, np.ascontiguousarray(x[part]), {"unit_string": ""})
                        for name, x in columns.items()
                    ]
                )

    return write


def tdms_interleaved(path: Path, columns: Columns, *, order: str = "<") -> None:
    """One segment, row by row, of doubles, in one byte order."""

    def text(word: str) -> bytes:
        return np.array(len(word), f"{order}u4").tobytes() + word.encode()

    def whole(*numbers: int) -> bytes:
        return np.array(numbers, f"{order}u4").tobytes()

    def wide(*numbers: int) -> bytes:
        return np.array(numbers, f"{order}u8").tobytes()

    rows = len(next(iter(columns.values())))
    objects = b"".join(text(f"/'run'/'{name}'") + whole(20, 10, 1) + wide(rows) + whole(0) for name in columns)
    head = whole(len(columns)) + objects
    data = np.column_stack(list(columns.values())).astype(f"{order}f8").tobytes()
    flags = 0b1110 | 1 << 5 | (1 << 6 if order == ">" else 0)
    lead = b"TDSm" + np.array(flags, "<u4").tobytes() + whole(4713) + wide(len(head) + len(data), len(head))
    path.write_bytes(lead + head + data)


def _hdf5(order: str = "=", **options: Any) -> Write:
    def write(path: Path, columns: Columns) -> None:
        import h5py

        with h5py.File(path, "w") as file:
            file.create_dataset("t", data=columns["t"], **options)
            forces = np.column_stack([columns[name] for name in ("Fx", "Fy", "Fz")])
            file.create_dataset("run/forces", data=forces.astype(forces.dtype.newbyteorder(order)), **options)
            file["run/angle"] = columns["angle"][None, :]

    return write


def _parquet(**options: Any) -> Write:
    return lambda path, columns: pd.DataFrame(columns).to_parquet(path, **options)


def _numpy(order: str, *, columnwise: bool) -> Write:
    def write(path: Path, columns: Columns) -> None:
        table = np.array([columns[name] for name in ("t", "Fx", "Fy", "Fz", "angle")]).astype(f"{order}f8")
        np.save(path, np.asfortranarray(table.T) if columnwise else table)

    return write


WAYS: Mapping[str, Mapping[str, Write]] = {
    "parquet": {
        "zstd": _parquet(compression="zstd"),
        "plain, short groups": _parquet(compression=None, row_group_size=7),
        "dictionaries": _parquet(compression="gzip", use_dictionary=True, data_page_version="2.0"),
    },
    "h5": {
        "deflated": _hdf5(compression="gzip", shuffle=True, fletcher32=True),
        "big-endian": _hdf5(order=">"),
        "chunks": _hdf5(chunks=True, compression="lzf"),
    },
    "tdms": {
        "one segment": _tdms(1),
        "segments": _tdms(17),
        "interleaved": tdms_interleaved,
        "interleaved, big-endian": lambda path, columns: tdms_interleaved(path, columns, order=">"),
    },
    "mf4": {
        "3.30": _mdf("3.30"),
        "4.00": _mdf("4.00"),
        "4.10, deflated": _mdf("4.10", compression=1),
        "4.11, transposed": _mdf("4.11", compression=2),
        "4.20": _mdf("4.20"),
        "converted": _mdf_converted,
    },
    "mat": {
        "4": _matlab(format="4"),
        "5": _matlab(),
        "7": _matlab(do_compression=True),
        "7, beside a structure": _matlab_structure,
        "7.3": _matlab_7_3,
    },
    "npy": {"columns": _numpy("<", columnwise=True), "big-endian": _numpy(">", columnwise=False)},
}


def written_anew(rng: random.Random, name: str, path: Path, columns: Columns) -> str:
    """Write a careless table in one of the ways of its format, and say which."""
    way = rng.choice(list(WAYS[name]))
    changed, what = careless(rng, columns)
    path.unlink()
    WAYS[name][way](path, changed)
    return f"{way}: {what}"
