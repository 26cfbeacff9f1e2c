"""A campaign is begun from recordings: what they tell is put in, what they do not is a question."""

from __future__ import annotations

import tomllib
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from scipy.io import savemat
from scipy.spatial.transform import Rotation

from kbs_process.campaign.documents import read
from kbs_process.campaign.load import load_campaign
from kbs_process.errors import ConfigError, OutputError, RecordingError
from kbs_process.recordings.tables import Column
from kbs_process.results.store import writing
from kbs_process.studies.convert.begin import begin, check_description
from kbs_process.studies.convert.clock import date_formats, nanoseconds
from kbs_process.studies.convert.mapping_file import Part, Time
from kbs_process.studies.convert.naming import by_channel, meaning, runs_of
from kbs_process.studies.convert.run import _check_same, import_recordings
from kbs_process.studies.convert.shift import find_shift
from studies.convert.importer_files import write_hdf5, write_matlab, write_mdf, write_parquet

LOADS = ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz")
ONE = ("sweep",)  # run, which takes half as long
LATE = 3.724  # s: the clock of the wrench began so much later


@pytest.mark.parametrize(
    ("name", "stated", "stream", "channel", "unit"),
    [
        ("Fx [N]", "", "wrench", "Fx", "N"),
        ("Force Y (lbf)", "", "wrench", "Fy", "lbf"),
        ("Tx_Nm", "", "wrench", "Tx", "N m"),
        ("Mz", "N*m", "wrench", "Tz", "N m"),
        ("My, ft-lbf", "", "wrench", "Ty", "lbf ft"),
        ("Fx", "", "wrench", "Fx", "?"),  # no unit is not N
        ("Fx [Nm]", "", "wrench", "Fx", "?"),  # nor is another one
        ("Fx [counts]", "", "wrench", "Fx", "?"),
        ("az_deg", "", "encoder", "az", "deg"),
        ("El angle", "mrad", "encoder", "el", "mrad"),
        ("azimuth", "", "encoder", "azimuth", "?"),
        ("arm rate [deg/s]", "", "", "", "deg/s"),
        ("slide position (in)", "", "encoder", "slide", "in"),
        ("angle [°]", "", "encoder", "joint", "deg"),
        ("t_ms", "", "time", "", "ms"),
        ("Time", "", "time", "", "?"),
        ("az_cmd_deg", "", "", "", "deg"),  # what was commanded is no angle that was measured
        ("az_error(deg)", "", "", "", "deg"),
        ("probe A", "", "", "", "A"),
        ("diameter_mm", "", "", "", "mm"),
        ("status", "", "", "", "?"),
        ("bench/Fx", "N", "wrench", "Fx", "N"),
        ("data.az_deg", "", "encoder", "az", "deg"),
        ("Fz/N", "", "wrench", "Fz", "N"),
        ("wheel_rad/s", "", "", "", "rad/s"),
        ("Joint_state.positions[2]", "", "encoder", "joint2", "?"),
        ("Joint_state.torques[2]", "", "", "", "?"),
        ("/joints.position[arm]", "rad", "encoder", "arm", "rad"),
        ("/joints.velocity[arm]", "", "", "", "?"),
        ("/command.position[arm]", "", "", "", "?"),
        ("/ft.wrench.torque.y", "N m", "wrench", "Ty", "N m"),
        ("/imu.orientation.w", "", "orientation", "w", "1"),
        ("q_x", "", "orientation", "x", "1"),
        ("R12", "", "orientation", "12", "1"),
        ("quat[3]", "", "orientation", "3", "1"),
        ("q1 [deg]", "", "encoder", "q1", "deg"),
    ],
)
def test_what_a_name_tells(name: str, stated: str, stream: str, channel: str, unit: str) -> None:
    found = meaning(Column(name, stated))
    assert (found.stream, found.channel, found.unit) == (stream, channel, unit)


