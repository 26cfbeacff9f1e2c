"""What is imported reads back bit for bit, from every format."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from kbs_process.errors import ConfigError, RecordingError
from kbs_process.recordings import tables
from kbs_process.recordings.formats import Text
from kbs_process.recordings.formats.text import TextTable
from kbs_process.results.store import LIST
from kbs_process.studies.convert.clock import numbers
from kbs_process.studies.convert.run import import_recordings
from studies.convert.importer_files import (
    MAPPING,
    OWN_TIME,
    Writer,
    read_back,
    signals,
    write_csv,
    write_european,
    write_hdf5,
    write_mapping,
    write_matlab,
    write_mdf,
    write_numpy,
    write_parquet,
    write_tdms,
    write_tsv,
)


@pytest.mark.parametrize(
    ("file", "write", "mapping"),
    [
        ("run.csv", write_csv, MAPPING),
        ("run.txt", write_european, MAPPING + '\n[text]\ndelimiter = ";"\ndecimal = ","\n'),
        ("run.tsv", write_tsv, MAPPING + "\n[text]\nskip_rows = 1\nunits_row = true\n"),
        ("run.parquet", write_parquet, MAPPING),
        (
            "run.h5",
            write_hdf5,
            MAPPING.replace('"Fx"', '"run/forces[1]"')
            .replace('"Fy"', '"run/forces[2]"')
            .replace('"Fz"', '"run/forces[3]"')
            .replace('"angle"', '"run/angle"'),
        ),
        (
            "run.tdms",
            write_tdms,
            MAPPING.replace('= "', '= "run/')
            .replace('"run/s"', '"s"')
            .replace('"run/N"', '"N"')
            .replace('"run/rad"', '"rad"')
            .replace('"run/desc', '"desc')
            .replace('"run/SO', '"SO')
            .replace('"run/turn"', '"turn"')
            .replace('"run/fit"', '"fit"'),
        ),
        ("run.mf4", write_mdf, OWN_TIME),
        ("run.mat", write_matlab, MAPPING),
        (
            "run.npy",
            write_numpy,
            MAPPING.replace('column = "t"', "column = 1")
            .replace('"Fx"', "2")
            .replace('"Fy"', "3")
            .replace('"Fz"', "4")
            .replace('"angle"', '"[5]"'),
        ),
    ],
    ids=lambda value: value if isinstance(value, str) and value.startswith("run") else "",
)
def test_reads_back_bit_for_bit(tmp_path: Path, file: str, write: Writer, mapping: str) -> None:
    columns = signals(2500)
    write(tmp_path / file, columns)
    folder = import_recordings(write_mapping(tmp_path, file, mapping), tmp_path / file, tmp_path / "campaign")
    blocks = read_back(folder, "turn_1")
    stamps = np.rint(columns["t"] * 1e9).astype(np.int64)
    for key, names in {"wrench": ("Fx", "Fy", "Fz"), "encoder": ("angle",)}.items():
        expected = np.column_stack([columns[name] for name in names])
        stamp, values = blocks[key]
        np.testing.assert_array_equal(stamp, stamps)
        np.testing.assert_array_equal(values.view(np.int64), expected.view(np.int64))


def test_waveforms_bring_their_own_clocks(tmp_path: Path) -> None:
    from nptdms import ChannelObject, TdmsWriter

    start = np.datetime64("2026-01-31T12:00:00.250000")
    columns = signals(200)
    fast = {"wf_start_time": start, "wf_start_offset": 0.0, "wf_increment": 0.001}
    slow = {"wf_start_time": start, "wf_start_offset": 0.0005, "wf_increment": 0.01}
    with TdmsWriter(tmp_path / "run.tdms") as writer:
        forces = [ChannelObject("run", name, columns[name], fast) for name in ("Fx", "Fy", "Fz")]
        writer.write_segment([*forces, ChannelObject("run", "angle", columns["angle"][:20], slow)])
    mapping = OWN_TIME
    for name in ("Fx", "Fy", "Fz", "angle"):
        mapping = mapping.replace(f'"{name}"', f'"run/{name}"')
    folder = import_recordings(write_mapping(tmp_path, "run.tdms", mapping), tmp_path, tmp_path / "c")
    blocks = read_back(folder, "turn_1")
    zero = start.astype("datetime64[ns]").astype(np.int64)
    np.testing.assert_array_equal(blocks["wrench"][0], zero + np.arange(200) * 1_000_000)
    np.testing.assert_array_equal(blocks["encoder"][0], zero + 500_000 + np.arange(20) * 10_000_000)


def test_streams_of_different_rates(tmp_path: Path) -> None:
    import h5py

    columns = signals(300)
    with h5py.File(tmp_path / "run.h5", "w") as file:
        for name in ("t", "Fx", "Fy", "Fz"):
            file[name] = columns[name]
        file["angle"], file["ticks"] = columns["angle"][:30], np.arange(30) * 10
    mapping = MAPPING.replace("[wrench]", '[time.encoder]\ncolumn = "ticks"\nrate_Hz = 1000.0\n\n[wrench]')
    folder = import_recordings(write_mapping(tmp_path, "run.h5", mapping), tmp_path, tmp_path / "c")
    blocks = read_back(folder, "turn_1")
    assert len(blocks["wrench"][0]) == 300
    np.testing.assert_array_equal(blocks["encoder"][0], np.arange(30) * 10_000_000)


def test_dates_and_absolute_start(tmp_path: Path) -> None:
    columns = signals(50)
    dates = pd.date_range("2026-01-31T12:00:00.000000123", periods=50, freq="10ms", tz="UTC")
    pd.DataFrame({**columns, "t": dates}).to_csv(tmp_path / "dates.csv", index=False)
    pd.DataFrame({**columns, "t": np.arange(50) * 10}).to_parquet(tmp_path / "counts.parquet")
    dated = MAPPING.replace('unit = "s"', 'unit = "datetime"')
    counted = MAPPING.replace('unit = "s"', 'unit = "ms"\nstart = 2026-01-31T13:00:00+01:00')
    first = import_recordings(write_mapping(tmp_path, "dates.csv", dated), tmp_path, tmp_path / "a")
    second = import_recordings(write_mapping(tmp_path, "counts.parquet", counted), tmp_path, tmp_path / "b")
    expected = dates.as_unit("ns").asi8
    np.testing.assert_array_equal(read_back(first, "turn_1")["wrench"][0], expected)
    np.testing.assert_array_equal(read_back(second, "turn_1")["wrench"][0], expected - 123)


def test_units_signs_and_wrapped_angles_across_pieces(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tables, "CHUNK_ROWS", 7)  # every piece ends at another angle
    t = np.arange(400) * 0.01
    degrees = 100.0 - 250.0 * t  # three turns backwards
    force = np.linspace(-1.0, 1.0, 400)
    write_csv(tmp_path / "run.csv", {"t": t, "Fx": force, "Fy": force, "Fz": force, "angle": degrees % 360.0})
    mapping = (
        MAPPING.replace('"Fx", unit = "N"', '"Fx", unit = "kN"')
        .replace('"Fy", unit = "N"', '"Fy", unit = "N", scale = -2.0')
        .replace('unit = "rad"', 'unit = "deg", unwrap = true')
    )
    folder = import_recordings(write_mapping(tmp_path, "run.csv", mapping), tmp_path, tmp_path / "c")
    blocks = read_back(folder, "turn_1")
    expected = np.column_stack([1000.0 * force, -2.0 * force, force])
    np.testing.assert_allclose(blocks["wrench"][1], expected, rtol=1e-15)
    np.testing.assert_allclose(blocks["encoder"][1][:, 0], np.radians(degrees), atol=1e-12)


def test_a_motor_s_angle_is_unwrapped_before_it_is_geared_down(tmp_path: Path) -> None:
    t = np.arange(400) * 0.01
    degrees = 50.0 + 250.0 * t
    zero = 0.0 * t
    write_csv(tmp_path / "run.csv", {"t": t, "Fx": zero, "Fy": zero, "Fz": zero, "angle": degrees % 360.0})
    mapping = MAPPING.replace('unit = "rad"', 'unit = "deg", scale = 0.01, unwrap = 360')
    folder = import_recordings(write_mapping(tmp_path, "run.csv", mapping), tmp_path, tmp_path / "c")
    found = read_back(folder, "turn_1")["encoder"][1][:, 0]
    np.testing.assert_allclose(found, 0.01 * np.radians(degrees), atol=1e-12)


@pytest.mark.parametrize(
    ("content", "options", "names", "first"),
    [
        ("t;Fx\n0,0;1,5\n0,1;overload\n0,2;2,5\n", {"decimal": ","}, ("t", "Fx"), [0.0, 1.5]),
        ("# logger\n\nt;Fx\n0,0;1,5\n0,1;2,5\n", {"decimal": ",", "comment": "#"}, ("t", "Fx"), [0.0, 1.5]),
        ("# logger\nt;Fx\ns;N\n0.0;1.5\n", {"comment": "#", "units_row": True}, ("t", "Fx"), [0.0, 1.5]),
        ('"t (s)","Force, x (N)"\n0.0,1.5\n', {}, ("t (s)", "Force, x (N)"), [0.0, 1.5]),
        ("0,00\t1,5\t2,5\n0,01\t1,6\t2,6\n", {"decimal": ","}, ("1", "2", "3"), [0.0, 1.5, 2.5]),
        ("2026-01-31T12:00:00,1.5\n2026-01-31T12:00:01,2.5\n", {}, ("1", "2"), [np.nan, 1.5]),
    ],
    ids=["text among commas", "comments", "units", "quotes", "tabs", "dates"],
)
def test_what_loggers_write(
    tmp_path: Path, content: str, options: dict[str, Any], names: tuple[str, ...], first: list[float]
) -> None:
    (tmp_path / "a.csv").write_text(content)
    table = TextTable(tmp_path / "a.csv", Text(**options))
    assert tuple(column.name for column in table.columns) == names
    (cells,) = table.chunks(names)
    np.testing.assert_array_equal([numbers(column)[0] for column in cells], first)


def test_force_resolved_in_fixed_axes_is_turned_into_the_transducer(tmp_path: Path) -> None:
    """A weight of constant direction turns backwards as seen from a plate that turns forwards."""
    t = np.arange(100) * 0.01
    q = 3.0 * t
    down = {"t": t, "Fx": 0 * t, "Fy": 0 * t - 5.0, "Fz": 0 * t + 1.0, "angle": q}
    write_csv(tmp_path / "run.csv", down)
    mapping = MAPPING + '\n[turn]\njoint = "wheel"\naxis = [0, 0, 1]\nfactor = -1.0\n'
    folder = import_recordings(write_mapping(tmp_path, "run.csv", mapping), tmp_path, tmp_path / "c")
    expected = np.column_stack([-5.0 * np.sin(q), -5.0 * np.cos(q), np.ones(100)])
    np.testing.assert_allclose(read_back(folder, "turn_1")["wrench"][1], expected, atol=1e-14)


def test_parts_of_one_file_share_no_sample(tmp_path: Path) -> None:
    columns = signals(1000) | {"t": 5.0 + np.arange(1000) * 0.01}
    write_csv(tmp_path / "run.csv", columns)
    second = MAPPING[MAPPING.index("[[recording]]") :].replace('"fit"\nrepeat = 1', '"held-out"\nrepeat = 2')
    mapping = MAPPING + "end_s = 4.0\n\n" + second + "start_s = 4.0\n"
    folder = import_recordings(write_mapping(tmp_path, "run.csv", mapping), tmp_path, tmp_path / "c")
    parts = [read_back(folder, name)["wrench"][1] for name in ("turn_1", "turn_2")]
    assert [len(part) for part in parts] == [400, 600]
    np.testing.assert_array_equal(np.concatenate([part[:, 0] for part in parts]), columns["Fx"])


def test_sections_of_a_log_become_recordings(tmp_path: Path) -> None:
    runs = [signals(300, seed) for seed in (1, 2)]
    for number, columns in enumerate(runs):
        write_csv(tmp_path / f"{number}.csv", columns)
    (tmp_path / "run.csv").write_text("".join((tmp_path / f"{number}.csv").read_text() for number in range(2)))
    one = MAPPING[MAPPING.index("[[recording]]") :]
    sections = [one + f"section = {number}\n" for number in (1, 2)]
    text = MAPPING.replace(one, sections[0] + sections[1].replace("repeat = 1", "repeat = 2"))
    campaign = import_recordings(write_mapping(tmp_path, "run.csv", text), tmp_path, tmp_path / "made")
    for number, columns in enumerate(runs, start=1):
        np.testing.assert_array_equal(read_back(campaign, f"turn_{number}")["encoder"][1][:, 0], columns["angle"])
    write_numpy(tmp_path / "run.npy", runs[0])
    with pytest.raises(RecordingError, match="only delimited text has sections"):
        import_recordings(write_mapping(tmp_path, "run.npy", text), tmp_path, tmp_path / "other")


def test_campaign_keeps_the_template_and_says_where_it_comes_from(tmp_path: Path) -> None:
    write_csv(tmp_path / "run.csv", signals(50))
    mapping = MAPPING + '\n[source]\norigin = "a \\"quoted\\" bench"\n'
    plan = write_mapping(tmp_path, "run.csv", mapping)
    one = import_recordings(plan, tmp_path, tmp_path / "one")
    two = import_recordings(plan, tmp_path, tmp_path / "two")
    written = (one / "campaign.toml").read_text()
    assert "# kept, comment and all" in written
    assert "old.mcap" not in written
    assert 'origin = "a \\"quoted\\" bench"' in written
    files = sorted(path.relative_to(one) for path in one.rglob("*") if path.is_file())
    assert [str(path) for path in files] == [LIST, "campaign.toml", "parameters/rig.toml", "recordings/turn_1.mcap"]
    for path in files:
        assert (one / path).read_bytes() == (two / path).read_bytes()


TWO_LOGGERS = MAPPING.replace('source = "SOURCE"', 'source = "wrench.csv"\nfile = { encoder = "angle.csv" }')


def write_two_loggers(folder: Path, rows: int = 200) -> dict[str, np.ndarray]:
    """A wrench from one logger and an angle from another, which began 12.5 s later, writes commas and counts from 0."""
    columns = signals(rows)
    write_csv(folder / "wrench.csv", {name: columns[name] for name in ("t", "Fx", "Fy", "Fz")})
    write_european(folder / "angle.csv", {"t": columns["t"] - columns["t"][0], "angle": columns["angle"]})
    return columns


def test_scale_and_offset_are_applied_in_the_unit_of_the_file(tmp_path: Path) -> None:
    columns = {"t": np.arange(20) * 0.1, "Fx": np.arange(20.0), "Fy": np.ones(20), "Fz": np.ones(20)}
    write_csv(tmp_path / "run.csv", columns | {"angle": np.arange(20.0)})
    text = MAPPING.replace('column = "Fx", unit = "N"', 'column = "Fx", unit = "kN", scale = 2.0, offset = -0.5')
    campaign = import_recordings(write_mapping(tmp_path, "run.csv", text), tmp_path, tmp_path / "campaign")
    fx = read_back(campaign, "turn_1")["wrench"][1][:, 0]
    np.testing.assert_allclose(fx, 2000.0 * np.arange(20.0) - 500.0)


def test_a_recording_of_two_loggers(tmp_path: Path) -> None:
    columns = write_two_loggers(tmp_path)
    text = (
        TWO_LOGGERS.replace("repeat = 1", "repeat = 1\nshift_s = { encoder = 12.5 }")
        + '\n[text.encoder]\ndecimal = ","'
    )
    campaign = import_recordings(write_mapping(tmp_path, "", text), tmp_path, tmp_path / "campaign")
    streams = read_back(campaign, "turn_1")
    np.testing.assert_array_equal(streams["wrench"][1], np.stack([columns[n] for n in ("Fx", "Fy", "Fz")], axis=1))
    np.testing.assert_array_equal(streams["encoder"][1][:, 0], columns["angle"])
    begin = round((columns["t"][0] - 12.5) * 1e9)
    np.testing.assert_allclose(streams["encoder"][0], np.rint(columns["t"] * 1e9) - begin, atol=1.0)
    described = tomllib.loads((campaign / "campaign.toml").read_text())
    assert described["recording"][0]["clock_sigma_s"] == 1e-3  # nobody said how well the shift is known
    sources = described["source"]["file"]
    assert [one["name"] for one in sources] == ["wrench.csv", "angle.csv"]


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("", "", "'wrench.csv' and 'angle.csv' have a clock each: nothing says how they stand to each"),
        ("encoder = ", "rate = ", "file.rate: is not mapped\n  -> add [rate]"),
        ('"angle.csv"', '"../angle.csv"', "'../angle.csv' is no file of the source folder"),
    ],
)
def test_two_loggers_are_not_put_together_by_guess(tmp_path: Path, old: str, new: str, said: str) -> None:
    write_two_loggers(tmp_path)
    mapping = write_mapping(tmp_path, "", TWO_LOGGERS.replace(old, new, 1) if old else TWO_LOGGERS)
    with pytest.raises(ConfigError) as caught:
        import_recordings(mapping, tmp_path, tmp_path / "campaign")
    assert said in str(caught.value)


def test_the_clocks_of_two_loggers_that_write_dates_are_one(tmp_path: Path) -> None:
    write_two_loggers(tmp_path)
    stamps = pd.date_range("2026-01-31T12:00:00Z", periods=200, freq="10ms")
    for name, late in (("wrench.csv", 0), ("angle.csv", 5)):
        separator = "," if name == "wrench.csv" else ";"
        table = pd.read_csv(tmp_path / name, sep=separator, decimal="." if separator == "," else ",")
        table["t"] = stamps + pd.Timedelta(late, "ms")
        table.to_csv(tmp_path / name, index=False)
    text = TWO_LOGGERS.replace('unit = "s"', 'unit = "datetime"', 1)
    campaign = import_recordings(write_mapping(tmp_path, "", text), tmp_path, tmp_path / "campaign")
    streams = read_back(campaign, "turn_1")
    assert set(streams["encoder"][0] - streams["wrench"][0]) == {5_000_000}
