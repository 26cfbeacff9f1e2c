"""Modal models as files: TOML, one table a pose and one a mode (schemas/modal.schema.json)."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from pathlib import Path

import numpy as np

from kbs_process.campaign.documents import Document, read
from kbs_process.campaign.formats.faults import checked
from kbs_process.campaign.formats.modal_file import ModalFile, PoseTable
from kbs_process.campaign.problems import Problems
from kbs_process.campaign.units import factor
from kbs_process.errors import did_you_mean
from kbs_process.plant.linear.modal import ModalModel, ModalTable, tracked
from kbs_process.signals.records import Array

SIX = ("shape", "participation", "gravity")


def read_modal(path: Path, joints: Collection[str]) -> ModalTable:
    """Read a modal file for a rig with `joints`; poses come out in the order of their angles.

    Raises ConfigError with the file, the key and the remedy.
    """
    problems = Problems(subject=str(path))
    document = read(path, role="the modal file", remedy="correct its name in campaign.toml, or add the file")
    file = checked(document, ModalFile, problems)
    if file.joint not in joints:
        problems.add(document.place(("joint",)), f"there is no joint '{file.joint}'", did_you_mean(file.joint, joints))
    _check_poses(file.pose, document, problems)
    problems.raise_any()
    models = sorted((_model(pose) for pose in file.pose), key=lambda model: model.angle)
    return ModalTable(file.joint, tracked(models), file.source)


def _check_poses(poses: Sequence[PoseTable], document: Document, problems: Problems) -> None:
    count = len(poses[0].mode)
    angles: set[float] = set()
    for index, pose in enumerate(poses):
        if len(pose.mode) != count:
            problems.add(
                document.place(("pose", index, "mode")),
                f"has {len(pose.mode)} modes, the first pose {count}",
                "give the same modes at every pose: they are followed from one to the next",
            )
        angle = _angle(pose)
        if angle in angles:
            problems.add(document.place(("pose", index, "angle")), "is given twice", "delete one of the two poses")
        angles.add(angle)


def _angle(pose: PoseTable) -> float:
    return pose.angle.value * factor(pose.angle.unit, "rad")


def _model(pose: PoseTable) -> ModalModel:
    def column(name: str) -> Array:
        return np.array([getattr(mode, name) for mode in pose.mode])

    def six(name: str) -> Array:
        return np.array([getattr(mode, name) for mode in pose.mode]).T

    return ModalModel(
        angle=_angle(pose),
        frequency=column("frequency_Hz"),
        frequency_sigma=column("frequency_sigma_Hz"),
        damping=column("damping"),
        damping_sigma=column("damping_sigma"),
        **{name: six(name) for name in SIX},
    )
