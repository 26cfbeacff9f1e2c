"""The presets on the recordings that they are for, where those are at hand."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.io import loadmat

from kbs_process.campaign.load import load_campaign
from kbs_process.recordings.mcap.streams import Stream
from kbs_process.signals.records import Array, Stamps
from kbs_process.studies.convert import preset_names
from kbs_process.studies.convert.mapping import find_mapping, load_mapping
from kbs_process.studies.convert.run import import_recordings
from studies.convert.importer_files import read_streams

pytestmark = pytest.mark.slow

DATA = Path(__file__).parents[4] / "shared" / "data"


def _source(name: str) -> Path:
    folder = DATA / name
    if not folder.is_dir():
        pytest.skip(f"the public recordings are not at hand in {folder}")
    return folder


def _read(campaign: Path, recording: str, key: str) -> tuple[Stamps, Array]:
    loaded = load_campaign(campaign)
    topic = next(topic for topic in loaded.topics.present() if topic.key == key)
    stream = Stream(key, topic.topic, topic.fields)
    return read_streams(loaded.recording(recording).path, [stream])[key]


@pytest.mark.parametrize("name", preset_names())
def test_presets_are_sound(name: str) -> None:
    preset = load_mapping(find_mapping(name))
    assert preset.template.is_file()
    assert preset.source.origin.startswith("github.com/")
    assert {part.role for part in preset.parts} == {"fit", "held-out"}


def test_smartwheel(tmp_path: Path) -> None:
    source = _source("smartwheel")
    folder = import_recordings("smartwheel", source, tmp_path / "smartwheel")
    raw = pd.read_csv(source / "pushrimkinetics_offsets_baseline.csv", header=None).to_numpy()
    parts = ("baseline_1", "baseline_2")
    stamp, wrench = map(np.concatenate, zip(*(_read(folder, part, "wrench") for part in parts), strict=True))
    _, angle = map(np.concatenate, zip(*(_read(folder, part, "angle") for part in parts), strict=True))
    np.testing.assert_array_equal(stamp, np.rint(raw[:, 1] / 240.0 * 1e9))
    assert np.abs(np.diff(angle[:, 0])).max() < np.radians(1.1)  # no jump of a turn
    np.testing.assert_allclose(np.degrees(angle[:, 0]) % 360.0, raw[:, 3], atol=1e-9)
    # Turned on by the angle, the wrench is in the hub's axes again, as the file has it.
    c, s = np.cos(angle[:, 0]), np.sin(angle[:, 0])
    for first, sign in ((0, -1.0), (3, 1.0)):
        x, y, z = wrench[:, first : first + 3].T
        hub = np.column_stack([sign * (c * x - s * y), s * x + c * y, z])
        np.testing.assert_allclose(hub, raw[:, 18 + first : 21 + first], atol=1e-12)
    assert len(_read(folder, "propulsion_1", "wrench")[0]) == 7682


@pytest.mark.parametrize("speed", ["fast", "slow"])
def test_treadmill(tmp_path: Path, speed: str) -> None:
    source = _source("treadmill_pitch")
    notices: list[str] = []
    folder = import_recordings(f"treadmill_{speed}", source, tmp_path / "treadmill", notice=notices.append)
    for trial in (1, 2):
        raw = pd.read_csv(source / f"Random{speed.title()}Speed{trial}.txt", sep="\t").to_numpy()
        stamp, moment = _read(folder, f"random_{speed}_{trial}", "wrench")
        _, rate = _read(folder, f"random_{speed}_{trial}", "rate")
        np.testing.assert_array_equal(stamp, np.rint(raw[:, 0] * 1e9))
        np.testing.assert_array_equal(moment[:, 0], raw[:, 1])
        np.testing.assert_allclose(rate[:, 0], raw[:, 2] / 0.1, rtol=1e-15)
    repeats = [notice for notice in notices if "'wrench' repeat" in notice]
    assert len(repeats) == {"fast": 2, "slow": 1}[speed]


def test_documented_mapping_is_one(tmp_path: Path) -> None:
    page = (Path(__file__).parents[3] / "docs" / "import.md").read_text()
    example = page.partition("<!-- mapping -->\n```toml\n")[2].partition("```")[0]
    (tmp_path / "mapping.toml").write_text(example)
    mapping = load_mapping(tmp_path / "mapping.toml")
    assert [stream.key for stream in mapping.streams] == ["wrench", "encoder", "command", "temperature"]
    for name in preset_names():
        assert f"`{name}`" in page


def test_emps(tmp_path: Path) -> None:
    source = _source("emps")
    folder = import_recordings("emps", source, tmp_path / "emps")
    raw = loadmat(source / "DATA_EMPS_PULSES.mat")
    stamp, effort = _read(folder, "sweeps_with_pulses_1", "effort")
    _, way = _read(folder, "sweeps_with_pulses_1", "angle")
    np.testing.assert_array_equal(stamp, np.rint(raw["t"][:, 0] * 1e9))
    np.testing.assert_allclose(effort, raw["vir"] * raw["gtau"], rtol=1e-15)  # volts to newtons
    np.testing.assert_array_equal(way, raw["qm"])
    joint = load_campaign(folder).rig.joints[0]
    assert (joint.type, joint.unit, joint.drive) == ("prismatic", "m", None)


def test_odrive(tmp_path: Path) -> None:
    source = _source("odrive_cogging")
    folder = import_recordings("odrive", source, tmp_path / "odrive")
    t, counts, current = np.load(source / "slow2_nocomp_1.npy")
    begun = t - t[0] >= 0.5 - 1e-9
    stamp, effort = _read(folder, "slow_2", "effort")
    np.testing.assert_array_equal(stamp, np.rint(t[begun] * 1e9))
    np.testing.assert_array_equal(effort[:, 0], current[begun])
    _, angle = _read(folder, "slow_2", "angle")
    np.testing.assert_allclose(angle[:, 0], counts[begun] * 2 * np.pi / 8192, rtol=1e-14)
    assert load_campaign(folder).topics.effort.units == ("A",)
