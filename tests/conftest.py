"""What all tests share: the number of threads, and the archived campaigns, processed once."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

# Before numpy is imported: two test processes share two cores, and sums keep their order.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", "1")

import pytest

if TYPE_CHECKING:
    from end_to_end.archive_run import Processed


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
