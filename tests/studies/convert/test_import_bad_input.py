"""Bad files and mappings are refused with the place and the remedy; what is merely doubtful is counted."""

from __future__ import annotations

import os
import re
import socket
import tomllib
from collections.abc import Callable
from importlib.machinery import ModuleSpec
from pathlib import Path

import numpy as np
import pytest

from kbs_process.campaign.load import load_campaign
from kbs_process.campaign.units import agree
from kbs_process.errors import ConfigError, KbsError, OutputError, RecordingError
from kbs_process.recordings import isolated
from kbs_process.reduction.commands import read_commands
from kbs_process.results.store import LIST
from kbs_process.studies.convert.clock import nanoseconds
from kbs_process.studies.convert.describe import describe
from kbs_process.studies.convert.mapping_file import Time
from kbs_process.studies.convert.run import import_recordings
from studies.convert.importer_files import (
    CAMPAIGN,
    MAPPING,
    UNITS,
    Writer,
    read_back,
    signals,
    write_csv,
    write_hdf5,
    write_mapping,
    write_mdf,
    write_parquet,
    write_tdms,
)


def _import(folder: Path, file: str, mapping: str = MAPPING, notices: list[str] | None = None) -> Path:
    return import_recordings(
        write_mapping(folder, file, mapping),
        folder,
        folder / "campaign",
        notice=None if notices is None else notices.append,
    )


@pytest.mark.parametrize(("name", "refused"), [("Fy [kN]", True), ("Fy (N)", False), ("Fy (bridge 4)", False)])
def test_a_unit_in_a_column_s_name_contradicts_the_mapping(tmp_path: Path, name: str, refused: bool) -> None:
    write_csv(tmp_path / "log.csv", signals(500))
    text = (tmp_path / "log.csv").read_text()
    (tmp_path / "log.csv").write_text(re.sub(r"\bFy\b", name, text, count=1))
    mapping = MAPPING.replace('"Fy"', f'"{name}"')
    if not refused:
        _import(tmp_path, "log.csv", mapping)
        return
    with pytest.raises(RecordingError, match=r"'Fy \[kN\]' is in 'kN' as the file states it, in 'N' as"):
        _import(tmp_path, "log.csv", mapping)


