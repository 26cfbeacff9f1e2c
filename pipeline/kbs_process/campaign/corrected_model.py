"""A corrected model on disk: a folder that loads as a campaign of the same recordings, and predicts any other."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from kbs_process.campaign.config import Campaign
from kbs_process.campaign.documents import Tree, read
from kbs_process.campaign.locate import CAMPAIGN_FILE
from kbs_process.campaign.parameter_files import corrected, entry, text_of, write_parameters
from kbs_process.rig.model import Quantity, Rig

FOUND = "found.toml"  # numbers that the campaign's parameter files do not have
_OF_DRIVE = ("ratio", "rotor_inertia", "steps_per_turn")
_LEFT = ("flight", "mission")  # which refer to files that stay with the campaign


def write_model(
    campaign: Campaign,
    rig: Rig,
    effects: Sequence[str],
    changed: Mapping[str, Quantity],
    folder: Path,
    source: str,
) -> tuple[Path, ...]:
    """Write campaign.toml and parameter files into `folder`; return their paths.

    `rig` and `effects` are the corrected ones, `changed` has its quantities that differ from the campaign's, in SI.
    """
    known = campaign.rig.quantities()
    old = {name: quantity for name, quantity in changed.items() if name in known}
    written = write_parameters(folder / "parameters", corrected(campaign, old, source))
    added = _added(campaign.rig, rig)
    if added:
        path = folder / "parameters" / FOUND
        path.write_text(f"# Physics that was left out, {source}.\n" + text_of(added), encoding="utf-8")
        written = (*written, path)
    description = folder / CAMPAIGN_FILE
    description.write_text(_description(campaign, effects, written, source, folder), encoding="utf-8")
    return (description, *written)


def _added(before: Rig, after: Rig) -> Tree:
    """Numbers of `after` that `before` has not, as tables of a parameter file."""
    known = before.quantities()
    tree: Tree = {}
    for external in after.external:
        if external.name not in {other.name for other in before.external}:
            own: Tree = {"on": external.on}
            if external.point is not None:
                own["point"] = entry(external.point)
            own["parameters"] = {name: entry(quantity) for name, quantity in external.parameters.items()}
            tree.setdefault("external", {})[external.name] = own
    for joint in after.joints:
        if joint.drive is None:
            continue
        own = {
            name: entry(quantity)
            for name, quantity in joint.drive.parameters.items()
            if quantity.name not in known
        }
        whole: Tree = {"parameters": own} if own else {}
        for name in _OF_DRIVE:
            quantity: Quantity = getattr(joint.drive, name)
            if quantity.name not in known:
                whole[name] = entry(quantity)
        if whole:
            tree.setdefault("joint", {})[joint.name] = {"drive": whole}
    return tree


def _description(
    campaign: Campaign, effects: Sequence[str], files: Sequence[Path], source: str, folder: Path
) -> str:
    document = read(
        campaign.folder / CAMPAIGN_FILE,
        role="the campaign's description",
        remedy="keep the campaign as it is meanwhile",
    )
    tree: dict[str, Any] = {key: value for key, value in document.tree.items() if key not in _LEFT}
    model = {key: value for key, value in tree.get("model", {}).items() if key != "modal"}
    tree["model"] = model | {"effects": list(effects)}
    tree["recording"] = [
        recording | {"file": os.path.relpath(campaign.folder / recording["file"], folder)}
        for recording in tree.get("recording", [])
    ]
    tree["parameters"] = {"files": [f"parameters/{path.name}" for path in files]}
    return f"# {campaign.name}, its model corrected, {source}.\n" + text_of(tree)
