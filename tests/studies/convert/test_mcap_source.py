"""MCAP files of any recorder: topics and fields are columns, both clocks are kept, other formats lie beside."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from kbs_process.errors import RecordingError
from kbs_process.recordings.mcap.messages.encoding import OutStream
from kbs_process.recordings.mcap.source import open_recording
from kbs_process.recordings.mcap.writer import write_mcap
from kbs_process.recordings.open_table import open_table
from kbs_process.studies.convert.begin import begin
from kbs_process.studies.convert.describe import describe
from kbs_process.studies.convert.run import import_recordings
from studies.convert.importer_files import ANGLE, OWN_TIME, WRENCH, write_mapping

START = 1_769_860_800_000_000_000  # ns
LATE = 40_000_000  # ns: the recorder's clock is ahead, and messages arrive late
RNG = np.random.default_rng(5)


def bench(path: Path, seconds: float = 20.0) -> dict[str, OutStream]:
    """A wrench at 100 Hz and two joints at 50 Hz, by clocks of their own."""
    made = {}
    for topic, rate, offset in (("/ft/wrench", 100.0, 0), ("/joints", 50.0, 7_000_000)):
        t = np.arange(0.0, seconds, 1.0 / rate)
        stamp = START + offset + np.rint(t * 1e9).astype(np.int64)
        log = stamp + LATE + RNG.integers(0, 2_000_000, len(t))
        if topic == "/joints":
            values = np.column_stack([np.sin(t), 0.1 * t, np.cos(t), 0.0 * t])
            made[topic] = OutStream(topic, "joints", stamp, log, values, ("wheel", "arm"))
        else:
            made[topic] = OutStream(topic, "wrench", stamp, log, RNG.standard_normal((len(t), 6)))
    write_mcap(path, list(made.values()))
    return made


def test_fields_of_topics_are_columns(tmp_path: Path) -> None:
    values = bench(tmp_path / "run.mcap")["/joints"].values[:, 0]
    columns = {one.name: one for one in open_table(tmp_path / "run.mcap").columns}
    assert columns["/ft/wrench.wrench.torque.y"].unit == "N m"
    assert columns["/joints.velocity[arm]"].clock == "/joints: time"
    line = next(one for one in describe(tmp_path / "run.mcap").splitlines() if "position[wheel]" in one)
    assert line.split()[1:5] == ["1000", "0", f"{values.min():.7g}", f"{values.max():.7g}"]


def test_both_clocks_are_kept(tmp_path: Path) -> None:
    made = bench(tmp_path / "run.mcap")
    text = OWN_TIME.replace('"angle"', '"/joints.position[wheel]"')
    for axis in "xyz":
        text = text.replace(f'"F{axis}"', f'"/ft/wrench.wrench.force.{axis}"')
    campaign = import_recordings(write_mapping(tmp_path, "run.mcap", text), tmp_path, tmp_path / "made")
    blocks: dict[str, list[tuple[np.ndarray, ...]]] = {}
    for key, block in open_recording(campaign / "recordings" / "turn_1.mcap").read([WRENCH, ANGLE]):
        blocks.setdefault(key, []).append((block.stamp, block.log, block.values))
    for key, topic, columns in (("wrench", "/ft/wrench", slice(3)), ("encoder", "/joints", slice(1))):
        stamp, log, values = (np.concatenate(one) for one in zip(*blocks[key], strict=True))
        order = np.argsort(made[topic].log, kind="stable")
        np.testing.assert_array_equal(stamp, made[topic].stamp[order])
        np.testing.assert_array_equal(log, made[topic].log[order])
        np.testing.assert_array_equal(values, made[topic].values[order, columns])


def test_a_campaign_begins_with_it(tmp_path: Path) -> None:
    bench(tmp_path / "run.mcap")
    lines = list(begin(tmp_path / "made", [tmp_path / "run.mcap"]))
    assert lines[0] == "run.mcap, 100 Hz, 50 Hz"
    mapping = tomllib.loads((tmp_path / "made" / "mapping.toml").read_text())
    assert mapping["time"] == {}
    assert mapping["wrench"]["Ty"] == {"column": "/ft/wrench.wrench.torque.y", "unit": "N m"}
    # Whether a joint's position is in rad or m, its messages do not say.
    assert mapping["encoder"]["arm"] == {"column": "/joints.position[arm]", "unit": "?"}
    campaign = tomllib.loads((tmp_path / "made" / "campaign.toml").read_text())
    assert campaign["bands"]["working_rate_Hz"] == 20.0


def test_beside_a_file_of_another_format_with_a_clock_of_its_own(tmp_path: Path) -> None:
    t = np.arange(0.0, 40.0, 0.01)
    s = np.clip((t[:, None] - [5.0, 14.0, 25.0]) / [6.0, 8.0, 7.0], 0.0, 1.0)
    q = (10 * s**3 - 15 * s**4 + 6 * s**5) @ [0.6, 0.5, -0.9]
    load = np.column_stack([0 * t, 0 * t, 0 * t - 50.0, 0 * t, -6.0 * np.cos(q), 0 * t])
    stamp = START + np.rint(t * 1e9).astype(np.int64)
    load += RNG.normal(0.0, 0.002, load.shape)
    write_mcap(tmp_path / "run.mcap", [OutStream("/ft", "wrench", stamp, stamp + LATE, load)])
    pd.DataFrame({"t [s]": t + 3.0, "arm [deg]": np.degrees(q)}).to_csv(tmp_path / "run.csv", index=False)
    list(begin(tmp_path / "made", [tmp_path / "run.mcap", tmp_path / "run.csv"]))
    mapping = tomllib.loads((tmp_path / "made" / "mapping.toml").read_text())
    (one,) = mapping["recording"]
    assert one["source"] == "run.mcap" and one["file"] == {"encoder": "run.csv"}
    assert one["shift_s"]["encoder"] == pytest.approx(START * 1e-9 - 3.0, abs=0.005)
    assert mapping["time"] == {"encoder": {"column": "t [s]", "unit": "s"}}


def test_a_recording_without_numbers_is_refused_with_its_topics(tmp_path: Path) -> None:
    none = np.empty(0, np.int64)
    write_mcap(tmp_path / "run.mcap", [OutStream("/ft", "wrench", none, none, np.empty((0, 6)))])
    with pytest.raises(RecordingError, match="/ft: it has no messages"):
        open_table(tmp_path / "run.mcap")
    (tmp_path / "no.mcap").write_bytes(b"nothing")
    with pytest.raises(RecordingError, match="not an MCAP file"):
        open_table(tmp_path / "no.mcap")