@pytest.mark.parametrize("times", ["03/05/2026 11:59:00 PM", "03.05.2026 23:59"])
def test_dates_that_are_no_iso_8601_are_told_how_to_be_written(tmp_path: Path, times: str) -> None:
    write_csv(tmp_path / "log.csv", signals(500))
    head, *rows = (tmp_path / "log.csv").read_text().splitlines()
    place = head.split(",").index("t") if "t" in head.split(",") else 0
    dated = [",".join(times if k == place else cell for k, cell in enumerate(row.split(","))) for row in rows]
    (tmp_path / "log.csv").write_text("\n".join([head, *dated]))
    with pytest.raises(RecordingError, match="a date as ISO 8601 writes it, such as 2026"):
        _import(tmp_path, "log.csv", MAPPING.replace('unit = "s"', 'unit = "datetime"'))


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("[wrench]", "[wrensh]", "did you mean 'wrench'?"),
        ("Fz =", "Fq =", "wrench.Fq: is not a key that is known here\n  -> known: Fx, Fy, Fz, Tx, Ty, Tz"),
        ('unit = "rad"', 'unit = "degree"', "did you mean 'deg'?"),
        ('"Fx", unit = "N"', '"Fx", unit = "N m"', "unit of torque"),
        ('role = "fit"', 'role = "fitt"', "did you mean 'fit'?"),
        ("[time]", 'format = "hdf"\n[time]', "'hdf' is not allowed\n  -> did you mean 'hdf5'?"),
        ('unit = "s"', 'unit = "s"\nrate_Hz = 100.0', "delete one of the two"),
        ("wheel =", "wheal =", "wheel"),
        ("description/campaign.toml", "campaign.toml", "does not exist"),
        ("repeat = 1", "repeat = 1\nstart_s = 5.0\nend_s = 4.0", "is not after start_s"),
        ('"SOURCE"', '"../SOURCE"', "no file of the source folder"),
        ("[[recording]]", '[turn]\njoint = "wheel"\naxis = [0, 0, 2]\nfactor = 1.0\n[[recording]]', "unit vector"),
        ('unit = "s"', 'unit = "s"\nstart = 2026-01-31T12:00:00', "offset from UTC"),
    ],
)
def test_faults_of_the_mapping(tmp_path: Path, old: str, new: str, said: str) -> None:
    write_csv(tmp_path / "run.csv", signals(20))
    assert old in MAPPING
    with pytest.raises(ConfigError) as caught:
        _import(tmp_path, "run.csv", MAPPING.replace(old, new))
    assert said in str(caught.value)
    assert ".toml" in caught.value.where
    assert ".new-" not in str(caught.value)  # a private folder, which the user does not know
    assert not (tmp_path / "campaign").exists()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("t,Fx,Fy,Fz_N,angle\n0,1,2,3,4\n", "did you mean 'Fz_N'"),
        ("t:Fx:Fy:Fz:angle\n0:1:2:3:4\n", "set the delimiter"),
        ("", "the file is empty"),
        ("t,Fx,Fy,Fz,angle\n", "line 1 is the last one, and no table is there"),
        ("\n\n0,1,2,3,4\n", "line 3 is the last one, and no table is there"),
        ("I am no table at all", "line 1 is the last one, and no table is there"),
        ("t,Fx,Fy,Fz\n" + "0,1,2,3,4\n1,2,3,4,5\n", "line of names has 4 cells, and its rows have 5"),
        ("t,Fx,Fx,Fx (2),Fy,Fz,angle\n0,1,9,5,2,3,0\n", "known: Fx .1., Fx .2., Fx .3."),
        ("t,Fx,Fy,Fz,angle\n-1,1,2,3,4\n", "give the date of time zero"),
        ("t,Fx,Fy,Fz,angle\n\xff", "not text in utf-8"),
        ("t,Fx,Fy,Fz,angle\n0,a,b,c,4\n1,a,b,,5\n", "no number of 'wrench' for recording 'turn_1': 2 rows"),
    ],
)
def test_faults_of_a_text_file(tmp_path: Path, text: str, said: str) -> None:
    (tmp_path / "run.csv").write_bytes(text.encode("latin-1"))
    with pytest.raises(RecordingError, match=said) as caught:
        _import(tmp_path, "run.csv")
    assert "run.csv" in caught.value.where
    assert not (tmp_path / "campaign").exists()
    assert not list(tmp_path.glob("*.new-*"))


def test_doubtful_cells_are_kept_and_counted(tmp_path: Path) -> None:
    lines = ["t,Fx,Fy,Fz,angle", "0,1,2,3,0", "1,overload,2,3,0", "1,inf,,3,0", ",1,2,3,0", "0.5,7,2,3,0"]
    (tmp_path / "run.csv").write_text("\n".join(lines))
    notices: list[str] = []
    folder = _import(tmp_path, "run.csv", notices=notices)
    stamp, wrench = read_back(folder, "turn_1")["wrench"]
    np.testing.assert_array_equal(stamp, np.array([0, 500, 1000, 1000]) * 1_000_000)
    np.testing.assert_array_equal(wrench[:, 0], [1.0, 7.0, np.nan, np.inf])
    for finding in (
        "2 cells of 'wrench' hold no number",
        "1 values of 'wrench' are infinite",
        "1 time stamps of 'wrench' repeat",
        "1 time stamps of 'wrench' lie before",
        "1 rows have no time",
    ):
        assert any(finding in notice for notice in notices), finding
    stated = tomllib.loads((folder / "campaign.toml").read_text())["source"]["file"][0]
    assert [f"{stated['name']}, {finding}" for finding in stated["findings"]] == notices


