"""Parameter files with new values: the campaign's own, number by number, as TOML that loads at once."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from datetime import date, datetime, time
from pathlib import Path
from typing import Any

import numpy as np

from kbs_process.campaign.config import Campaign
from kbs_process.campaign.documents import Tree, quoted, read, within
from kbs_process.campaign.quantities import from_csv
from kbs_process.rig.model import Quantity
from kbs_process.terminal import printable

_HEAD = "# {name}, with numbers identified from {source}.\n# Everything else is as it was; comments were left out.\n"


def corrected(campaign: Campaign, changed: Mapping[str, Quantity], source: str) -> Iterator[tuple[str, str]]:
    """Yield name and text of each parameter file of the campaign with the quantities of `changed` in place.

    New quantities are in SI. What lies in CSV files is in the text: it goes where the text goes. Raises ConfigError
    where a file has gone since the campaign was loaded.
    """
    for path in campaign.inputs[1:]:
        if path.suffix == ".toml" and path != campaign.modal:
            document = read(path, role="the parameter file", remedy="keep the campaign as it is meanwhile")
            yield (
                path.name,
                _HEAD.format(name=printable(path.name), source=printable(source))
                + text_of(_replaced(whole(document.tree, campaign.folder), changed)),
            )


def whole(tree: Tree, folder: Path) -> Tree:
    """The tree with the numbers of CSV files that its quantities name, relative to `folder`, in place of the names."""
    new: Tree = {}
    for key, child in tree.items():
        if not isinstance(child, dict):
            new[key] = child
        elif "value" in child:
            named = (part for part in ("value", "sigma") if isinstance(child.get(part), str))
            new[key] = child | {
                part: _numbers(from_csv(within(folder, child[part], where=part), part)) for part in named
            }
        else:
            new[key] = whole(child, folder)
    return new


def _replaced(tree: Tree, changed: Mapping[str, Quantity]) -> Tree:
    def walk(node: Tree, path: tuple[str, ...]) -> Tree:
        new: Tree = {}
        for key, child in node.items():
            here = (*path, key)
            if not isinstance(child, dict):
                new[key] = child
            elif "value" in child:
                # The rig's own names have no "parameters" in them.
                name = ".".join(part for part in here if part != "parameters")
                new[key] = entry(changed[name]) if name in changed else child
            else:
                new[key] = walk(child, here)
        return new

    return walk(tree, ())


def entry(quantity: Quantity) -> dict[str, Any]:
    """A quantity as a parameter file has it, in SI."""
    return {
        "value": _numbers(quantity.value),
        "unit": quantity.unit,
        "sigma": _numbers(quantity.sigma),
        "source": quantity.source,
    }


def _numbers(array: np.ndarray[Any, Any]) -> Any:
    return array.tolist()


def text_of(tree: Tree) -> str:
    """TOML of a tree of tables."""
    return "\n".join(_table(tree, ())).strip() + "\n"


def _table(node: Tree, path: tuple[str, ...]) -> Iterator[str]:
    """Leaves first, as keys of this table, then its sub-tables."""
    leaves = {key: child for key, child in node.items() if not isinstance(child, dict) or "value" in child}
    if leaves and path:
        yield ""
        yield f"[{'.'.join(map(_key, path))}]"
    for key, child in leaves.items():
        yield f"{_key(key)} = {value_text(child)}"
    for key, child in node.items():
        if key not in leaves:
            yield from _table(child, (*path, key))


def _key(key: str) -> str:
    return key if key.replace("_", "").replace("-", "").isalnum() and key.isascii() else quoted(key)


def value_text(value: Any) -> str:
    """TOML of one value."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{_key(key)} = {value_text(child)}" for key, child in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(map(value_text, value)) + "]"
    if isinstance(value, datetime | date | time):
        return value.isoformat()
    if isinstance(value, str):
        return quoted(value)
    if isinstance(value, bool | int):
        return str(value).lower()
    return repr(float(value))


def write_parameters(folder: Path, files: Iterator[tuple[str, str]]) -> tuple[Path, ...]:
    """Write them into `folder`; return their paths."""
    folder.mkdir(parents=True)
    written = []
    for name, text in files:
        path = folder / name
        path.write_text(text, encoding="utf-8")
        written.append(path)
    return tuple(written)
