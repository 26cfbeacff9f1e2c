"""The bench does not know how the diagnosis works: it reads its results, and rivals get what comes before it."""

from __future__ import annotations

import ast
from pathlib import Path

BENCH = Path(__file__).parent
# What each file may use of the package, by the first two parts of a module's name.
ALLOWED = {
    "diagnosis.py": {"kbs_process.errors", "kbs_process.results", "kbs_process.studies"},  # reads results.json
    "page.py": {"kbs_process", "kbs_process.report", "kbs_process.results"},  # looks like all reports
    "isolate.py": {"kbs_process.cache"},  # where compiled plants are kept
    "prove.py": {"kbs_process.results"},  # the workers of all that is spread
    "record.py": {"kbs_process.results"},
    "prepare.py": {  # what comes before any detection
        "kbs_process.campaign",
        "kbs_process.diagnosis",
        "kbs_process.progress",
        "kbs_process.signals",
        "kbs_process.studies",
    },
    "smoother.py": {  # a part of the diagnosis, answering by itself
        "kbs_process.campaign",
        "kbs_process.diagnosis",
        "kbs_process.plant",
        "kbs_process.progress",
        "kbs_process.studies",
    },
}


def imported(path: Path) -> set[str]:
    """Modules of the package that a file imports, cut after two parts."""
    modules: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            modules |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            modules.add(node.module)
    return {".".join(name.split(".")[:2]) for name in modules if name.split(".")[0] == "kbs_process"}


def test_what_judges_uses_nothing_of_what_is_judged() -> None:
    files = [
        path
        for folder in (BENCH, BENCH / "rivals")
        for path in folder.glob("*.py")
        if not path.name.startswith("test_")
    ]
    assert len(files) > 25
    used = {path.name: imported(path) for path in files}
    assert {name: modules for name, modules in used.items() if modules} == ALLOWED


def test_rivals_take_no_find_from_the_diagnosis() -> None:
    source = (BENCH / "rivals" / "prepare.py").read_text(encoding="utf-8")
    names = [name for name in ("screen", "rounds", "gate", "signature", "localise", "ports") if name in source]
    assert names == []