@pytest.mark.parametrize(
    ("by", "said"),
    [(3600.0, "summer to winter"), (43200.0, "twelve hours"), (65.536, "counter of 16 bits"), (40.0, "was set back")],
)
def test_why_time_goes_back_is_told_by_how_far(tmp_path: Path, by: float, said: str) -> None:
    t = np.arange(4000) * 0.05
    t[2000:] -= by
    write_csv(tmp_path / "run.csv", {**signals(4000), "t": t})
    with pytest.raises(RecordingError, match="at sample 2001, and goes on from there: ") as caught:
        _import(tmp_path, "run.csv")
    assert said in str(caught.value)


@pytest.mark.parametrize(
    ("before", "after", "said"),
    [
        ("SOURCE", "x" * 5000, "there is no 'xxx"),
        ("SOURCE", "../run.csv", "is no file of the source folder"),
        ("SOURCE", "/etc/passwd", "is no file of the source folder"),
        ("repeat = 1", "repeat = 1\nstart_s = 1e308", "is greater than 1e.09"),
        ("repeat = 1", "repeat = 1\nstart_s = 1e9", "no sample of"),
        ("repeat = 1", 'repeat = 1\n[text]\nencoding = "\\u0000"', "embedded null"),
    ],
)
def test_odd_values_of_a_mapping_are_told(tmp_path: Path, before: str, after: str, said: str) -> None:
    write_csv(tmp_path / "run.csv", signals(20))
    plan = write_mapping(tmp_path, "run.csv", MAPPING.replace(before, after))
    with pytest.raises(KbsError, match=said):
        import_recordings(plan, tmp_path, tmp_path / "campaign")


@pytest.mark.parametrize(("digits", "rows"), [(0, 1998), (1, 1980), (2, 1800)])
def test_times_coarser_than_the_rows_are_refused(tmp_path: Path, digits: int, rows: int) -> None:
    t = np.floor(np.arange(2000) * 0.001 * 10**digits) / 10**digits
    write_csv(tmp_path / "run.csv", {**signals(2000), "t": t})
    with pytest.raises(RecordingError, match=f"too coarse: {rows} of 2000") as caught:
        _import(tmp_path, "run.csv")
    assert "give rate_Hz" in str(caught.value)


def test_rows_that_come_twice_are_told_and_left_out(tmp_path: Path) -> None:
    write_csv(tmp_path / "run.csv", {key: np.repeat(x, 2) for key, x in signals(2000).items()})
    told: list[str] = []
    stamp, values = read_back(_import(tmp_path, "run.csv", notices=told), "turn_1")["wrench"]
    assert np.array_equal(stamp, np.rint(1e9 * signals(2000)["t"]))
    assert np.array_equal(values[:, 0], signals(2000)["Fx"])
    assert any("2000 rows are those before them again" in line for line in told)


def test_a_table_of_which_most_lines_are_no_rows_is_another(tmp_path: Path) -> None:
    write_csv(tmp_path / "run.csv", signals(200))
    text = (tmp_path / "run.csv").read_text()
    (tmp_path / "run.csv").write_text(f"Logger 7, written by hand\nbegun, at noon\n{text}")
    with pytest.raises(RecordingError, match=r"201 of 202 lines are no rows of 2 cells .*first is line 3") as caught:
        describe(tmp_path / "run.csv")
    assert "skip_rows and rows" in str(caught.value)


def test_no_row_of_a_shuffled_file_is_far_from_the_others(tmp_path: Path) -> None:
    columns = {**signals(12000), "t": 0.01 * np.arange(12000)}
    order = np.random.default_rng(3).permutation(12000)
    write_csv(tmp_path / "run.csv", {key: x[order] for key, x in columns.items()})
    stamp, _ = read_back(_import(tmp_path, "run.csv"), "turn_1")["wrench"]
    assert len(stamp) == 12000


def test_times_as_floats_of_32_bits_are_refused_where_they_are_too_coarse() -> None:
    t = np.arange(2000) * 0.01
    with pytest.raises(
        RecordingError, match=r"floats of 32 bits know these times to 0.00781 s only; rows come every 0.01 s"
    ):
        nanoseconds((t + 1e5).astype(np.float32), Time.model_construct(), "t")
    stamp, known = nanoseconds((t + 100.0).astype(np.float32), Time.model_construct(), "t")
    assert known.all()
    np.testing.assert_allclose(stamp * 1e-9, t + 100.0, atol=1e-5)


