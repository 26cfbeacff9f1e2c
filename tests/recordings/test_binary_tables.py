"""Binary formats against what their own libraries and conventions say; what has no columns is named, never guessed."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kbs_process.errors import RecordingError
from kbs_process.recordings.formats import Text, format_named
from kbs_process.recordings.tables import Table, find_column
from kbs_process.studies.convert.clock import numbers

# Readers leave their files open until the child process that they are made for ends.
pytestmark = pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning", "ignore::ResourceWarning")

T = np.arange(20) * 0.5
NAN = float("nan")


def read(path: Path, name: str) -> Table:
    return format_named(name).read(path, Text())


def column(table: Table, name: str) -> np.ndarray:
    return np.concatenate([numbers(cells) for (cells,) in table.chunks([name])])


def cells(table: Table, name: str) -> np.ndarray:
    return np.concatenate([one for (one,) in table.chunks([name])])


def names(table: Table) -> list[str]:
    return [one.name for one in table.columns]


def told(table: Table, name: str) -> str:
    return next((one for one in table.left_out if one.startswith(f"{name}: ")), "")


PACKED = np.array([5, -32768, 7, -99, 2000, -3], dtype="<i2")


@pytest.mark.parametrize(
    ("attributes", "right"),
    [
        ({"scale_factor": 0.01, "add_offset": 1.0}, PACKED * 0.01 + 1.0),
        ({"scale_factor": [0.01]}, PACKED * 0.01),
        ({"_FillValue": np.int16(-32768)}, [5, NAN, 7, -99, 2000, -3]),
        ({"_FillValue": np.int16(-32768), "missing_value": np.int16([-99, -3])}, [5, NAN, 7, NAN, 2000, NAN]),
        ({"valid_range": np.int16([-100, 100]), "add_offset": 1.0}, [6, NAN, 8, -98, NAN, -2]),
        ({"valid_min": np.int16(0)}, [5, NAN, 7, NAN, 2000, NAN]),
        ({"valid_max": np.int16(6), "scale_factor": 2.0}, [10, -65536, NAN, -198, NAN, -6]),
        ({"_Unsigned": "true"}, [5, 32768, 7, 65437, 2000, 65533]),
        ({"_Unsigned": "true", "_FillValue": np.int16(-99)}, [5, 32768, 7, NAN, 2000, 65533]),
    ],
)
@pytest.mark.parametrize("order", ["<", ">"])
def test_hdf5_packed_and_missing(tmp_path: Path, attributes: dict[str, Any], right: Any, order: str) -> None:
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["x"] = PACKED.astype(f"{order}i2")
        file["x"].attrs.update(attributes)
        file["m"] = np.column_stack([PACKED, PACKED])
        file["m"].attrs.update(attributes)
    table = read(tmp_path / "a.h5", "hdf5")
    np.testing.assert_array_equal(column(table, "x"), right)
    np.testing.assert_array_equal(column(table, "m[2]"), right)


def test_hdf5_numbers_never_written_and_odd_attributes(tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "a.h5", "w") as file:
        for name, fill in (("said", -9999.0), ("zero", 0.0), ("half", 1e20)):
            file.create_dataset(name, (6,), "f4" if name == "half" else "f8", fillvalue=fill)[:3] = [1, 2, 3]
        file["half"].attrs["_FillValue"] = 1e20  # not as the cells have it
        file["half"].attrs.update({"scale": 0.01, "offset": 3.0})
        for name, value in (("each", [1.0, 2.0]), ("range", [1.0])):
            file[name] = np.column_stack([PACKED, PACKED])
            file[name].attrs["scale_factor" if name == "each" else "valid_range"] = value
    table = read(tmp_path / "a.h5", "hdf5")
    np.testing.assert_array_equal(column(table, "said"), [1, 2, 3, NAN, NAN, NAN])
    np.testing.assert_array_equal(column(table, "half"), [1, 2, 3, NAN, NAN, NAN])
    np.testing.assert_array_equal(column(table, "zero"), [1, 2, 3, 0, 0, 0])
    assert "scale_factor has 2 values, not 1" in told(table, "each")
    assert list(table.odd.elements()) == 2 * ["attributes of half change no number (scale, offset): a mapping can"]
    assert "valid_range has 1 values, not 2" in told(table, "range")


@pytest.mark.parametrize(
    ("attribute", "value", "why"),
    [
        ("scale_factor", "0.1 N", "scale_factor is no number"),
        ("scale_factor", 0.0, "scale_factor is 0.0"),
        ("scale_factor", NAN, "scale_factor is nan"),
        ("add_offset", np.array([]), "add_offset has 0 values, not 1"),
        ("_FillValue", b"none", "_FillValue is no number"),
        ("valid_min", None, "valid_min is no number"),
    ],
)
def test_an_odd_hdf5_attribute_costs_its_data_set_alone(tmp_path: Path, attribute: str, value: Any, why: str) -> None:
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["run/good"], file["run/bad"] = T, T
        file["run/bad"].attrs[attribute] = h5py.Empty("f8") if value is None else value
        kind = h5py.h5t.UNIX_D32LE  # of times, which NumPy has not
        h5py.h5d.create(file.id, b"times", kind, h5py.h5s.create_simple((3,)))
    table = read(tmp_path / "a.h5", "hdf5")
    assert names(table) == ["run/good"]
    assert told(table, "run/bad") == f"run/bad: its attribute {why}"
    assert "cannot be read" in told(table, "times")
    with pytest.raises(RecordingError, match=f"no column 'run/bad'; run/bad: its attribute {why}"):
        find_column(table, "run/bad")


def test_hdf5_records_of_several_numbers_and_words(tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    rows = np.zeros(20, np.dtype([("index", "i8"), ("values_block_0", "f8", (3,)), ("deep", "f8", (2, 2))]))
    rows["index"], rows["values_block_0"][:, 1] = np.arange(20), T
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["df/table"] = rows
        file["when"] = [f"2026-01-31T12:00:{i:02d}" for i in range(20)]
        file["z"] = np.ones(20, complex)
        file["cube"] = np.ones((2, 2, 2))
    table = read(tmp_path / "a.h5", "hdf5")
    np.testing.assert_array_equal(column(table, "df/table[values_block_0][2]"), T)
    np.testing.assert_array_equal(column(table, "df/table[index]"), np.arange(20))
    assert cells(table, "when")[-1] == "2026-01-31T12:00:19"
    assert "complex" in told(table, "z")
    assert "3 dimensions" in told(table, "cube")
    assert "dimensions" in told(table, "df/table[deep]")


def test_hdf5_reads_no_other_file(tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    (tmp_path / "secret").write_bytes(b"root:x:0:0" * 8)
    with h5py.File(tmp_path / "other.h5", "w") as file:
        file["x"] = T
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file.create_dataset("e", (10,), "f8", external=[(str(tmp_path / "secret"), 0, 80)])
        layout = h5py.VirtualLayout((20,), "f8")
        layout[:] = h5py.VirtualSource(tmp_path / "other.h5", "x", shape=(20,))
        file.create_virtual_dataset("v", layout)
        file["link"] = h5py.ExternalLink(tmp_path / "other.h5", "x")
        file["own"] = T
    table = read(tmp_path / "a.h5", "hdf5")
    assert names(table) == ["own"]
    assert "other files" in told(table, "e")
    assert "other files" in told(table, "v")


def test_wide_matrices_are_read_once(tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    matrix = np.arange(2000.0 * 500).reshape(2000, 500)
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file.create_dataset("m", data=matrix, chunks=(2000, 500), compression="gzip")
        file.create_dataset("w", data=matrix.T, chunks=(500, 2000), compression="gzip")
    table = read(tmp_path / "a.h5", "hdf5")
    (all_of_them,) = table.chunks(names(table))
    np.testing.assert_array_equal(np.column_stack(all_of_them[:500]), matrix)
    np.testing.assert_array_equal(np.column_stack(all_of_them[500:]), matrix)


@pytest.mark.parametrize("version", ["4", "5"])
def test_matlab_kinds(tmp_path: Path, version: str) -> None:
    from scipy.io import savemat
    from scipy.sparse import csc_matrix

    plain = {"x": T, "big": T.astype(">f8"), "n": T.astype("i2"), "c": "text", "z": T + 1j}
    others = {
        "Joint": {"angle": np.vstack([T, 2 * T]), "in": {"t": T}},
        "many": np.array([(1.0, T), (2.0, -T)], dtype=[("a", "O"), ("x", "O")]),
        "cell": np.array([T, "a"], dtype=object),
        "flag": T > 2,
        "empty": np.empty((0, 0)),
    }
    savemat(
        tmp_path / "a.mat", plain | {"s": csc_matrix(np.eye(20))} | (others if version == "5" else {}), format=version
    )
    table = read(tmp_path / "a.mat", "matlab")
    for name in ("x", "big", "n"):
        np.testing.assert_array_equal(column(table, name), plain[name])
    assert all(told(table, name) for name in ("c", "z", "s"))
    if version == "5":
        np.testing.assert_array_equal(column(table, "Joint.angle[2]"), 2 * T)
        np.testing.assert_array_equal(column(table, "Joint.in.t"), T)
        np.testing.assert_array_equal(column(table, "flag"), T > 2)
        np.testing.assert_array_equal(column(table, "many.a"), [1.0, 2.0])
        np.testing.assert_array_equal(column(table, "many(2).x"), -T)
        assert "cells" in told(table, "cell")
        assert not told(table, "empty")


def test_matlab_7_3_kinds(tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "a.mat", "w", userblock_size=512) as file:
        for name, data, kind in (
            ("t", T[None, :], "double"),
            ("Joint/angle", np.column_stack([T, 2 * T]), "double"),
            ("word", np.frombuffer("Ada Lovelace".encode("utf-16-le"), "u2")[:, None], "char"),
            ("none", np.array([0, 0], dtype="u8"), "double"),
            ("s/data", T, "double"),
            ("#refs#/a", T[None, :], "double"),
            ("#refs#/b", -T[None, :], "double"),
            ("#refs#/c", np.array([[3.0]]), "double"),
        ):
            file[name] = data
            file[name].attrs["MATLAB_class"] = np.bytes_(kind)
        for field, places in (("x", "ab"), ("n", "cc")):
            cells = file.create_dataset(f"many/{field}", (2, 1), h5py.ref_dtype)
            cells[:, 0] = [file[f"#refs#/{place}"].ref for place in places]
        file["none"].attrs["MATLAB_empty"] = np.uint8(1)
        file["s"].attrs["MATLAB_sparse"] = np.uint64(20)
    table = read(tmp_path / "a.mat", "matlab")
    assert names(table) == ["Joint.angle[1]", "Joint.angle[2]", "many.n", "many(1).x", "many(2).x", "t"]
    np.testing.assert_array_equal(column(table, "many(2).x"), -T)
    np.testing.assert_array_equal(column(table, "many.n"), [3.0, 3.0])
    np.testing.assert_array_equal(column(table, "Joint.angle[2]"), 2 * T)
    assert told(table, "word")
    assert "sparse" in told(table, "s.data")


@pytest.mark.parametrize("kind", ["categorical", "duration", "timeseries", "containers.Map"])
def test_matlab_7_3_objects_are_no_numbers(tmp_path: Path, kind: str) -> None:
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "a.mat", "w", userblock_size=512) as file:
        file["x"], file["o"] = T[None, :], np.array([[0xDD000000, 2, 1, 1, 1, 1]], "u4")
        file["o"].attrs["MATLAB_class"] = np.bytes_(kind)
    table = read(tmp_path / "a.mat", "matlab")
    assert names(table) == ["x"]
    assert kind in told(table, "o")


def test_a_square_matrix_has_the_same_columns_in_every_version(tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    from scipy.io import savemat

    square = np.arange(9.0).reshape(3, 3)
    savemat(tmp_path / "5.mat", {"m": square})
    with h5py.File(tmp_path / "7.3.mat", "w", userblock_size=512) as file:
        file["m"] = square.T
    for version in ("5", "7.3"):
        np.testing.assert_array_equal(column(read(tmp_path / f"{version}.mat", "matlab"), "m[1]"), [0.0, 3.0, 6.0])


@pytest.mark.parametrize("version", ["v7", "v7.3"])
@pytest.mark.filterwarnings("ignore")
def test_matlab_tables_and_timetables(tmp_path: Path, version: str) -> None:
    matio = pytest.importorskip("matio")
    matio_utils = pytest.importorskip("matio.utils")
    import pandas as pd

    since = pd.Index(pd.to_timedelta(T, unit="s"), name="Time")
    dated = pd.Index(pd.Timestamp("2026-01-31T12:00:00.000125") + since, name="when")
    timetable = pd.DataFrame({"Fx": 3.0 * T, "n": np.arange(20, dtype=np.int32)}, index=since)
    series = matio_utils.MatlabOpaque(properties={"Data_": T}, classname="timeseries")
    variables = {
        "x": T,
        "tt": timetable,
        "run": {"dt": timetable.set_index(dated), "y": -T},
        "tb": pd.DataFrame({"t": T, "after": since, "word": ["a"] * 20}),
        "ts": series,
    }
    matio.save_to_mat(tmp_path / "a.mat", variables, version=version)
    table = read(tmp_path / "a.mat", "matlab")
    np.testing.assert_array_equal(column(table, "x"), T)
    np.testing.assert_array_equal(column(table, "run.y"), -T)
    np.testing.assert_array_equal(column(table, "tt.Fx"), 3.0 * T)
    np.testing.assert_array_equal(cells(table, "run.dt.n"), np.arange(20))
    np.testing.assert_array_equal(column(table, "tb.after"), T)
    clocks = {one.name: one.clock for one in table.columns}
    assert (clocks["tt.Fx"], clocks["run.dt.Fx"], clocks["tb.t"]) == ("tt.Time", "run.dt.when", "")
    np.testing.assert_array_equal(cells(table, "tt.Time").astype("i8"), np.rint(T * 1e9))
    exact = np.datetime64("2026-01-31T12:00:00.500125", "ns")
    assert abs(cells(table, "run.dt.when")[1] - exact) < np.timedelta64(300, "ns")  # as doubles of ms have it
    assert told(table, "tb.word") and "timeseries" in told(table, "ts") and "x.Time" in told(table, "ts")


@pytest.mark.parametrize("uniform", [False, True])
@pytest.mark.parametrize("along", ["rows", "pages"])
@pytest.mark.filterwarnings("ignore")
def test_a_timeseries_is_read_by_its_own_time(tmp_path: Path, uniform: bool, along: str) -> None:
    """Objects with the properties that MATLAB stores; a uniform time is described, and in no column."""
    matio = pytest.importorskip("matio")
    from matio.utils import MatlabOpaque

    data = np.column_stack([3.0 * T, -T])
    step = 1e3 * (T[1] - T[0])
    about = {"Start_": [[1e3 * T[0]]], "Increment_": [[step]], "Length": [[len(T)]], "Units": "milliseconds"}
    properties = {
        "Data_": data if along == "rows" else data.T[:, None, :],
        "Time_": np.empty((0, 0)) if uniform else 1e3 * T[:, None],
        "TimeInfo": MatlabOpaque(
            properties={key: value if isinstance(value, str) else np.array(value) for key, value in about.items()},
            classname="tsdata.timemetadata",
        ),
    }
    matio.save_to_mat(tmp_path / "a.mat", {"ts": MatlabOpaque(properties=properties, classname="timeseries")})
    table = read(tmp_path / "a.mat", "matlab")
    assert [one.name for one in table.columns] == ["ts.Time", "ts.Data[1]", "ts.Data[2]"]
    assert {one.clock for one in table.columns[1:]} == {"ts.Time"}
    np.testing.assert_allclose(cells(table, "ts.Time").astype("i8"), 1e9 * T, atol=1.0)
    np.testing.assert_array_equal(column(table, "ts.Data[2]"), -T)


@pytest.mark.filterwarnings("ignore")
def test_the_units_of_a_timetable_are_read(tmp_path: Path) -> None:
    matio = pytest.importorskip("matio")
    import pandas as pd
    from matio.utils import MatlabOpaque
    from matio.utils.converters.mattables import timetable_to_mat

    since = pd.Index(pd.to_timedelta(T, unit="s"), name="Time")
    made = timetable_to_mat(pd.DataFrame({"Fx": T, "Ty": -T}, index=since))
    units = np.empty((1, 2), dtype=object)
    units[0] = ["N", "N*m"]
    made["any"][0, 0]["varUnits"] = units
    opaque = MatlabOpaque(properties=made, classname="timetable")
    matio.save_to_mat(tmp_path / "a.mat", {"tt": opaque}, saveobj_classes=["timetable"])
    assert [one.unit for one in read(tmp_path / "a.mat", "matlab").columns] == ["datetime", "N", "N*m"]


def element(kind: int, data: bytes) -> bytes:
    """An element of a .mat file of version 5."""
    return np.array([kind, len(data)], "<u4").tobytes() + data + bytes(-len(data) % 8)


def test_matlab_objects_and_variables_of_one_name(tmp_path: Path) -> None:
    from scipy.io import savemat

    for name, x in (("a", T), ("b", -T)):
        savemat(tmp_path / f"{name}.mat", {"x": x} | ({"y": x} if name == "a" else {}))
    head, again = ((tmp_path / f"{name}.mat").read_bytes() for name in ("a", "b"))
    flags = [element(6, np.array([kind, 0], "<u4").tobytes()) for kind in (17, 13)]
    inner = element(5, np.array([6, 1], "<i4").tobytes()) + element(1, b"") + element(6, bytes(24))
    words = b"".join(element(1, word) for word in (b"tt", b"MCOS", b"timetable"))
    made = element(14, flags[0] + words + element(14, flags[1] + inner))
    (tmp_path / "c.mat").write_bytes(head + again[128:] + made)
    table = read(tmp_path / "c.mat", "matlab")
    assert names(table) == ["y"]
    assert "2 are called so" in told(table, "x")
    assert "an object" in told(table, "None")


def test_matlab_4_variables_of_one_name(tmp_path: Path) -> None:
    from scipy.io import savemat

    savemat(tmp_path / "a.mat", {"x": T}, format="4")
    data = (tmp_path / "a.mat").read_bytes()
    (tmp_path / "a.mat").write_bytes(data + data)
    assert "2 are called so" in told(read(tmp_path / "a.mat", "matlab"), "x")


def test_numpy_kinds(tmp_path: Path) -> None:
    rows = np.zeros(20, np.dtype([("t", "M8[ms]"), ("F", ">f4", (3,)), ("z", "c16")]))
    rows["t"], rows["F"][:, 2] = np.arange(20).astype("M8[ms]"), T
    np.save(tmp_path / "a.npy", rows)
    table = read(tmp_path / "a.npy", "numpy")
    np.testing.assert_array_equal(column(table, "F[3]"), T)
    assert cells(table, "t").dtype.kind == "M"
    assert "complex" in told(table, "z")
    np.save(tmp_path / "f.npy", np.asfortranarray(np.column_stack([T, 2 * T]).astype(">f8")))
    np.testing.assert_array_equal(column(read(tmp_path / "f.npy", "numpy"), "[2]"), 2 * T)
    np.savez_compressed(tmp_path / "a.npz", t=T, run=rows)
    packed = read(tmp_path / "a.npz", "numpy")
    np.testing.assert_array_equal(column(packed, "run[F][3]"), T)
    np.save(tmp_path / "o.npy", np.array([1, "a"], dtype=object))
    np.savez(tmp_path / "o.npz", o=np.array([1, "a"], dtype=object))
    for name in ("r.npy", "r.npz"):
        (tmp_path / name).write_bytes(np.random.default_rng(1).bytes(5000))
    for name in ("o.npy", "o.npz", "r.npy", "r.npz"):
        with pytest.raises(ValueError, match="it holds no numbers that NumPy can read: damaged, or objects"):
            list(read(tmp_path / name, "numpy").series())


def test_parquet_kinds(tmp_path: Path) -> None:
    import decimal

    import pyarrow as pa
    import pyarrow.parquet as pq

    absent = [None, *T[1:].tolist()]
    stamps = np.datetime64("2026-01-31T12:00:00", "us") + np.arange(20)
    arrays = {
        "null": pa.array(absent),
        "whole": pa.array([None, *range(1, 20)], pa.int32()),
        "kind": pa.array(T.tolist()).dictionary_encode(),
        "dec": pa.array([decimal.Decimal("0.1")] * 20, pa.decimal128(30, 20)),
        "flag": pa.array((T > 2).tolist()),
        "zone": pa.array(stamps, pa.timestamp("us", "America/New_York")),
        "lasts": pa.array((T * 1e9).astype("i8"), pa.duration("ns")),
        "half": pa.array([None, *(T[1:] + 1e5)], pa.float32()),
        "list": pa.array([[1.0]] * 20),
        "struct": pa.array([{"a": 1.0}] * 20),
    }
    pq.write_table(pa.table(arrays), tmp_path / "a.parquet")
    table = read(tmp_path / "a.parquet", "parquet")
    np.testing.assert_array_equal(column(table, "null"), [NAN, *T[1:]])
    np.testing.assert_array_equal(column(table, "whole"), [NAN, *range(1, 20)])
    np.testing.assert_array_equal(column(table, "kind"), T)
    np.testing.assert_array_equal(column(table, "dec"), [0.1] * 20)
    np.testing.assert_array_equal(column(table, "flag"), T > 2)
    np.testing.assert_array_equal(column(table, "lasts"), T)
    np.testing.assert_array_equal(cells(table, "zone"), stamps.astype("M8[ns]"))
    assert cells(table, "half").dtype == np.float32  # which tells how coarse times are
    assert all(told(table, name) for name in ("list", "struct"))
    twice = pa.Table.from_arrays([pa.array(T), pa.array(T), pa.array(T)], names=["a", "a", "b"])
    pq.write_table(twice, tmp_path / "b.parquet")
    table = read(tmp_path / "b.parquet", "parquet")
    assert names(table) == ["b"]
    assert "several" in told(table, "a")


def tdms(path: Path, *segments: dict[str, Any]) -> Table:
    nptdms = pytest.importorskip("nptdms")
    with nptdms.TdmsWriter(path) as writer:
        for properties in segments:
            writer.write_segment([nptdms.ChannelObject("g", "a", T, properties=properties)])
    return read(path, "tdms")


def test_tdms_clocks(tmp_path: Path) -> None:
    noon = np.datetime64("2026-01-31T12:00:00")
    whole = {"wf_start_time": noon, "wf_increment": 0.25, "wf_start_offset": 2.0}
    table = tdms(tmp_path / "a.tdms", whole, {})
    np.testing.assert_array_equal(column(table, "g/a"), [*T, *T])
    assert cells(table, "g/a: time")[-1] == noon + np.timedelta64(2000 + 39 * 250, "ms")
    assert names(tdms(tmp_path / "b.tdms", whole | {"wf_increment": 0.0})) == ["g/a"]
    later = tdms(tmp_path / "c.tdms", whole, whole | {"wf_start_time": noon + np.timedelta64(5, "m")})
    assert names(later) == ["g/a"]
    assert "within the file" in told(later, "g/a")


SCALE = {
    "NI_Number_Of_Scales": 1,
    "NI_Scaling_Status": "unscaled",
    "NI_Scale[0]_Scale_Type": "Linear",
    "NI_Scale[0]_Linear_Slope": 0.5,
    "NI_Scale[0]_Linear_Y_Intercept": 1.0,
    "NI_Scale[0]_Linear_Input_Source": 0xFFFFFFFF,
}


def test_tdms_scales_and_units(tmp_path: Path) -> None:
    table = tdms(tmp_path / "a.tdms", SCALE | {"NI_UnitDescription": "N"}, SCALE)
    np.testing.assert_array_equal(column(table, "g/a"), [*(0.5 * T + 1.0), *(0.5 * T + 1.0)])
    assert table.columns[0].unit == "N"
    for name, segments, why in (
        ("scale", (SCALE, SCALE | {"NI_Scale[0]_Linear_Slope": 5.0}), "within the file"),
        ("unit", ({"unit_string": "deg"}, {"unit_string": "rad"}), "within the file"),
        ("unknown", (SCALE | {"NI_Scale[0]_Scale_Type": "Bridge"},), "'Bridge' is not known"),
    ):
        table = tdms(tmp_path / f"{name}.tdms", *segments)
        assert not table.columns
        assert why in told(table, "g/a")


def test_tdms_frequencies_are_no_time(tmp_path: Path) -> None:
    table = tdms(tmp_path / "a.tdms", {"wf_increment": 1.0, "wf_xunit_string": "Hz"})
    assert names(table) == ["g/a"]
    assert "'Hz'" in told(table, "g/a: time")


def test_tdms_channels_of_one_name(tmp_path: Path) -> None:
    nptdms = pytest.importorskip("nptdms")
    with nptdms.TdmsWriter(tmp_path / "a.tdms") as writer:
        writer.write_segment([nptdms.ChannelObject("g/x", "a", T), nptdms.ChannelObject("g", "x/a", -T)])
    assert "2 are called so" in told(read(tmp_path / "a.tdms", "tdms"), "g/x/a")


def test_tdms_that_breaks_off_and_an_index_of_another_file(tmp_path: Path) -> None:
    tdms(tmp_path / "a.tdms", {})
    data = (tmp_path / "a.tdms").read_bytes()
    (tmp_path / "a.tdms").write_bytes(data[:-40])
    (tmp_path / "a.tdms_index").write_bytes(b"nonsense")
    table = read(tmp_path / "a.tdms", "tdms")
    np.testing.assert_array_equal(column(table, "g/a"), T[:15])
    assert "breaks off" in next(iter(table.odd))


def mdf(path: Path, times: Any = T, **options: Any) -> Table:
    asammdf = pytest.importorskip("asammdf")
    invalid = np.zeros(20, bool)
    invalid[3:5] = True
    with asammdf.MDF(version="4.10") as file:
        file.append(
            [
                asammdf.Signal(T, times, name="a", **options),
                asammdf.Signal(T, times, name="b", invalidation_bits=invalid),
            ]
        )
        file.start_time = np.datetime64("2026-01-31T12:00:00").astype(object)
        file.save(path, overwrite=True)
    return read(path, "mdf")


@pytest.mark.slow
def test_mdf_masters_and_invalid_samples(tmp_path: Path) -> None:
    table = mdf(tmp_path / "a.mf4")
    np.testing.assert_array_equal(column(table, "b"), np.where((T == 1.5) | (T == 2.0), NAN, T))
    assert cells(table, "0: time")[1] == np.datetime64("2026-01-31T12:00:00.5")
    assert "taken for UTC: it begins at 2026-01-31 12:00:00" in next(iter(table.odd))


def master_of(group: Any, **changes: Any) -> None:
    for name, value in changes.items():
        setattr(group.channels[0], name, value)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "name", "why"),
    [
        (lambda group: master_of(group, unit="ms"), "0: time", "stated in 'ms', not in s"),
        (lambda group: master_of(group, sync_type=0), "0: time", "of no stated kind"),
        (lambda group: setattr(group.channels[1], "flags", 1), "a", "not valid"),
    ],
    ids=["master in ms", "master of no kind", "all invalid"],
)
def test_mdf_that_states_what_its_numbers_are_not(
    tmp_path: Path, change: Callable[[Any], None], name: str, why: str
) -> None:
    asammdf = pytest.importorskip("asammdf")
    with asammdf.MDF(version="4.10") as file:
        file.append([asammdf.Signal(T, T, name="a"), asammdf.Signal(T, T, name="b")])
        change(file.groups[0])
        file.save(tmp_path / "a.mf4", overwrite=True)
    table = read(tmp_path / "a.mf4", "mdf")
    assert why in told(table, name)
    assert name not in names(table)


@pytest.mark.slow
def test_mdf_that_declares_rows_that_are_not_there(tmp_path: Path) -> None:
    path = tmp_path / "a.mf4"
    assert not any("rows" in one for one in (*mdf(path).odd, *mdf(path).left_out))
    data = bytearray(path.read_bytes())
    group = data.index(b"##CG")
    at = group + 24 + 8 * data[group + 16] + 8  # behind links and record number
    for rows, why in ((30, "ends before the rows that it declares"), (10**12, "1000000000000 rows, far more")):
        data[at : at + 8] = rows.to_bytes(8, "little")
        path.write_bytes(data)
        table = read(path, "mdf")
        assert why in " ".join((*table.odd, *table.left_out))


@pytest.mark.slow
@pytest.mark.parametrize("formula", ["X*X", "X*missing"])
def test_mdf_formulas_are_no_numbers(tmp_path: Path, formula: str) -> None:
    table = mdf(tmp_path / "a.mf4", conversion={"formula": formula})
    assert names(table) == ["0: time", "b"]
    assert "formula" in told(table, "a")


@pytest.mark.slow
def test_mdf_3_has_units_in_its_conversions(tmp_path: Path) -> None:
    asammdf = pytest.importorskip("asammdf")
    with asammdf.MDF(version="3.30") as file:
        file.append([asammdf.Signal(np.arange(20), T, name="a", unit="N", conversion={"a": 0.5, "b": 1.0})])
        file.save(tmp_path / "a.mdf", overwrite=True)
    table = read(tmp_path / "a.mdf", "mdf")
    assert [one.unit for one in table.columns if one.name == "a"] == ["N"]
    np.testing.assert_array_equal(column(table, "a"), 0.5 * np.arange(20) + 1.0)


@pytest.mark.slow
@pytest.mark.parametrize("kind", [("angle", 2), ("distance", 3), ("index", 4)])
def test_mdf_masters_that_are_no_time(tmp_path: Path, kind: tuple[str, int]) -> None:
    table = mdf(tmp_path / "a.mf4", master_metadata=kind)
    assert all(not one.clock for one in table.columns)
    assert kind[0] in told(table, "0: time")


@pytest.mark.slow
def test_mdf_masters_of_half_size_that_are_too_coarse(tmp_path: Path) -> None:
    assert not told(mdf(tmp_path / "a.mf4", times=T.astype(np.float32)), "0: time")
    table = mdf(tmp_path / "b.mf4", times=(T + 4e6).astype(np.float32))
    assert "floats of 32 bits know these times to 0.25 s only; rows come every 0.5" in told(table, "0: time")
    assert all(not one.clock for one in table.columns)


def test_a_data_set_of_which_next_to_nothing_was_written_is_named_and_not_read(tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file.create_dataset("hollow", (10**10,), "f8", chunks=(1 << 16,))
        file["hollow"][:3] = 1.0
        file.create_dataset("flat", data=np.zeros(1 << 20), chunks=True, compression="gzip")
        file["sound"] = np.arange(4.0)
    table = read(tmp_path / "a.h5", "hdf5")
    assert names(table) == ["flat", "sound"]
    assert told(table, "hollow") == "hollow: next to none of its 10000000000 numbers was written"


def test_numbers_of_hdf5_that_are_compressed_together_are_unpacked_once(tmp_path, monkeypatch):
    h5py = pytest.importorskip("h5py")
    rows = 150_000
    values = np.arange(4 * rows, dtype=np.float64).reshape(rows, 4)
    records = np.zeros(rows, dtype=[("Fx", "f8"), ("T", "f8", (3,))])
    records["Fx"], records["T"] = values[:, 0], values[:, 1:]
    with h5py.File(tmp_path / "a.h5", "w") as file:
        for name, data in {"x": values[:, 0], "m": values, "w": values.T, "r": records}.items():
            file.create_dataset(name, data=data, chunks=data.shape, compression="gzip", compression_opts=1)
    table = read(tmp_path / "a.h5", "hdf5")
    unpacked: list[Any] = []
    get = h5py.Dataset.__getitem__
    monkeypatch.setattr(h5py.Dataset, "__getitem__", lambda data, key: unpacked.append(key) or get(data, key))
    stretches = list(table.chunks(names(table)))
    found = dict(zip(names(table), (np.concatenate(one) for one in zip(*stretches, strict=True)), strict=True))
    wide = {f"{name}[{1 + k}]": values[:, k] for name in ("m", "w") for k in range(4)}
    fields = {"r[Fx]": values[:, 0]} | {f"r[T][{k}]": values[:, k] for k in (1, 2, 3)}
    for name, right in ({"x": values[:, 0]} | wide | fields).items():
        np.testing.assert_array_equal(found.pop(name), right)
    assert not found and len(stretches) == 3 and len(unpacked) == 4


def test_data_sets_of_hdf5_that_are_empty_keep_no_other_from_being_read(tmp_path):
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["x"], file["none"], file["wide"] = T, np.zeros(0), np.zeros((0, 3))
        file["records"] = np.zeros(0, dtype=[("Fx", "f8")])
    table = read(tmp_path / "a.h5", "hdf5")
    lengths = dict.fromkeys(names(table), 0)
    for stretch in table.chunks(names(table)):
        for name, one in zip(names(table), stretch, strict=True):
            lengths[name] += len(one)
    assert lengths == dict.fromkeys(lengths, 0) | {"x": len(T)} and {"none", "records[Fx]"} < set(lengths)
