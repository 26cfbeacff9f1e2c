"""The engine shares no code with the package that it tests."""

from __future__ import annotations

import ast
from pathlib import Path

ENGINE = Path(__file__).parent


def imported(source: str) -> set[str]:
    names: set[str] = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names |= {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "imports are absolute here"
            names.add((node.module or "").partition(".")[0])
    return names


def test_nothing_of_the_package_is_imported() -> None:
    modules = [path for path in ENGINE.glob("*.py") if not path.name.startswith("test_")]
    assert len(modules) > 8
    for path in modules:
        source = path.read_text()
        assert "kbs_process" not in imported(source), path.name
        assert "importlib" not in imported(source) and "__import__" not in source, path.name
