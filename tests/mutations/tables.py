"""Tables of foreign formats, imported: held against the reader of the format's own library."""

from __future__ import annotations

import csv
import random
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np

from kbs_process.studies.convert.run import import_recordings
from mutations.encodings import WAYS, Columns, written_anew
from mutations.subject import Subject, Tell, damaged
from studies.convert import importer_files as files

NAMES = ("t", "Fx", "Fy", "Fz", "angle")
_ROWS = 300
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
CELLS = (
    "",
    " ",
    "nan",
    "inf",
    "-",
    "1_2",
    "1,5",
    "1.2.3",
    "0x10",
    "1e400",
    "1e308",
    "-1e200",
    "-1e-400",
    '"',
    '"1',
    "\u0661",
    "1 2",
    "NULL",
    "1;2",
    "#",
    "1e3",
    "+.5",
    "7" * 200,
)
_HDF5 = {"Fx": "run/forces[1]", "Fy": "run/forces[2]", "Fz": "run/forces[3]", "angle": "run/angle"}
_TDMS = {name: f"run/{name}" for name in NAMES}
_NUMPY = {name: place for place, name in enumerate(NAMES, 1)}


def sound() -> Columns:
    """What the sound file holds."""
    rng = np.random.default_rng(7)
    t = np.round(0.01 * np.arange(_ROWS), 6)
    values = {name: rng.standard_normal(_ROWS) for name in NAMES[1:]}
    return {"t": t} | values | {"angle": np.sin(t)}


def _csv(path: Path) -> Columns:
    with path.open(encoding="utf-8-sig", newline="") as file:
        rows = list(csv.DictReader(file, strict=True))
    return {name: np.array([_number(row[name]) for row in rows]) for name in NAMES}


def _number(cell: str) -> float:
    return float(cell) if _NUMBER.fullmatch(cell.strip()) else float("nan")


def _parquet(path: Path) -> Columns:
    from pyarrow import parquet

    read = parquet.read_table(path, use_threads=False)
    return {name: read[name].to_numpy() for name in NAMES}


def _hdf5(path: Path) -> Columns:
    import h5py

    with h5py.File(path) as file:
        forces = file["run/forces"][()]
        return dict(zip(NAMES, (file["t"][()], *forces.T, file["run/angle"][0]), strict=True))


def _tdms(path: Path) -> Columns:
    from nptdms import TdmsFile

    group = TdmsFile.read(path)["run"]
    return {name: group[name][:] for name in NAMES}


def _mdf(path: Path) -> Columns:
    from asammdf import MDF

    with MDF(path) as file:
        read = {name: file.get(name, ignore_invalidation_bits=True) for name in NAMES[1:]}
    return {"t": read["Fx"].timestamps} | {
        name: one.samples if one.invalidation_bits is None else np.where(one.invalidation_bits, np.nan, one.samples)
        for name, one in read.items()
    }


def _matlab(path: Path) -> Columns:
    import h5py
    from scipy.io import loadmat

    if h5py.is_hdf5(path):
        with h5py.File(path) as file:
            return {name: file[name][()].ravel() for name in NAMES}
    read = loadmat(path)
    return {name: read[name].ravel() for name in NAMES}


def _numpy(path: Path) -> Columns:
    table = np.load(path, allow_pickle=False)
    return dict(zip(NAMES, table if len(table) == len(NAMES) else table.T, strict=True))


def judged(file: str, read: Callable[[Path], Columns]) -> Callable[[Path, Tell], None]:
    """Import a file, and hold it against the sound one, else against what `read` makes of it."""

    def judge(folder: Path, tell: Tell) -> None:
        notices: list[str] = []
        import_recordings(folder / "mapping.toml", folder, folder / "campaign", notice=notices.append)
        got = files.read_back(folder / "campaign", "turn_1")
        if _same(got, sound()):
            tell("right")
            return
        tell("reported" if notices else "wrong")
        try:
            other = read(folder / file)
        except Exception:  # noqa: BLE001  what that library makes of damage is not on trial
            return
        if _same(got, other):
            tell("right")

    return judge


def _same(got: dict[str, tuple[np.ndarray, np.ndarray]], columns: Columns) -> bool:
    """Whether a recording that was imported holds these columns, to the bit."""
    stamp = np.rint(np.asarray(columns["t"], dtype=np.float64) * 1e9)
    wrench = np.stack([columns[name] for name in ("Fx", "Fy", "Fz")], axis=1)
    expected = {"wrench": wrench, "encoder": np.asarray(columns["angle"])[:, None]}
    return all(
        np.array_equal(got[key][0], stamp) and np.array_equal(got[key][1], values, equal_nan=True)
        for key, values in expected.items()
    )


def _mutate(name: str, file: str) -> Callable[[random.Random, Path], str]:
    text = name not in WAYS

    def mutate(rng: random.Random, folder: Path) -> str:
        path = folder / file
        # Checksums and lengths find most damage; so half of the files are sound, with other values in them.
        if not text and rng.random() < 0.5:
            return written_anew(rng, name, path, sound())
        data = path.read_bytes()
        if text and rng.random() < 0.5:
            lines = [line.split(",") for line in data.decode().splitlines()]
            row, column, cell = rng.randrange(len(lines)), rng.randrange(len(NAMES)), rng.choice(CELLS)
            lines[row][column] = cell
            path.write_text("\n".join(",".join(line) for line in lines) + "\n", encoding="utf-8")
            return f"cell {column} of line {row} is {cell[:20]!r}"
        changed, what = damaged(rng, data)
        path.write_bytes(changed)
        return what

    return mutate


def _subject(
    name: str,
    share: float,
    write: files.Writer,
    read: Callable[[Path], Columns],
    columns: dict[str, str] | dict[str, int] | None = None,
    mapping: str = files.MAPPING,
) -> Subject:
    file = f"run.{name}"

    def make(folder: Path) -> None:
        placed = mapping
        for column, place in (columns or {}).items():
            named = f'"{place}"' if isinstance(place, str) else str(place)
            placed = placed.replace(f'column = "{column}"', f"column = {named}")
        files.write_mapping(folder, file, placed)
        write(folder / file, sound())

    return Subject(name, share, make, _mutate(name, file), judged(file, read))


SUBJECTS = (
    _subject("csv", 2.0, files.write_csv, _csv),
    _subject("parquet", 1.0, files.write_parquet, _parquet),
    _subject("h5", 1.0, files.write_hdf5, _hdf5, _HDF5),
    _subject("tdms", 1.0, files.write_tdms, _tdms, _TDMS),
    _subject("mf4", 1.0, files.write_mdf, _mdf, mapping=files.OWN_TIME),
    _subject("mat", 1.0, files.write_matlab, _matlab),
    _subject("npy", 1.0, files.write_numpy, _numpy, _NUMPY),
)
