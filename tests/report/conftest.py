"""Reports rendered once for all tests that look at them."""

from __future__ import annotations

from pathlib import Path

import pytest

from kbs_process.studies.documents import render as build
from report import sample


@pytest.fixture(scope="session")
def six_channels(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The page of the command-driven sample."""
    return build(sample.six_channels(tmp_path_factory.mktemp("six")), pdf=False)


@pytest.fixture(scope="session")
def one_channel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The page of the motion-driven sample."""
    return build(sample.one_channel(tmp_path_factory.mktemp("one")), pdf=False)
