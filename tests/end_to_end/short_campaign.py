"""EL089's description with recordings of twenty seconds: the whole way takes a moment."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from campaign.campaign_folder import CampaignFolder, make_folder
from kbs_process.campaign.load import load_campaign
from kbs_process.plant.rigid import loads
from kbs_process.recordings.mcap.messages.encoding import OutStream
from kbs_process.recordings.mcap.writer import write_mcap
from kbs_process.rig.model import Rig
from kbs_process.signals.records import Array

JOINTS = ("az", "el")


def short_campaign(target: Path) -> CampaignFolder:
    """Make the campaign's folder, with wrenches of its own rig: on another's, what is wrong would be looked for."""
    folder = make_folder(target)
    rig = load_campaign(folder.path, checksums=False).rig
    for path in (folder.path / "recordings").iterdir():
        record(path, rig=rig)
    return folder


def record(
    path: Path,
    *,
    moving: bool = True,
    noise: float | Array = 0.0,
    seed: int = 1,
    nan: slice | NDArray[np.intp] | None = None,
    swapped: bool = False,
    read: tuple[str, ...] = JOINTS,
    rig: Rig | None = None,
    degrees: bool = False,
) -> None:
    """Write twenty seconds: elevation at rest, or swinging; a constant wrench, or that of a `rig`, and noise (N, N m),
    of all channels or of each.

    The readings `nan` of Fz are no numbers; if `swapped`, two messages are in the other's
    place. Encoders `read` some joints, as `degrees` if that is asked for.
    """
    stamp = np.arange(2000) * 10_000_000
    cycle = stamp[::10]
    swing = 0.1 * np.sin(0.5 * stamp * 1e-9) if moving else np.zeros(len(stamp))
    angle = np.stack([np.zeros(len(stamp)), 1.3 + swing], axis=1)
    command = np.concatenate([angle[::10], np.gradient(angle[::10], 0.1, axis=0)], axis=1)
    wrench = np.tile([0.0, 0.0, -274.0, -6.0, 5.0, 0.0], (len(stamp), 1))
    if rig is not None:
        turning = np.stack([np.zeros(len(stamp)), 0.05 * moving * np.cos(0.5 * stamp * 1e-9)], axis=1)
        gaining = np.stack([np.zeros(len(stamp)), -0.25 * swing], axis=1)
        wrench = loads(rig, angle, turning, gaining)[:, :6] @ (np.eye(6) + rig.transducer.cross_coupling.value).T
    wrench += noise * np.random.default_rng(seed).standard_normal(wrench.shape)
    if nan is not None:
        wrench[nan, 2] = np.nan
    sensed = stamp.copy()
    if swapped:
        sensed[[700, 701]] = stamp[[701, 700]]
    columns = [JOINTS.index(name) for name in read]
    write_mcap(
        path,
        [
            OutStream("/transducer/wrench", "wrench", sensed, stamp, wrench),
            OutStream(
                "/encoder",
                "joints",
                stamp,
                stamp,
                np.degrees(angle[:, columns]) if degrees else angle[:, columns],
                read,
            ),
            OutStream("/command", "joints", cycle, cycle, command, JOINTS),
        ],
    )