def test_of_two_columns_for_one_channel_none_is_chosen() -> None:
    found = by_channel([meaning(Column("one/Fx", "N")), meaning(Column("two/Fx", "N")), meaning(Column("Fy", "N"))])
    assert {channel: one.column for channel, one in found.items()} == {"Fx": "?", "Fy": "Fy"}


def test_files_of_two_loggers_are_paired_by_what_tells_them_apart() -> None:
    assert runs_of(["wrench_sweep.csv", "wrench_test_1.csv"]) == {
        "sweep": "wrench_sweep.csv",
        "test_1": "wrench_test_1.csv",
    }
    assert runs_of(["log.csv"]) == {"log": "log.csv"}
    assert runs_of(["a-1.csv", "a_1.csv"]) == {"run1": "a-1.csv", "run2": "a_1.csv"}


def motion(t: np.ndarray) -> np.ndarray:
    """Go from rest to rest, rad, never twice alike."""
    q = np.zeros_like(t)
    for begin_s, step, seconds in ((5.0, 0.6, 6.0), (14.0, 0.5, 8.0), (25.0, -0.9, 7.0), (36.0, 0.4, 5.0)):
        s = np.clip((t - begin_s) / seconds, 0.0, 1.0)
        q += step * (10 * s**3 - 15 * s**4 + 6 * s**5)
    return q


def wrench_of(q: np.ndarray, seed: int = 1) -> np.ndarray:
    """Weight of 50 N at 0.12 m on an arm, with noise; N and N m."""
    none = np.zeros_like(q)
    load = np.column_stack([none, none, none - 50.0, none, -6.0 * np.cos(q), none])
    return load + np.random.default_rng(seed).normal(0.0, [0.02] * 3 + [0.002] * 3, load.shape)


@pytest.mark.slow
def test_the_shift_between_two_clocks_is_found_within_its_sigma() -> None:
    found = []
    for seed in range(8):
        t, t_angle = np.arange(0.0, 44.0, 0.01), np.arange(0.0, 48.0, 0.02)
        shift, sigma = find_shift(t, wrench_of(motion(t + LATE), seed), t_angle, motion(t_angle)[:, None], [True]) or (
            np.nan,
            np.nan,
        )
        assert sigma < 0.005
        found.append((shift - LATE) / sigma)
    assert 0.5 < np.std(found) < 2.0 and abs(np.mean(found)) < 1.0


@pytest.mark.parametrize("rows", [1, 3, 40])
@pytest.mark.parametrize(("first", "value"), [(150, 17.0), (1200, 0.0), (2300, 17.0)])
def test_angles_that_leap_there_and_back_tell_no_wrong_shift(first: int, value: float, rows: int) -> None:
    t, t_angle = np.arange(0.0, 44.0, 0.01), np.arange(0.0, 48.0, 0.02)
    angle = motion(t_angle)
    angle[first : first + rows] = value
    found = find_shift(t, wrench_of(motion(t + LATE)), t_angle, angle[:, None], [True])
    assert found is None or abs(found[0] - LATE) < 5.0 * found[1]


@pytest.mark.parametrize("move", [lambda t: 0.5 * np.sin(t), lambda t: 0.0 * t], ids=["periodic", "still"])
def test_a_shift_that_the_motion_does_not_tell_is_no_number(move: Callable[[np.ndarray], np.ndarray]) -> None:
    t = np.arange(0.0, 60.0, 0.02)
    assert find_shift(t, wrench_of(move(t)), t, move(t)[:, None], [True]) is None


def test_angles_are_not_made_up_where_none_are_recorded() -> None:
    t = np.arange(0.0, 20.0, 0.02)
    turn = lambda t: 0.6 - 0.6 * np.cos(0.2 * t**1.2)  # noqa: E731
    angle, wrench = turn(t), wrench_of(turn(t + 1.25))
    t_angle = np.append(t[:-1], 22.0)  # the last stamp is 2 s late
    found = find_shift(t, wrench, t_angle, angle[:, None], [True])
    assert found is not None and found[0] == pytest.approx(1.25, abs=0.01)


