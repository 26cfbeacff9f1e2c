"""Joint angles from quaternions and rotation matrices: about the rig's axes, continuous, and judged."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from kbs_process.errors import ConfigError, RecordingError
from kbs_process.recordings.mcap.streams import Stream
from kbs_process.signals.records import Array
from kbs_process.studies.convert.run import import_recordings
from studies.convert.importer_files import MAPPING, RIG, read_streams, write_csv, write_mapping
from studies.convert.importer_files import WRENCH as WRENCH_STREAM

JOINT = RIG[RIG.index("[joint.wheel]") :]
T = np.arange(0.0, 20.0, 0.01)
# Beyond a half turn, and back: so the scalar of the quaternion changes its sign.
MOVED = {"one": 3.5 * np.sin(0.5 * T), "two": 0.7 * np.sin(0.9 * T + 0.3), "three": 2.0 + 1.5 * np.cos(0.4 * T)}
AXES = {"one": [0, 1, 0], "two": [0, 0, 1], "three": [1, 0, 0]}
TILTED = [0.0, 0.02, 0.01]  # rad, misalignment of the joint "two"
NUMBERS = {"quaternion": "wxyz", "matrix": [f"R{i}{j}" for i in "123" for j in "123"]}


def orientation(joints: list[str], mount: Rotation) -> Rotation:
    """Of the link, its axes into those of the base; the sensor is mounted on it anyhow."""
    R = Rotation.identity(len(T))
    for name in joints:
        R = R * Rotation.from_rotvec(TILTED if name == "two" else [0, 0, 0])
        R = R * Rotation.from_rotvec(MOVED[name][:, None] * np.asarray(AXES[name]))
    return R * mount


def write(folder: Path, joints: list[str], columns: dict[str, Array], table: str) -> Path:
    """Write file, rig and mapping of a chain of these joints; `table` describes the orientation."""
    write_csv(folder / "run.csv", {"t": T, **dict.fromkeys(("Fx", "Fy", "Fz"), np.sin(T)), **columns})
    start = MAPPING.index("[encoder]")
    text = (
        MAPPING[:start] + f"[[orientation]]\njoints = {joints}\n{table}\n" + MAPPING[MAPPING.index("[[recording]]") :]
    )
    mapping = write_mapping(folder, "run.csv", text)
    rig = RIG[: RIG.index("[joint.wheel]")].replace('on = "wheel"', f'on = "{joints[-1]}"')
    for parent, name in zip(["lab", *joints], joints, strict=False):
        one = JOINT.replace("wheel", name).replace('"lab"', f'"{parent}"').replace("[0, 1, 0]", str(AXES[name]))
        tilt = f"misalignment = {{ value = {TILTED if name == 'two' else [0.0, 0.0, 0.0]}"
        rig += one.replace("misalignment = { value = [0.0, 0.0, 0.0]", tilt)
    (folder / "description" / "parameters" / "rig.toml").write_text(rig)
    return mapping


def numbers(R: Rotation, kind: str, rng: np.random.Generator) -> dict[str, Array]:
    """As a file has them; quaternions of either sign."""
    if kind == "matrix":
        return dict(zip(NUMBERS["matrix"], R.as_matrix().reshape(-1, 9).T, strict=True))
    q = R.as_quat(scalar_first=True) * rng.choice([-1.0, 1.0], (len(R), 1))
    return dict(zip("wxyz", q.T, strict=True))


def columns_of(kind: str) -> str:
    names = NUMBERS[kind]
    if kind == "matrix":
        return f"matrix = {[list(names[i : i + 3]) for i in (0, 3, 6)]}"
    return "quaternion = { " + ", ".join(f'{name} = "{name}"' for name in names) + " }"


@pytest.mark.parametrize("kind", ["quaternion", "matrix"])
@pytest.mark.parametrize("joints", [["one"], ["one", "two"], ["one", "two", "three"]], ids=len)
@pytest.mark.parametrize("maps", ["link to base", "base to link"])
def test_angles_come_back(tmp_path: Path, kind: str, joints: list[str], maps: str) -> None:
    mount = Rotation.from_rotvec([0.4, -1.1, 0.8])
    R, still = orientation(joints, mount), Rotation.from_rotvec(TILTED) if "two" in joints else Rotation.identity()
    zero = still * mount
    if maps == "base to link":
        R, zero = R.inv(), zero.inv()
    given = zero.as_quat(scalar_first=True) if kind == "quaternion" else zero.as_matrix().ravel()
    table = f'{columns_of(kind)}\nmaps = "{maps}"\nat_zero = {given.tolist()}'
    mapping = write(tmp_path, joints, numbers(R, kind, np.random.default_rng(1)), table)
    said: list[str] = []
    campaign = import_recordings(mapping, tmp_path, tmp_path / "made", notice=said.append)
    fields = tuple(f"position[{name}]" for name in joints)
    read = read_streams(campaign / "recordings" / "turn_1.mcap", [WRENCH_STREAM, Stream("encoder", "/encoder", fields)])
    found = read["encoder"][1]
    turns = (found[0] - [MOVED[name][0] for name in joints]) / (2.0 * np.pi)
    np.testing.assert_allclose(turns, np.rint(turns), atol=1e-7)  # where it starts, whole turns are not known
    expected = np.column_stack([MOVED[name] for name in joints]) + 2.0 * np.pi * np.rint(turns)
    np.testing.assert_allclose(found, expected, atol=1e-6)
    assert f"turn otherwise than about the axes of {', '.join(joints)} by" in said[0]


def test_what_turns_about_another_axis_is_told_or_refused(tmp_path: Path) -> None:
    tilted = orientation(["one"], Rotation.identity())
    for off, folder in ((0.01, tmp_path / "little"), (0.5, tmp_path / "much")):
        R = Rotation.from_rotvec([off, 0.0, 0.0]) * tilted * Rotation.from_rotvec([-off, 0.0, 0.0])
        table = f'{columns_of("quaternion")}\nmaps = "link to base"'
        folder.mkdir()
        mapping = write(folder, ["one"], numbers(R, "quaternion", np.random.default_rng(1)), table)
        said: list[str] = []
        if off == 0.5:
            with pytest.raises(RecordingError, match="turns otherwise than about the axes of one, by"):
                import_recordings(mapping, folder, folder / "made")
            continue
        import_recordings(mapping, folder, folder / "made", notice=said.append)
        # The axis is off by `off`: what is left turns by 2 sin(q / 2) times that.
        rms = np.degrees(np.sqrt(np.mean((2.0 * np.sin(MOVED["one"] / 2.0) * off) ** 2)))
        assert f"by {rms:.2g} deg rms" in said[0]


def test_rows_that_are_no_rotation_are_counted(tmp_path: Path) -> None:
    columns = numbers(orientation(["one"], Rotation.identity()), "quaternion", np.random.default_rng(1))
    columns = {name: np.round(16384.0 * x) for name, x in columns.items()}  # as some sensors write it
    for x in columns.values():
        x[700:710] = 0.0  # lost
    table = f'{columns_of("quaternion")}\nmaps = "link to base"'
    said: list[str] = []
    campaign = import_recordings(
        write(tmp_path, ["one"], columns, table), tmp_path, tmp_path / "made", notice=said.append
    )
    assert any("10 orientations of one are no rotation, NaN" in one for one in said)
    read = read_streams(campaign / "recordings" / "turn_1.mcap", [Stream("encoder", "/encoder", ("position[one]",))])
    found = read["encoder"][1][:, 0]
    assert np.isnan(found).sum() == 10
    np.testing.assert_allclose(found[~np.isnan(found)], MOVED["one"][~np.isnan(found)], atol=2e-4)


@pytest.mark.parametrize(
    ("before", "after", "said"),
    [
        ('joints = ["one"]', 'joints = ["on"]', "does not map position[one]"),
        ('maps = "link to base"', 'maps = "base"', "link to base"),
        ('z = "z" }', 'z = "z" }\nat_zero = [1, 0, 0, 0, 0]', "has not 4 numbers"),
        ('z = "z" }', 'z = "z" }\nat_zero = [0, 0, 0, 0]', "at_zero is no rotation"),
        ("quaternion =", "# quaternion =", "has no columns, or those of two"),
        ('[[orientation]]', '[encoder]\none = { column = "x", unit = "rad" }\n[[orientation]]', "mapped twice"),
    ],
)  # fmt: skip
def test_faults_of_an_orientation(tmp_path: Path, before: str, after: str, said: str) -> None:
    columns = numbers(orientation(["one"], Rotation.identity()), "quaternion", np.random.default_rng(1))
    mapping = write(tmp_path, ["one"], columns, f'{columns_of("quaternion")}\nmaps = "link to base"')
    text = mapping.read_text().replace("'", '"')
    assert before in text
    mapping.write_text(text.replace(before, after))
    with pytest.raises(ConfigError) as caught:
        import_recordings(mapping, tmp_path, tmp_path / "made")
    assert said in str(caught.value)


@pytest.mark.parametrize(
    ("joints", "before", "after", "error", "said"),
    [
        (["one", "two"], 'joints = ["one", "two"]', 'joints = ["two", "one"]', ConfigError, "in this order"),
        (["one", "two"], "axis = [0, 0, 1]", "axis = [0, 1, 0]", ConfigError, "parallel axes"),
        (["one"], "axis = [0, 1, 0]", 'type = "prismatic"\naxis = [0, 1, 0]', ConfigError, "reads in m"),
        (["one", "two", "three"], "axis = [1, 0, 0]", "axis = [0, 1, 0]", RecordingError, "become parallel"),
    ],
)
def test_joints_that_an_orientation_does_not_tell(
    tmp_path: Path, joints: list[str], before: str, after: str, error: type[Exception], said: str
) -> None:
    columns = numbers(orientation(["one"], Rotation.identity()), "matrix", np.random.default_rng(1))
    mapping = write(tmp_path, joints, columns, f'{columns_of("matrix")}\nmaps = "link to base"')
    for path in (mapping, tmp_path / "description" / "parameters" / "rig.toml"):
        path.write_text(path.read_text().replace("'", '"').replace(before, after))
    with pytest.raises(error, match=said):
        import_recordings(mapping, tmp_path, tmp_path / "made")