def test_a_folder_with_something_in_it_is_left_alone(tmp_path: Path) -> None:
    write_csv(tmp_path / "run.csv", signals(20))
    folder = _import(tmp_path, "run.csv")
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    _import(tmp_path, "run.csv")  # nobody touched what is replaced
    assert before == {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    before[folder / "campaign.toml"] += b"# mine"
    (folder / "campaign.toml").write_bytes(before[folder / "campaign.toml"])
    with pytest.raises(OutputError, match="was changed since kbs-process wrote it"):
        _import(tmp_path, "run.csv")
    (folder / LIST).unlink()
    with pytest.raises(OutputError, match="nothing was changed"):
        _import(tmp_path, "run.csv")
    del before[folder / LIST]
    assert before == {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_unknown_preset_and_missing_source(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="did you mean 'smartwheel'"):
        import_recordings("smartweel", tmp_path, tmp_path / "campaign")
    with pytest.raises(RecordingError, match=r"published: github\.com/csu-hmc"):
        import_recordings("treadmill_fast", tmp_path, tmp_path / "campaign")
    with pytest.raises(RecordingError, match="tells no format"):
        (tmp_path / "run.xyz").write_text("1")
        describe(tmp_path / "run.xyz")


WRITERS = {"parquet": write_parquet, "h5": write_hdf5, "tdms": write_tdms, "mf4": write_mdf}


@pytest.mark.slow
@pytest.mark.parametrize(("suffix", "write"), WRITERS.items())
def test_damaged_binary_files(tmp_path: Path, suffix: str, write: Writer) -> None:
    """Garbage and truncation end in an error, or in the samples that are left; never in a dead interpreter."""
    whole = tmp_path / f"whole.{suffix}"
    write(whole, signals(2000))
    data = whole.read_bytes()
    rng = np.random.default_rng(3)
    for name, damaged in {
        "garbage": rng.bytes(5000),
        "half": data[: len(data) // 2],
        "head": data[:40] + rng.bytes(4000),
        "start": data[:64] + bytes(40) + data[104:],
        "middle": data[: len(data) // 3] + bytes(400) + data[len(data) // 3 + 400 :],
    }.items():
        path = tmp_path / f"{name}.{suffix}"
        path.write_bytes(damaged)
        try:
            listing = describe(path)
        except RecordingError as error:
            assert name in error.where
            assert not re.search(r"Traceback|Error\b|Exception\b|object has|NoneType", str(error)), error
        else:
            assert "2000" not in listing or name in ("start", "middle")


@pytest.mark.parametrize(
    ("body", "said"),
    [
        ("import os, signal; os.kill(os.getpid(), signal.SIGSEGV)", "killed by SIGSEGV"),
        ("import time; time.sleep(60)", "killed by SIGKILL"),
        ("import sys; print('block 7 is odd', file=sys.stderr); sys.exit(3)", "tdms: block 7 is odd"),
        ("raise ValueError('block 7 is odd')", "reader ended with status 1, as damaged files make it do"),
        ('print(\'[["x", "", ""\', end=\'\')', "no column of numbers"),
    ],
)
def test_a_reader_that_dies_or_hangs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, body: str, said: str) -> None:
    (tmp_path / "bad_reader.py").write_text(body)
    (tmp_path / "run.tdms").write_bytes(b"TDSm")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.setattr(isolated, "MODULE", "bad_reader")
    monkeypatch.setattr(isolated, "SILENCE_S", 1.0)
    with pytest.raises(RecordingError, match=said):
        describe(tmp_path / "run.tdms")


def test_a_small_file_that_declares_endless_data(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import h5py

    with h5py.File(tmp_path / "bomb.h5", "w") as file:
        file.create_dataset("x", shape=(1 << 23,), dtype="f8", chunks=(1 << 16,))
    assert (tmp_path / "bomb.h5").stat().st_size < 10_000
    monkeypatch.setattr(isolated, "DATA_FLOOR", 1 << 22)
    with pytest.raises(RecordingError, match="far more samples"):
        describe(tmp_path / "bomb.h5")


def test_missing_library_names_the_extra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def absent(name: str) -> ModuleSpec | None:
        return None

    (tmp_path / "run.mf4").write_bytes(b"MDF")
    monkeypatch.setattr(isolated, "find_spec", absent)
    with pytest.raises(KbsError, match=r"pip install 'kbs-process\[formats\]'"):
        describe(tmp_path / "run.mf4")


def test_what_is_no_file_is_told_as_what_it_is(tmp_path: Path) -> None:
    """And without waiting for what it may send."""
    os.mkfifo(tmp_path / "pipe.csv")
    (tmp_path / "zero.h5").symlink_to("/dev/zero")
    with socket.socket(socket.AF_UNIX) as one:
        one.bind(str(tmp_path / "socket.csv"))
        for name, what in {"pipe.csv": "a pipe", "zero.h5": "a device", "socket.csv": "a socket"}.items():
            with pytest.raises(RecordingError, match=f"{name}: cannot be read: it is {what}"):
                describe(tmp_path / name)
            for source in (tmp_path, tmp_path / name):
                with pytest.raises(RecordingError, match=f"{name}: cannot be read: it is {what}"):
                    import_recordings(write_mapping(tmp_path, name), source, tmp_path / "campaign")
            with pytest.raises(RecordingError, match=f"{name}: is not a table of commands: .*it is {what}"):
                read_commands(tmp_path / name, ("az",))


def test_a_description_lists_columns_with_their_ranges(tmp_path: Path) -> None:
    write_hdf5(tmp_path / "run.h5", signals(100) | {"t": np.arange(100) * 0.5})
    described = describe(tmp_path / "run.h5")
    row = next(line for line in described.splitlines() if line.endswith("  t"))
    assert row.split()[1:5] == ["100", "0", "0", "49.5"]


def test_the_description_is_taken_whole_and_from_its_folder_only(tmp_path: Path) -> None:
    write_csv(tmp_path / "run.csv", signals(20))
    plan = write_mapping(tmp_path, "run.csv")
    rig, campaign = tmp_path / "description/parameters/rig.toml", tmp_path / "description/campaign.toml"
    coupled = rig.read_text().replace("cross_coupling = { value = 0.0", 'cross_coupling = { value = "x.csv"')

    rig.write_text(coupled)
    with pytest.raises(ConfigError, match=r"'x\.csv' does not exist"):
        import_recordings(plan, tmp_path, tmp_path / "campaign")
    np.savetxt(tmp_path / "description" / "x.csv", np.eye(6) * 0.01, delimiter=",")
    folder = import_recordings(plan, tmp_path, tmp_path / "campaign")
    assert load_campaign(folder).rig.transducer.cross_coupling.value[2, 2] == 0.01

    rig.rename(tmp_path / "rig.toml")
    for name, said in {"parameters/rig.toml": "does not exist", "../rig.toml": "outside the campaign"}.items():
        campaign.write_text(CAMPAIGN.replace("parameters/rig.toml", name))
        with pytest.raises(ConfigError, match=said):
            import_recordings(plan, tmp_path, tmp_path / "other")
    assert not (tmp_path / "other").exists()


@pytest.mark.parametrize(
    ("rows", "stamps", "said"),
    [
        ([700], [12.5], "1 time stamps of 'wrench' do not fit where they stand, rows left out"),
        (
            [0, 1, 2],
            [-1.78e9 + 1.0, -1.78e9 + 1.001, -1.78e9 + 1.002],
            "3 time stamps of 'wrench' lie far from all others",
        ),
        (range(1200, 1500), [-1.78e9] * 300, "300 time stamps of 'wrench' do not fit where they stand, rows left out"),
    ],
)
def test_rows_whose_time_fits_nowhere_are_left_out_and_counted(
    tmp_path: Path, rows: list[int], stamps: list[float], said: str
) -> None:
    columns = signals(1500)
    t = 1.78e9 + np.arange(1500) * 1e-3
    t[list(rows)] = 1.78e9 + np.array(stamps)
    write_csv(tmp_path / "run.csv", {**columns, "t": t})
    notices: list[str] = []
    found = read_back(_import(tmp_path, "run.csv", notices=notices), "turn_1")
    assert any(said in line for line in notices)
    good = np.delete(np.arange(1500), list(rows))
    np.testing.assert_array_equal(found["encoder"][1][:, 0], columns["angle"][good])


def test_time_that_starts_again_is_refused_with_its_row(tmp_path: Path) -> None:
    columns = signals(3000)
    t = np.concatenate([np.arange(2000), np.arange(1000) + 0.25]) * 1e-3
    write_csv(tmp_path / "run.csv", {**columns, "t": t})
    with pytest.raises(
        RecordingError, match=r"goes back by 1.99\d+ s at sample 2001, .* logger started again"
    ) as caught:
        _import(tmp_path, "run.csv")
    assert "split the file there" in str(caught.value)


def _tdms_in(unit: str) -> Writer:
    def write(path: Path, columns: dict[str, np.ndarray]) -> None:
        from nptdms import ChannelObject, TdmsWriter

        with TdmsWriter(path) as writer:
            units = UNITS | {"angle": unit}
            writer.write_segment(
                [ChannelObject("run", name, x, {"unit_string": units[name]}) for name, x in columns.items()]
            )

    return write


def _hdf5_in(unit: str) -> Writer:
    def write(path: Path, columns: dict[str, np.ndarray]) -> None:
        import h5py

        with h5py.File(path, "w") as file:
            for name, x in columns.items():
                file[f"run/{name}"] = x
                file[f"run/{name}"].attrs["units"] = (UNITS | {"angle": unit})[name]

    return write


def _text_in(unit: str) -> Writer:
    def write(path: Path, columns: dict[str, np.ndarray]) -> None:
        units = UNITS | {"angle": unit}
        rows = zip(*(x.tolist() for x in columns.values()), strict=True)
        lines = [
            [f"run/{name}" for name in columns],
            [units[name] for name in columns],
            *(map(repr, row) for row in rows),
        ]
        path.write_text("\n".join(",".join(line) for line in lines))

    return write


IN_RUN = MAPPING.replace('column = "', 'column = "run/')


@pytest.mark.slow
@pytest.mark.parametrize(("file", "writer"), [("a.tdms", _tdms_in), ("a.h5", _hdf5_in), ("a.csv", _text_in)])
def test_a_unit_that_contradicts_the_mapping_is_refused_or_told(
    tmp_path: Path, file: str, writer: Callable[[str], Writer]
) -> None:
    mapping = IN_RUN + ("[text]\nunits_row = true\n" if file.endswith("csv") else "")
    columns, notices = signals(20), list[str]()

    def imported(unit: str, text: str = mapping) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        writer(unit)(tmp_path / file, columns)
        target = tmp_path / f"c{len(list(tmp_path.iterdir()))}"
        notices.clear()
        import_recordings(write_mapping(tmp_path, file, text), tmp_path, target, notice=notices.append)
        return read_back(target, "turn_1")

    with pytest.raises(RecordingError, match="'run/angle' is in 'deg' as the file states it, in 'rad' as"):
        imported("deg")
    with pytest.raises(RecordingError, match="'run/t' is in 's' as the file states it, in 'ms' as"):
        imported("rad", mapping.replace('unit = "s"', 'unit = "ms"'))
    imported("rad")
    assert not notices
    with pytest.raises(RecordingError, match="'run/angle' is in 'degrees' as the file states it, in 'rad' as"):
        imported("degrees")
    imported("angular units")
    assert "'run/angle' is in 'angular units' as the file states it, in 'rad' as" in notices[0]
    imported("V", mapping.replace('unit = "rad"', 'unit = "rad", scale = 2.0'))
    assert "is in 'V' as the file states it, in 'rad' as" in notices[0]


def test_a_unit_is_the_same_however_it_is_parted() -> None:
    assert all(agree(stated, "N m") for stated in ("N m", "Nm", "N*m", "N·m"))
    assert agree("Nmm", "mN m")
    assert agree("Nmm", "N m") is False
    assert agree("ns", "s") is False
    assert agree("Newton metres", "N m") is None