def write_logs(folder: Path, runs: tuple[str, ...] = ("sweep", "test")) -> list[Path]:
    """Runs by two loggers: the wrench at 100 Hz, the angle at 50 Hz in a German text with lines above it."""
    for run in runs:
        t = np.arange(0.0, 44.0, 0.01)
        names = ["Time (s)", "Fx [N]", "Fy [N]", "Fz [N]", "Mx [Nm]", "My [Nm]", "Mz [Nm]", "status"]
        table = np.column_stack([t, wrench_of(motion(t + LATE)), 0.0 * t])
        pd.DataFrame(table, columns=names).to_csv(folder / f"wrench_{run}.csv", index=False, float_format="%.4f")
        t = np.arange(0.0, 48.0, 0.02)
        angle = pd.DataFrame({"t_ms": 1000.0 * t, "arm_deg": np.round(np.degrees(motion(t)), 2)})
        text = angle.to_csv(index=False, sep=";", decimal=",", float_format="%.2f")
        (folder / f"angle_{run}.txt").write_text("Logger 7\nserial 12\n" + text)
    return sorted(folder.glob("*_*.*"))


ANSWERS = {
    "campaign.toml": [
        ('title = "?"', 'title = "An arm"'),
        ('value = "?"', "value = 0.03"),
        ('["?", "?"]', "[0.05, 1.0]"),
        ('source = "?"', 'source = "specification"'),
        ('high_pass_Hz = "?"', "high_pass_Hz = 0.05"),
        ('["?"]', "[1.0]"),
    ],
    "rig.toml": [
        ('sigma = "?", source = "certificate"', 'sigma = 0.001, source = "certificate"'),
        ('sigma = "?", source = "tared"', 'sigma = 20.0, source = "tared"'),
        ('parent = "?"', 'parent = "T"'),
        ('axis = "?"', "axis = [0, -1, 0]"),
        (
            'mass = { value = "?", unit = "kg", sigma = "?", source = "?"',
            MASS := 'mass = { value = 5, unit = "kg", sigma = 2, source = "felt"',
        ),
    ],
    "mapping.toml": [('role = "?"', 'role = "fit"')],
}


def answer(folder: Path) -> None:
    for name, pairs in ANSWERS.items():
        text = (folder / name).read_text()
        for old, new in pairs:
            assert old in text
            text = text.replace(old, new)
        (folder / name).write_text(text)


def tree(path: Path) -> dict[str, Any]:
    return tomllib.loads(path.read_text())


@pytest.mark.slow
def test_from_two_loggers_to_a_campaign(tmp_path: Path) -> None:
    files = write_logs(tmp_path)
    lines = "\n".join(begin(tmp_path / "arm", files))
    assert "  My [Nm]   wrench Ty in N m\n" in lines and "  status    not used" in lines
    assert 'angle_sweep.txt, 50 Hz, skip_rows = 2, decimal = ","\n' in lines
    mapping = tree(tmp_path / "arm" / "mapping.toml")
    assert mapping["text"] == {"encoder": {"skip_rows": 2, "decimal": ","}}
    assert [one["shift_s"]["wrench"] for one in mapping["recording"]] == pytest.approx([LATE, LATE], abs=0.003)
    known = np.array([one["shift_sigma_s"] for one in mapping["recording"]])
    assert np.all((known > 0.0) & (known < 0.003))
    rig = tree(tmp_path / "arm" / "rig.toml")
    assert rig["transducer"]["noise"]["value"] == pytest.approx([0.02] * 3 + [0.002] * 3, rel=0.1)
    assert rig["joint"]["arm"]["encoder"]["step"]["value"] == pytest.approx(0.01)
    assert tree(tmp_path / "arm" / "campaign.toml")["bands"]["working_rate_Hz"] == 20.0

    with pytest.raises(ConfigError) as caught:
        list(check_description(tmp_path / "arm"))
    told = str(caught.value)
    assert "15 values are still to be put in" in told
    assert 'rig.toml:17: joint.arm.axis: "?"\n  -> direction of positive turning in the parent\'s axes' in told

    answer(tmp_path / "arm")
    said = list(check_description(tmp_path / "arm"))
    assert said[0] == "arm: the description is complete; 2 recordings are to be imported"
    campaign = load_campaign(import_recordings(tmp_path / "arm" / "mapping.toml", tmp_path, tmp_path / "made"))
    assert [one.name for one in campaign.recordings] == ["sweep_1", "test_1"]


