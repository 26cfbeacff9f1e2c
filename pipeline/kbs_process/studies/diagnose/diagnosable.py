"""What recordings have to be for a diagnosis to mean anything: long enough, of the right signs, with a stated noise."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from kbs_process.campaign.config import Campaign, RecordingEntry
from kbs_process.errors import ConfigError, RecordingError
from kbs_process.plant.rigid import loads
from kbs_process.rig.model import Rig
from kbs_process.signals.records import Mask, Run
from kbs_process.stages.conventions import OF_ENCODER, SignCheck, check_encoder_sense, check_gravity_sign
from kbs_process.stages.motion import Motion
from kbs_process.stages.repeats import commanded, copies

LOUD = 10.0  # times its noise, a channel's computed load: less may be what the files err by
LEAST_S = 5.0  # of a recording that can be compared: less has fewer frequencies than a floor has channels
_REVERSED = 0.5  # a slope of what is read against what is computed is one of the other sign below minus this


def check_noise(rig: Rig, where: str) -> None:
    """Raise ConfigError for channels without noise and resolution: nothing says what may be expected of them."""
    index = rig.loads.index(rig.channels)
    wrench = rig.loads.index(rig.transducer.channels)
    efforts = [float(joint.effort.resolution) for joint in rig.joints if joint.effort is not None]
    resolution = np.concatenate([rig.transducer.resolution.value[wrench], efforts])
    stated = rig.loads.noise[index] + resolution
    silent = [name for name, size in zip(rig.channels, stated, strict=True) if size == 0.0]
    if silent:
        raise ConfigError(
            f"neither noise nor resolution of {', '.join(silent)} is stated: no mismatch could be told from noise",
            where=where,
            remedy="give the rms noise of a sample in the parameter files ([transducer] noise, [joint.NAME] effort)",
        )


def check_signs(run: Run, moved: Motion, campaign: Campaign, entry: RecordingEntry) -> None:
    """Raise RecordingError where gravity or an encoder shows with the other sign, or an encoder does not move.

    `run` is decoupled. No physics that was left out turns a channel round; a wrong sign would be taken for some.
    """
    for check in _signs(run, moved, campaign.rig):
        slope = check.slope
        if slope is None or check.ok:
            continue
        if slope < -_REVERSED or (check.check.startswith(OF_ENCODER) and slope < _REVERSED):
            raise RecordingError(
                f"{check.check} is {check.found}, expected {check.expected}",
                where=str(entry.path),
                remedy="check signs, order and wiring of the channels, and the fields under [topics] in campaign.toml",
            )


def check_copies(runs: Sequence[tuple[RecordingEntry, Run]]) -> None:
    """Raise RecordingError for a recording that holds the readings of another: it would be a repeat without noise."""
    for place, first in copies([run for _, run in runs]).items():
        raise RecordingError(
            f"it has the same readings as {runs[first][0].path.name}: a copy is no repeat",
            where=str(runs[place][0].path),
            remedy="leave one of them out of campaign.toml",
        )


def check_length(name: str, valid: Mask, dt: float, where: str) -> None:
    """Raise RecordingError for a recording of which next to nothing can be compared."""
    seconds = dt * np.count_nonzero(valid)
    if seconds < LEAST_S:
        raise RecordingError(
            f"{seconds:.1f} s of {dt * len(valid):.1f} s can be compared with a prediction, and {LEAST_S:g} s are the "
            "least: wrench, angles or commands are missing in the others",
            where=where,
            remedy=f"kbs-process inspect shows what {name} lacks; record longer, or leave it out of campaign.toml",
        )


def _signs(run: Run, moved: Motion, rig: Rig) -> Iterator[SignCheck]:
    measured, rest = run.loads, np.zeros_like(moved.q)
    assert measured is not None
    index = rig.loads.index(measured.channels)
    known, noise = measured.valid, rig.loads.noise[index]
    static, read = loads(rig, moved.q, rest, rest)[known][:, index], measured.values[known]
    loud = np.flatnonzero(static.std(axis=0) > LOUD * noise)
    channels = [measured.channels[place] for place in loud]
    yield from check_gravity_sign(channels, read[:, loud], static[:, loud], noise[loud])
    command = commanded(run)
    if command is not None and run.angle is not None:
        yield from check_encoder_sense(run.angle, command)
