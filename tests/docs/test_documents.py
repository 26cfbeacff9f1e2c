"""What the documents say is so: links lead somewhere, verbs and dependencies are those that there are."""

from __future__ import annotations

import ast
import os
import re
import tomllib
from importlib.metadata import packages_distributions, requires
from itertools import chain
from pathlib import Path
from typing import get_args

import pytest

from kbs_process.cli import cli
from kbs_process.diagnosis.facts import Answer
from kbs_process.studies.diagnose.report import _HEADLINES

ROOT = Path(__file__).parents[2]
RESULTS = {"tables/", "corrected/"}  # folders of results
NOT_OURS = {"build", "node_modules", "results"}
README = (ROOT / "README.md").read_text(encoding="utf-8")
PYPROJECT = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
# Packages that are run, not imported, and where one sees it.
RUN = {
    "ruff": "bin/ruff check",
    "mypy": "bin/mypy",
    "import-linter": "bin/lint-imports",
    "pytest-xdist": "bin/pytest -n 2",
    "pandas-stubs": "pandas>=",
    "scipy-stubs": "scipy>=",
    "types-jsonschema": "jsonschema>=",
    "setuptools": "setuptools.build_meta",
}


def documents() -> list[Path]:
    """All Markdown files of the project."""
    found = []
    for folder, below, files in os.walk(ROOT):
        below[:] = [name for name in below if not name.startswith(".") and name not in NOT_OURS]
        found += [Path(folder, name) for name in files if name.endswith(".md")]
    return sorted(found)


def anchors(document: Path) -> set[str]:
    """The anchors that a viewer of Markdown makes of the headings."""
    text = re.sub(r"```.*?```", "", document.read_text(encoding="utf-8"), flags=re.DOTALL)
    headings = re.findall(r"^#+ (.*)$", text, flags=re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).strip().replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("document", documents(), ids=lambda path: str(path.relative_to(ROOT)))
def test_links_lead_somewhere(document: Path) -> None:
    text = re.sub(r"```.*?```|`[^`\n]*`", "", document.read_text(encoding="utf-8"), flags=re.DOTALL)
    for link in re.findall(r"\]\(([^)\s]+)\)", text):
        if re.match(r"[a-z]+:", link):
            continue
        path, _, anchor = link.partition("#")
        target = (document.parent / path).resolve() if path else document
        assert target.exists(), link
        assert target.is_relative_to(ROOT), link
        assert not anchor or anchor in anchors(target), link


@pytest.mark.parametrize("name", ["architecture", "diagnosis", "identification", "proof"])
def test_paths_that_developers_read_exist(name: str) -> None:
    """Of the package, its tests or the repository; NAME and the like stand for any."""
    text = re.sub(r"```.*?```", "", (ROOT / "docs" / "dev" / f"{name}.md").read_text(encoding="utf-8"), flags=re.DOTALL)
    named = set(re.findall(r"`([\w./-]+/[\w.-]*(?:\.py)?)`", text))
    paths = {path for path in named if (path.endswith((".py", "/"))) and not re.search(r"[A-Z]{4}", path)}
    roots = (ROOT, ROOT / "pipeline" / "kbs_process", ROOT / "tests")
    assert {path for path in paths if not any((root / path).exists() for root in roots)} <= RESULTS
    assert paths


def test_the_folders_of_the_architecture_stand_in_the_order_of_the_layers() -> None:
    layers = tomllib.loads(PYPROJECT)["tool"]["importlinter"]["contracts"][0]["layers"]
    level = {name.removeprefix("kbs_process."): depth for depth, one in enumerate(layers) for name in one.split(" | ")}
    table = (ROOT / "docs" / "dev" / "architecture.md").read_text(encoding="utf-8").partition("## Folders")[2]
    cells = re.findall(r"^\| (`[^|]+) \|", table.partition("\nStudies know")[0], flags=re.MULTILINE)
    named = [name for cell in cells for name in re.findall(r"`(\w+)(?:/|\.py)`", cell)]
    assert [level[name] for name in named] == sorted(level[name] for name in named)
    assert level.keys() - set(named) == {"progress", "interruption"}


def test_the_readme_s_verbs_are_the_command_line_s() -> None:
    table = README[README.index("| command |") :]
    verbs = re.findall(r"^\| `kbs-process ([a-z-]+)", table, flags=re.MULTILINE)
    assert sorted([*verbs, "process"]) == sorted(cli.commands)


def test_every_verb_s_help_has_an_example_of_it() -> None:
    for name, command in cli.commands.items():
        assert "Examples:" in (command.epilog or ""), name
        assert name == "process" or f"  kbs-process {name} " in (command.epilog or ""), name


def canonical(requirement: str) -> str:
    """The package's name out of a requirement."""
    found = re.match(r"[A-Za-z0-9_.-]+", requirement)
    assert found, requirement
    return re.sub(r"[-_.]+", "-", found.group()).lower()


def dependencies() -> tuple[set[str], set[str]]:
    """What the package needs at run time, its extras included, and what only its tests need."""
    project = tomllib.loads(PYPROJECT)["project"]
    extras = project["optional-dependencies"]
    test = extras.pop("test")
    runtime = {canonical(one) for one in chain(project["dependencies"], *extras.values())}
    return runtime, {canonical(one) for one in test} - {project["name"]} - runtime


def imported(folder: str) -> set[str]:
    """Distributions that the Python files below a folder import."""
    modules: set[str] = set()
    for path in (ROOT / folder).rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                modules |= {alias.name.split(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
                modules.add(node.module.split(".")[0])
    by_module = packages_distributions()
    return {canonical(name) for module in modules for name in by_module.get(module, ())}


def test_every_answer_of_a_diagnosis_is_explained() -> None:
    text = (ROOT / "docs" / "diagnose.md").read_text()
    told = set(re.findall(r"^\| `([a-z ]+)`, \"([^\"]+)\" \|", text, flags=re.MULTILINE))
    assert told == set(_HEADLINES.items())
    assert {answer for answer, _ in told} == set(get_args(Answer))


def test_every_dependency_is_justified_and_nothing_else() -> None:
    text = (ROOT / "docs" / "dev" / "dependencies.md").read_text(encoding="utf-8")
    rows = [[cell.strip() for cell in row.strip("|").split("|")] for row in re.findall(r"^\|.*\|$", text, re.M)]
    justified = [name for row in rows for name in row[-2].split(", ") if not set(name) <= set("- ")]
    runtime, test = dependencies()
    assert sorted(set(justified) - {"package"}) == sorted(runtime | test)
    assert all(row[-1] for row in rows)


@pytest.mark.slow
def test_every_dependency_is_used() -> None:
    runtime, test = dependencies()
    # A package without a wheel for this machine is not installed here; its marker says so.
    optional = {canonical(line) for line in re.findall(r'"(.*); platform_machine', PYPROJECT)}
    assert runtime - imported("pipeline") <= optional
    assert test - imported("tests") == set(RUN)
    for name, evidence in RUN.items():
        assert evidence in README + PYPROJECT, name


@pytest.mark.slow
def test_what_is_imported_is_declared_or_comes_with_what_is() -> None:
    runtime, _ = dependencies()
    extra = imported("pipeline") - {"kbs-process"} - runtime
    along = {canonical(one) for name in runtime & imported("pipeline") for one in requires(name) or ()}
    assert extra <= along
    text = (ROOT / "docs" / "dev" / "dependencies.md").read_text(encoding="utf-8")
    assert {name for name in extra if f"`{name}`" in text} == extra