@pytest.mark.slow
def test_clocks_that_run_apart_have_no_shift(tmp_path: Path) -> None:
    files = write_logs(tmp_path)
    for path in tmp_path.glob("angle_*.txt"):
        *head, table = path.read_text().split("\n", 3)
        rows = [line.split(";") for line in table.split()]
        late = [f"{float(t.replace(',', '.')) * 1.002:.2f}".replace(".", ",") + f";{angle}" for t, angle in rows]
        path.write_text("\n".join([*head, *late]) + "\n")
    lines = "\n".join(begin(tmp_path / "arm", files))
    assert "how their clocks stand to each other is not known: it is 3.7" in lines
    mapping = (tmp_path / "arm" / "mapping.toml").read_text()
    assert mapping.count('shift_s = { wrench = "?" }  # s, added to the times of the wrench: it is 3.7') == 2


@pytest.mark.parametrize(("seconds", "later"), [(4.0, 5e6), (4.0, 0.0), (0.02, 0.0)])
def test_what_hardly_overlaps_or_hardly_lasts_has_no_shift(tmp_path: Path, seconds: float, later: float) -> None:
    t, rng = np.arange(0.0, seconds, 0.01), np.random.default_rng(3)
    wrench = pd.DataFrame({"t [s]": t} | {f"{k} [N]": rng.standard_normal(len(t)) for k in ("Fx", "Fy", "Fz")})
    angle = pd.DataFrame({"t [s]": t + later, "az [deg]": 40.0 * np.sin(t)})
    files = [tmp_path / "wrench_a.csv", tmp_path / "angle_a.csv"]
    for file, table in zip(files, (wrench, angle), strict=True):
        table.to_csv(file, index=False)
    assert "how their clocks stand to each other is not known" in "\n".join(begin(tmp_path / "made", files))


def test_a_clock_that_leaps_has_no_shift_and_costs_no_time(tmp_path: Path) -> None:
    t, rng = np.arange(0.0, 4.0, 0.01), np.random.default_rng(3)
    wrench = pd.DataFrame({"t [s]": t} | {f"{k} [N]": rng.standard_normal(len(t)) for k in ("Fx", "Fy", "Fz")})
    times = np.append(t[:-1], 9e5)
    angle = pd.DataFrame({"t [s]": times, "az [deg]": 40.0 * np.sin(t)})
    files = [tmp_path / "wrench_a.csv", tmp_path / "angle_a.csv"]
    for file, table in zip(files, (wrench, angle), strict=True):
        table.to_csv(file, index=False)
    assert "how their clocks stand to each other is not known" in "\n".join(begin(tmp_path / "made", files))


def test_a_value_that_is_still_to_be_put_in_is_refused_by_every_reader(tmp_path: Path) -> None:
    path = tmp_path / "some.toml"
    path.write_text('a = 1\n[b]\nc = [1, "?"]  # how much\n')
    with pytest.raises(ConfigError, match=r'some.toml:3: b.c: "\?"\n  -> how much'):
        read(path, role="the file", remedy="")


