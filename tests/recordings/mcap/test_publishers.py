"""Several channels of one topic: two publishers by turns are told, one that began again or came twice is not."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from mcap.writer import Writer

from kbs_process.errors import RecordingError
from kbs_process.recordings.mcap.source import open_recording
from kbs_process.recordings.mcap.streams import Stream
from kbs_process.reduction.inspection import inspect_recording

N = 2000
STEP = 10_000_000  # ns


def write(path: Path, came: list[tuple[int, int, float]], publishers: tuple[str, str, str] = ("", "", "")) -> None:
    """Messages (channel, log time, x) of the topic /x."""
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=4096)
        writer.start()
        channels = [writer.register_channel("/x", "json", 0, {"publisher": name}) for name in publishers]
        for channel, log, x in came:
            writer.add_message(channels[channel], log, json.dumps({"x": x}).encode(), log)
        writer.finish()


def by_turns(path: Path) -> dict[str, tuple[int, ...]]:
    source = open_recording(path)
    assert sum(len(block) for _, block in source.read([Stream("x", "/x", ("x",))])) > 0
    return source.publishers


@pytest.mark.parametrize("every", [1, 4])
def test_two_publishers_are_told_and_one_can_be_chosen(tmp_path: Path, every: int) -> None:
    path = tmp_path / "a.mcap"
    mine = [(0, k * STEP, 1.0 + k) for k in range(N)]
    other = [(2, k * STEP + STEP // 2, -1.0) for k in range(0, N, every)]
    write(path, sorted(mine + other, key=lambda one: one[1]))
    (found,) = by_turns(path).values()
    assert len(found) == 2
    told = [loss for loss in inspect_recording(path).losses if loss.kind == "publishers"]
    assert [loss.where for loss in told] == ["/x"]
    source = open_recording(path)
    blocks = [block for _, block in source.read([Stream("x", "/x", ("x",), channel=found[0])])]
    np.testing.assert_array_equal(np.concatenate([one.values[:, 0] for one in blocks]), 1.0 + np.arange(N))
    assert source.publishers == {}


def test_a_publisher_that_began_again_is_one(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    write(path, [(k // 700, k * STEP, 1.0) for k in range(N)])
    assert by_turns(path) == {}


def test_a_publisher_that_hands_over_to_another_is_told(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    write(path, [(k // 700, k * STEP, 1.0) for k in range(N)], ("sensor", "sensor", "filter"))
    assert by_turns(path) == {"x": (1, 2, 3)}


def test_messages_that_came_twice_are_one_publisher_s(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    write(path, [(channel, k * STEP, 1.0 + k) for k in range(N) for channel in (0, 1)])
    assert by_turns(path) == {}


def test_publishers_of_different_joints_are_told_and_one_can_be_chosen(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=4096)
        writer.start()
        channels = [writer.register_channel("/joints", "json", 0) for _ in range(2)]
        for k in range(N):
            for channel, name in zip(channels, ("arm", "hand"), strict=True):
                message = {"name": [name], "position": [1.0 + k]}
                writer.add_message(channel, k * STEP, json.dumps(message).encode(), k * STEP)
        writer.finish()
    found = inspect_recording(path)
    assert found.state == "lossy"
    assert [loss.where for loss in found.losses if loss.kind == "publishers"] == ["/joints"]
    arm = ("position[arm]",)
    with pytest.raises(RecordingError, match="no message names an element 'arm'") as refused:
        list(open_recording(path).read([Stream("x", "/joints", arm)]))
    assert "choose one by its `channel`" in refused.value.remedy
    blocks = [block for _, block in open_recording(path).read([Stream("x", "/joints", arm, channel=channels[0])])]
    np.testing.assert_array_equal(np.concatenate([one.values[:, 0] for one in blocks]), 1.0 + np.arange(N))
