"""What all tests share: marks of speed, one thread each, bytecode, and the archived campaigns, processed once."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING

# Before numpy is imported: two test processes share two cores, and sums keep their order.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", "1")

import pytest
from hypothesis import settings

if TYPE_CHECKING:
    from campaign.campaign_folder import CampaignFolder
    from end_to_end.archive_run import Processed

SPEEDS = ("fast", "slow", "validation")
FAST_S = 3.0  # a test that takes longer should be marked slow

# What is tested is computed; tests of the cache of stages say so.
os.environ["KBS_CACHE_MB"] = "0"
# Bytecode is kept whatever the machine's habit: else each of many processes compiles the package anew, and
# collecting alone rewrites all assertions, for half a minute.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False
# What a step takes by the clock of a machine that others use, too, is no property of the code.
settings.register_profile("shared machine", deadline=None)
settings.load_profile("shared machine")


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """A test is fast unless marked slow or validation. Files with others come first, so that processes end together."""
    lasting = set()
    for item in items:
        marks = [mark for mark in SPEEDS if item.get_closest_marker(mark)]
        if not marks:
            item.add_marker("fast")
        elif len(marks) > 1:
            raise pytest.UsageError(f"{item.nodeid} is marked {' and '.join(marks)}: leave one of them")
        elif marks != ["fast"]:
            lasting.add(item.path)
    items.sort(key=lambda item: item.path not in lasting)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Name the tests that are marked fast and are not."""
    reports: Iterable[pytest.TestReport] = terminalreporter.stats.get("passed", ())
    late = [one for one in reports if one.when == "call" and "fast" in one.keywords and one.duration > FAST_S]
    if late:
        terminalreporter.section(f"marked fast, over {FAST_S:g} s: mark them slow")
        for one in sorted(late, key=lambda one: -one.duration):
            terminalreporter.line(f"{one.duration:6.1f} s  {one.nodeid}")


@pytest.fixture
def folder(tmp_path: Path) -> CampaignFolder:
    """A campaign folder that may be damaged."""
    from campaign.campaign_folder import make_folder

    return make_folder(tmp_path / "campaigns" / "EL089")


@pytest.fixture(scope="session")
def run_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder that all processes of this run of the tests share."""
    own = tmp_path_factory.getbasetemp()
    folder = (own.parent if "PYTEST_XDIST_WORKER" in os.environ else own) / "shared"
    folder.mkdir(exist_ok=True)
    return folder


@pytest.fixture(scope="session")
def archived(run_folder: Path) -> Callable[[str], Processed]:
    """Results of an archived campaign, processed by whichever test asks first."""
    from end_to_end.archive_run import processed

    return lambda name: processed(name, run_folder)