@pytest.mark.parametrize(
    ("name", "write"),
    [("a.parquet", write_parquet), ("a.h5", write_hdf5), ("a.mat", write_matlab), ("a.mf4", write_mdf)],
)
def test_every_format_begins_a_campaign(tmp_path: Path, name: str, write: Callable[..., None]) -> None:
    t = np.arange(0.0, 10.0, 0.01)
    write(tmp_path / name, {"t": t, "Fx": t, "Fy": t, "Fz": t, "angle": 0.1 * t})
    list(begin(tmp_path / "made", [tmp_path / name]))
    mapping = tree(tmp_path / "made" / "mapping.toml")
    known = name == "a.mf4"  # which alone states all units
    units = {one["unit"] for one in [*mapping["wrench"].values(), *mapping["encoder"].values()]}
    assert units == ({"N", "rad"} if known else {"?"})
    assert "shift_s" not in mapping["recording"][0]


@pytest.mark.parametrize("names", ["qw qx qy qz", "q0 q1 q2 q3", "R11 R12 R13 R21 R22 R23 R31 R32 R33"])
@pytest.mark.slow
def test_an_orientation_begins_a_campaign_with_a_clock_of_its_own(tmp_path: Path, names: str) -> None:
    t = np.arange(0.0, 44.0, 0.01)
    load = pd.DataFrame(wrench_of(motion(t + LATE)), columns=[f"{c} [{'N' if c[0] == 'F' else 'Nm'}]" for c in LOADS])
    load.insert(0, "t [s]", t)
    t = np.arange(0.0, 48.0, 0.02)
    R = Rotation.from_rotvec(motion(t)[:, None] * [0.0, -1.0, 0.0])
    sign = np.where(np.arange(len(t)) % 700 < 350, 1.0, -1.0)[:, None]
    numbers = R.as_matrix().reshape(-1, 9) if "R11" in names else sign * R.as_quat(scalar_first=True)
    turned = pd.DataFrame(np.column_stack([t, numbers]), columns=["t [s]", *names.split()])
    files = [tmp_path / "wrench.csv", tmp_path / "imu.csv"]
    for file, table in zip(files, (load, turned), strict=True):
        table.to_csv(file, index=False)
    list(begin(tmp_path / "made", files))
    mapping = tree(tmp_path / "made" / "mapping.toml")
    (one,) = mapping["orientation"]
    assert one["joints"] == list(tree(tmp_path / "made" / "rig.toml")["joint"]) == ["joint"] and one["maps"] == "?"
    if "R11" in names:
        assert one["matrix"][1] == ["R21", "R22", "R23"]
    else:
        known = dict(zip("wxyz", names.split(), strict=True)) if "qw" in names else dict.fromkeys("wxyz", "?")
        assert one["quaternion"] == known
    shift = mapping["recording"][0]["shift_s"]["wrench"]  # found where the numbers are known
    assert shift == ("?" if "q0" in names else pytest.approx(LATE, abs=0.005))


def test_an_angle_that_begins_again_is_unwrapped_and_what_has_no_column_is_told(tmp_path: Path) -> None:
    t = np.arange(0.0, 40.0, 0.1)
    savemat(tmp_path / "a.mat", {"t_s": t, "Fx_N": t, "az_deg": (30.0 * t) % 360.0, "el_deg": 10.0 * t, "note": "text"})
    lines = list(begin(tmp_path / "made", [tmp_path / "a.mat"]))
    assert "  az_deg  encoder az in deg, begins again at every turn" in lines
    assert "  el_deg  encoder el in deg" in lines and "  left out: note: it is text" in lines
    encoder = tree(tmp_path / "made" / "mapping.toml")["encoder"]
    assert {name: one.get("unwrap") for name, one in encoder.items()} == {"az": True, "el": None}


def test_files_of_which_none_is_known_are_all_questions(tmp_path: Path) -> None:
    pd.DataFrame({"ch1": [1.0, 2.0, 3.0], "ch2": [2.0, 1.0, 0.0]}).to_csv(tmp_path / "a.csv", index=False)
    list(begin(tmp_path / "made", [tmp_path / "a.csv"]))
    mapping = tree(tmp_path / "made" / "mapping.toml")
    assert {one["column"] for one in mapping["wrench"].values()} == {"?"}
    assert mapping["time"] == {"rate_Hz": "?"}


