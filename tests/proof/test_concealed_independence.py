"""What conceals physics shares no code with the package that has to find it, nor with what scores it."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

ALLOWED = {"__future__", "engine", "mujoco", "numba", "numpy", "scipy"}
GENERATORS = {
    "concealed": ALLOWED | {"proof.concealed"},
    "odd": ALLOWED | {"mcap", "msgspec", "proof.concealed", "proof.odd"},  # a file format, a table
}
LEAST_MODULES = {"concealed": 13, "odd": 6}


def imported(source: str) -> set[str]:
    names: set[str] = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "imports are absolute here"
            names.add(node.module or "")
    return names


@pytest.mark.parametrize("generator", GENERATORS)
def test_only_the_engine_and_numerics_are_imported(generator: str) -> None:
    allowed = GENERATORS[generator]
    modules = sorted((Path(__file__).parent / generator).glob("*.py"))
    assert len(modules) >= LEAST_MODULES[generator]
    library = set(__import__("sys").stdlib_module_names)
    for path in modules:
        source = path.read_text()
        for name in imported(source):
            parts = 2 if name.startswith("proof.") else 1
            known = ".".join(name.split(".")[:parts]) in allowed | library
            assert known, f"{path.name} imports {name}"
        assert "importlib" not in source and "__import__" not in source and "kbs_process" not in source, path.name
