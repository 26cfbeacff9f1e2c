"""The house stays one that a newcomer finds his way in: small folders, imports without circles, a contract each."""

from __future__ import annotations

import ast
import tomllib
from collections import Counter
from fnmatch import fnmatch
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "pipeline" / "kbs_process"
MOST_MODULES = 15  # of a folder, beside its __init__.py
MOST_LINES = 65_367
FOLDERS = sorted(path.parent for path in PACKAGE.rglob("__init__.py"))


def dotted(path: Path) -> str:
    """A file's or folder's name as imports write it."""
    parts = path.relative_to(PACKAGE.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


@cache
def imports() -> dict[str, set[str]]:
    """Which modules each module imports, inside functions or not; what only type checkers see does not count."""
    modules = {dotted(path): path for path in PACKAGE.rglob("*.py")}
    found: dict[str, set[str]] = {name: set() for name in modules}
    for name, path in modules.items():
        tree = ast.parse(path.read_text(encoding="utf-8"))
        typing = {
            id(node)
            for guard in ast.walk(tree)
            if isinstance(guard, ast.If) and ast.unparse(guard.test) == "TYPE_CHECKING"
            for node in ast.walk(guard)
        }
        for node in ast.walk(tree):
            if isinstance(node, ast.ImportFrom) and node.module and id(node) not in typing:
                named = {f"{node.module}.{alias.name}" for alias in node.names} & modules.keys()
                found[name] |= named or ({node.module} & modules.keys())
    return found


def circle(graph: dict[str, set[str]]) -> list[str]:
    """The modules of a circle, if there is one."""
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        return list(error.args[1])
    return []


def test_folders_are_rooms() -> None:
    count = Counter(path.parent for path in PACKAGE.rglob("*.py") if path.name != "__init__.py")
    assert {dotted(folder): n for folder, n in count.items() if n > MOST_MODULES} == {}


def test_the_product_stays_small() -> None:
    files = [path for pattern in ("*.py", "*.j2") for path in PACKAGE.rglob(pattern)]
    assert sum(len(path.read_text(encoding="utf-8").splitlines()) for path in files) <= MOST_LINES


def test_no_file_is_in_a_circle_of_imports() -> None:
    inside = "kbs_process.diagnosis."  # whose own rooms still need each other
    graph = {
        name: {target for target in targets if target != name and not target.startswith(inside)}
        for name, targets in imports().items()
        if not name.startswith(inside)
    }
    assert circle(graph) == []


def test_a_circle_would_be_seen() -> None:
    assert set(circle({"a": {"b"}, "b": {"c"}, "c": {"a"}, "d": {"a"}})) == {"a", "b", "c"}


@pytest.mark.parametrize("folder", FOLDERS, ids=dotted)
def test_every_folder_tells_what_it_is_for(folder: Path) -> None:
    assert ast.get_docstring(ast.parse((folder / "__init__.py").read_text(encoding="utf-8")))


def test_every_folder_has_an_import_contract() -> None:
    """A contract names the folder, or what is in it."""
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]["contracts"]
    named = set()
    for contract in contracts:
        entries = [entry for key in ("layers", "modules", "source_modules") for entry in contract.get(key, ())]
        names = {name.strip() for entry in entries for name in entry.replace(":", "|").split("|")}
        named |= {f"{box}.{name}" for box in contract.get("containers", ()) for name in names} or names
    inside = {name.rpartition(".")[0] for name in named}
    without = [dotted(path) for path in FOLDERS if not any(fnmatch(dotted(path), name) for name in named | inside)]
    assert without == []