def test_the_sections_of_a_log_are_recordings_each(tmp_path: Path) -> None:
    rows = "".join(f"{0.1 * k:.1f},{k},{k * k % 7}\n" for k in range(9))
    (tmp_path / "log.txt").write_text(
        "Log 2.5\n" + 2 * f"Begins at 9\nt [s],Fz [N],az [deg]\nINFO: settling\n{rows}\nEnds\n"
    )
    lines = list(begin(tmp_path / "made", [tmp_path / "log.txt"]))
    assert "section1: log.txt, section 1" in lines and "section2: log.txt, section 2" in lines
    mapping = tree(tmp_path / "made" / "mapping.toml")
    assert mapping["text"] == {"skip_rows": 2} and mapping["encoder"]["az"]["unit"] == "deg"
    assert [one["section"] for one in mapping["recording"]] == [1, 2]


def test_what_is_no_table_is_told(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("a letter\nand its end\n")
    with pytest.raises(RecordingError):
        list(begin(tmp_path / "made", [tmp_path / "a.csv"]))
    assert not (tmp_path / "made").exists()


def test_streams_of_one_of_several_files_share_its_shift() -> None:
    files = {"encoder": "angles.csv", "rate": "angles.csv"}
    part = Part(source="a.csv", file=files, shift_s={"encoder": 2.5}, trajectory="sweep", role="fit")
    assert [part.shift_of(key) for key in ("wrench", "encoder", "rate")] == [0.0, 2.5, 2.5]
    one = Part(source="a.csv", shift_s={"encoder": 2.5}, trajectory="sweep", role="fit")
    assert one.shift_of("wrench") == 0.0


def test_a_folder_of_another_campaign_is_not_replaced(tmp_path: Path) -> None:
    (tmp_path / "campaign.toml").write_text('name = "other"\n')
    with pytest.raises(OutputError, match="holds the campaign 'other', not 'other' of these files"):
        _check_same(tmp_path, "other", {"test.csv": 64 * "a"})
    with pytest.raises(OutputError, match="holds the campaign 'other', not 'mine'"):
        _check_same(tmp_path, "mine", {"test.csv": 64 * "b"})
    with (tmp_path / "campaign.toml").open("a") as file:
        file.write(f'[[source.file]]\nname = "run.csv"\nsha256 = "{64 * "b"}"\n')
    _check_same(tmp_path, "other", {"test.csv": 64 * "b"})


def test_what_was_imported_is_no_place_to_begin(tmp_path: Path) -> None:
    with writing(tmp_path / "arm", "campaign.toml") as folder:
        (folder / "campaign.toml").write_text('name = "arm"\n')
    with pytest.raises(OutputError, match="or as something else"):
        list(begin(tmp_path / "arm", write_logs(tmp_path, ONE)))
    assert (tmp_path / "arm" / "campaign.toml").read_text() == 'name = "arm"\n'


def test_a_text_of_western_windows_is_read_and_told(tmp_path: Path) -> None:
    files = write_logs(tmp_path, ONE)
    for path in tmp_path.glob("angle_*.txt"):
        path.write_bytes(path.read_text().replace("arm_deg", "Arm für (°)").encode("cp1252"))
    lines = "\n".join(begin(tmp_path / "arm", files))
    assert 'decimal = ",", encoding = "cp1252"\n' in lines and "Arm für (°)" in lines
    assert tree(tmp_path / "arm" / "mapping.toml")["text"]["encoder"]["encoding"] == "cp1252"


@pytest.mark.parametrize("cell", ["1e200", "1e308", "-1e305"])
@pytest.mark.parametrize("column", [0, 3])
def test_numbers_that_nothing_measures_are_left_out_without_a_warning(tmp_path: Path, cell: str, column: int) -> None:
    files = write_logs(tmp_path, ONE)
    lines = files[-1].read_text().splitlines()
    lines[700] = ",".join(cell if at == column else x for at, x in enumerate(lines[700].split(",")))
    files[-1].write_text("\n".join(lines) + "\n")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        list(begin(tmp_path / "arm", files))
    assert tree(tmp_path / "arm" / "rig.toml")["transducer"]["noise"]["value"] == pytest.approx(
        [0.02] * 3 + [0.002] * 3, rel=0.1
    )


@pytest.mark.slow
@pytest.mark.parametrize(("row", "time"), [(1, "-9000"), (900, "1000"), (-1, "9000"), (-1, "1e9")])
def test_a_stamp_far_from_all_others_leaves_the_shift_a_question(tmp_path: Path, row: int, time: str) -> None:
    files = write_logs(tmp_path)
    lines = files[2].read_text().splitlines()
    lines[row] = ",".join([time, *lines[row].split(",")[1:]])
    files[2].write_text("\n".join(lines) + "\n")
    told = "\n".join(begin(tmp_path / "arm", files))
    assert told.count("how their clocks stand to each other is not known: motion and times do not tell it") == 1


def test_rows_that_only_the_wrench_has_tell_nothing_of_its_clock(tmp_path: Path) -> None:
    files = write_logs(tmp_path, ONE)
    for path in tmp_path.glob("angle_*.txt"):
        lines = path.read_text().splitlines()
        path.write_text("\n".join(lines[: 3 + (len(lines) - 3) * 6 // 10]) + "\n")
    assert "are added to the times of wrench" in "\n".join(begin(tmp_path / "arm", files))


@pytest.mark.parametrize(
    ("words", "formats"),
    [
        (["2026-03-04T10:17:07Z"], []),
        (["04.03.2026 10:17:07,300", "04.03.2026 10:17:08,0"], ["%d.%m.%Y %H:%M:%S.%f"]),
        (["03/04/2026 10:17:07 AM"], ["%d/%m/%Y %I:%M:%S %p", "%m/%d/%Y %I:%M:%S %p"]),
        (["03/14/2026 10:17"], ["%m/%d/%Y %H:%M"]),
        (["23:59:59.5"], ["%H:%M:%S.%f"]),
        (["yesterday"], []),
    ],
)
def test_dates_are_known_by_how_loggers_write_them(words: list[str], formats: list[str]) -> None:
    assert date_formats(words) == formats


@pytest.mark.parametrize(
    ("word", "how", "seconds"),
    [
        ("04.03.2026 10:17:07,300", "%d.%m.%Y %H:%M:%S,%f", 1772619427.3),
        ("03/04/2026 10:17:07 AM", "%m/%d/%Y %I:%M:%S %p", 1772619427.0),
        ("10:17:07,300", "%H:%M:%S,%f", 37027.3),  # a time of day counts from `start`, or from 1970
    ],
)
def test_dates_are_read_by_their_format(word: str, how: str, seconds: float) -> None:
    ns, known = nanoseconds(np.array([word]), Time.model_construct(unit="datetime", format=how), "a.csv")
    assert known.all() and ns[0] == round(seconds * 1000) * 1_000_000
    with pytest.raises(RecordingError, match="is no format of dates"):
        nanoseconds(np.array([word]), Time.model_construct(unit="datetime", format="%Q"), "a.csv")


def test_dates_of_a_logger_become_a_format_in_the_mapping(tmp_path: Path) -> None:
    rows = "".join(f"04.13.2026 10:17:{k // 10:02},{k % 10};{k},5\n" for k in range(50))
    told = []
    for name, text in (("us", rows), ("de", rows.replace("04.13.", "13.04."))):
        (tmp_path / f"{name}.csv").write_text("Zeit;Fx (N)\n" + text)
        told += begin(tmp_path / name, [tmp_path / f"{name}.csv"])
    assert 'format = "%d.%m.%Y %H:%M:%S.%f"' in (tmp_path / "de" / "mapping.toml").read_text()
    assert any(line.startswith("de.csv, 10 Hz") for line in told)
    assert 'unit = "?"  # of the times' in (tmp_path / "us" / "mapping.toml").read_text()  # no such format is usual
