"""The versions of results.json: which one is written, and how a former one becomes it."""

from __future__ import annotations

from typing import Any, Literal

VERSION: Literal[2] = 2


def upgraded(tree: dict[str, Any]) -> dict[str, Any]:
    """Return the contents of a results.json of a former version as this version has them; others stay as they are.

    Version 1 was counted for each kind of results by itself; its keys mean what they mean now.
    """
    return {**tree, "schema": VERSION} if tree.get("schema", 1) == 1 else tree
