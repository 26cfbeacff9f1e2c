"""Modal files made: from the plant itself, or from Nastran's results."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from kbs_process.campaign.config import Campaign
from kbs_process.campaign.documents import shown
from kbs_process.campaign.writing.modal_file import modal_text
from kbs_process.errors import ConfigError, OutputError, did_you_mean
from kbs_process.plant.laws import select
from kbs_process.plant.linear.modal import ModalTable, derive, tracked
from kbs_process.studies.modal.nastran import read_f06


def derive_modes(campaign: Campaign, joint: str | None, angles_deg: Sequence[float], target: Path) -> ModalTable:
    """Derive the modes from the campaign's plant at angles of `joint` (default: the last one), and write them."""
    names = campaign.rig.joint_names
    swept = _known(joint, names, campaign.name)
    if campaign.rig.transducer.stiffness is None:
        raise ConfigError(
            "the transducer is rigid, and nothing resonates on it",
            where="[transducer] stiffness",
            remedy="give stiffness and damping",
        )
    table = derive(campaign.rig, select(campaign.effects), swept, np.radians(angles_deg), np.zeros(len(names)))
    _write(table, target)
    return table


def import_modes(
    campaign: Campaign,
    joint: str | None,
    files: Sequence[tuple[float, Path]],
    target: Path,
    *,
    interface: int,
    ground: Sequence[int],
    damping: float,
) -> ModalTable:
    """Read the f06 file of each pose (deg of `joint`), and write them as one modal file."""
    swept = _known(joint, campaign.rig.joint_names, campaign.name)
    models = [
        read_f06(path, float(np.radians(angle)), interface=interface, ground=ground, damping=damping)
        for angle, path in sorted(files)
    ]
    if len({len(model.frequency) for model in models}) > 1:
        counts = ", ".join(
            f"{shown(path)}: {len(m.frequency)}" for (_, path), m in zip(sorted(files), models, strict=True)
        )
        raise ConfigError(
            f"the poses have different numbers of modes ({counts})", remedy="ask Nastran for the same number at each"
        )
    names = ", ".join(path.name for _, path in sorted(files))
    table = ModalTable(swept, tracked(models), f"Nastran: {names}")
    _write(table, target)
    return table


def _known(joint: str | None, names: Sequence[str], where: str) -> str:
    if joint is not None and joint not in names:
        raise ConfigError(f"there is no joint '{joint}'", where=where, remedy=did_you_mean(joint, names))
    return names[-1] if joint is None else joint


def _write(table: ModalTable, target: Path) -> None:
    try:
        with target.open("x", encoding="utf-8") as file:
            file.write(modal_text(table))
    except FileExistsError:
        raise OutputError("is there already", where=shown(target), remedy="name another file, or delete it") from None
    except OSError as error:
        raise OutputError(f"cannot be written: {error.strerror}", where=shown(target)) from error
