"""What conceals physics shares no code with the package that has to find it, nor with what scores it."""

from __future__ import annotations

import ast
from pathlib import Path

GENERATOR = Path(__file__).parent / "concealed"
ALLOWED = {"__future__", "engine", "mujoco", "numba", "numpy", "proof.concealed", "scipy"}


def imported(source: str) -> set[str]:
    names: set[str] = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "imports are absolute here"
            names.add(node.module or "")
    return names


def test_only_the_engine_and_numerics_are_imported() -> None:
    modules = sorted(GENERATOR.glob("*.py"))
    assert len(modules) > 12
    library = set(__import__("sys").stdlib_module_names)
    for path in modules:
        source = path.read_text()
        for name in imported(source):
            head = name if name.startswith("proof.") else name.partition(".")[0]
            known = head in ALLOWED | library or name.startswith("proof.concealed.")
            assert known, f"{path.name} imports {name}"
        assert "importlib" not in source and "__import__" not in source and "kbs_process" not in source, (
            path.name
        )
