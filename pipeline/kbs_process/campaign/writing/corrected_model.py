"""A corrected model on disk: a folder that loads as a campaign, predicts any recording, and goes anywhere.

All that it is made of is in it. The recordings that it came from are not, and stay where they are.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from kbs_process.campaign.config import Campaign, SensingLaw
from kbs_process.campaign.documents import Tree, read
from kbs_process.campaign.locate import CAMPAIGN_FILE
from kbs_process.campaign.writing.parameter_files import corrected, entry, text_of, whole, write_parameters
from kbs_process.rig.model import Quantity, Rig
from kbs_process.terminal import printable

FOUND = "found.toml"  # numbers that the campaign's parameter files do not have
FLIGHT = "flight"  # folder of those of the flight model, in that of the parameter files
MISSION = "mission.toml"
_REMEDY = "keep the campaign as it is meanwhile"
_OF_DRIVE = ("ratio", "rotor_inertia", "steps_per_turn")


def write_model(
    campaign: Campaign,
    rig: Rig,
    effects: Sequence[str],
    changed: Mapping[str, Quantity],
    folder: Path,
    source: str,
    sensing: Sequence[SensingLaw] = (),
) -> tuple[Path, ...]:
    """Write campaign.toml and parameter files into `folder`; return their paths.

    `rig` and `effects` are the corrected ones, `changed` has its quantities that differ from the campaign's, in SI;
    a number that the campaign has not, and that was not fitted, is exact: it was chosen, or nothing acts there.
    `sensing` are laws that the sensors have beside the campaign's.
    """
    known = campaign.rig.quantities()
    old = {name: quantity for name, quantity in changed.items() if name in known}
    written = write_parameters(folder / "parameters", corrected(campaign, old, source))
    added = _added(campaign.rig, rig, changed, source)
    if added:
        path = folder / "parameters" / FOUND
        path.write_text(f"# Physics that was left out, {printable(source)}.\n" + text_of(added), encoding="utf-8")
        written = (*written, path)
    description = folder / CAMPAIGN_FILE
    every = (*campaign.sensing, *sensing)
    tree = _description(campaign, effects, every, written, folder)
    others = tuple(_brought(campaign, tree, folder))
    text = f"# {printable(campaign.name)}, its model corrected, {printable(source)}.\n" + text_of(tree)
    description.write_text(text, encoding="utf-8")
    return (description, *written, *others)


def _brought(campaign: Campaign, tree: Tree, folder: Path) -> Iterator[Path]:
    """Copy what else the description `tree` names into `folder`, name the copies in it, and yield them."""
    if substitutes := tree.get("flight", {}).get("substitute"):
        copies: list[Path] = []
        for index, name in enumerate(substitutes):
            path = campaign.folder / name
            taken = any(copy.name == path.name for copy in copies)
            copy = folder / "parameters" / FLIGHT / (f"{index + 1}-{path.name}" if taken else path.name)
            copies.append(_copied(path, campaign.folder, "the parameter file", copy))
        named = [copy.relative_to(folder).as_posix() for copy in copies]
        tree["flight"] = tree["flight"] | {"substitute": named}
        yield from copies
    if campaign.mission is not None:
        yield _copied(campaign.mission, campaign.mission.parent, "the mission file", folder / MISSION)
        tree["mission"] = tree["mission"] | {"file": MISSION}


def _copied(path: Path, beside: Path, role: str, copy: Path) -> Path:
    """Copy a file as it is, or with the numbers of the CSV files in it that it names relative to `beside`."""
    document = read(path, role=role, remedy=_REMEDY)
    inside = whole(document.tree, beside)
    copy.parent.mkdir(parents=True, exist_ok=True)
    copy.write_text(document.text if inside == document.tree else text_of(inside), encoding="utf-8")
    return copy


def _added(before: Rig, after: Rig, changed: Mapping[str, Quantity], source: str) -> Tree:
    """Numbers of `after` that `before` has not, as tables of a parameter file."""
    known = before.quantities()
    tree: Tree = {}

    def found(quantity: Quantity) -> dict[str, Any]:
        chosen = replace(quantity, sigma=np.zeros_like(quantity.sigma), source=source)
        return entry(changed.get(quantity.name, chosen))

    for external in after.external:
        if external.name not in {other.name for other in before.external}:
            own: Tree = {"on": external.on}
            if external.point is not None:
                own["point"] = found(external.point)
            own["parameters"] = {name: found(quantity) for name, quantity in external.parameters.items()}
            tree.setdefault("external", {})[external.name] = own
    for joint in after.joints:
        if joint.drive is None:
            continue
        own = {name: found(quantity) for name, quantity in joint.drive.parameters.items() if quantity.name not in known}
        whole: Tree = {"parameters": own} if own else {}
        for name in _OF_DRIVE:
            quantity: Quantity = getattr(joint.drive, name)
            if quantity.name not in known:
                whole[name] = found(quantity)
        if whole:
            tree.setdefault("joint", {})[joint.name] = {"drive": whole}
    return tree


def _description(
    campaign: Campaign, effects: Sequence[str], sensing: Sequence[SensingLaw], files: Sequence[Path], folder: Path
) -> Tree:
    """The campaign's description with the corrected model, recordings named from `folder`, all else as it was."""
    document = read(campaign.folder / CAMPAIGN_FILE, role="the campaign's description", remedy=_REMEDY)

    def from_here(name: str) -> str:
        return Path(os.path.relpath(campaign.folder / name, folder)).as_posix()

    tree: dict[str, Any] = dict(document.tree)
    model = {key: value for key, value in tree.get("model", {}).items() if key != "modal"}
    tree["model"] = model | {"effects": list(effects)}
    if sensing:
        tree["model"]["sensing"] = [_law(law) for law in sensing]
    tree["recording"] = [recording | {"file": from_here(recording["file"])} for recording in tree.get("recording", [])]
    tree["parameters"] = {"files": [f"parameters/{path.name}" for path in files]}
    return tree


def _law(law: SensingLaw) -> Tree:
    """A law as [model] sensing has it, in SI."""
    return {
        "law": law.law,
        "site": law.site,
        "parameters": {name: entry(quantity) for name, quantity in law.parameters.items()},
    }
