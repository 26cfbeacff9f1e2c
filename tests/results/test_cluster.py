"""Work on a Dask cluster: the same results as here, and nothing is lost with a worker."""

from __future__ import annotations

import operator
import os
import signal
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from kbs_process.errors import ConfigError
from kbs_process.results import parallel
from kbs_process.results.parallel import Crew, each, ordered_map, workers

pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("ignore")]  # of a library that is not ours


@pytest.fixture(scope="module")
def cluster() -> Iterator[Any]:
    from distributed import LocalCluster

    with LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as found:
        yield found


def marked(held: str, piece: int) -> tuple[int, int]:
    """Leave a mark of who works on a piece, and take a while over it."""
    (Path(held) / f"{piece}.{os.getpid()}").touch()
    time.sleep(0.3)
    return piece, os.getpid()


def test_a_worker_that_is_killed_in_mid_work_loses_nothing(cluster: Any, tmp_path: Path) -> None:
    with Crew(str(tmp_path), scheduler=cluster.scheduler_address) as crew:
        results = crew.map(marked, range(12))
        piece, killed = next(results)
        assert piece == 0
        os.kill(killed, signal.SIGKILL)
        pieces, by = zip(*results, strict=True)
    assert pieces == tuple(range(1, 12))
    assert any(int(path.suffix[1:]) == killed for path in tmp_path.iterdir())
    assert len(set(by) - {killed}) > 0


def test_results_come_in_the_order_of_the_work(cluster: Any) -> None:
    told: list[float] = []
    found = ordered_map(abs, [-3, 2, -1], told.append, scheduler=cluster.scheduler_address)
    assert list(found) == [3, 2, 1]
    assert told == [pytest.approx((k + 1) / 3) for k in range(3)]


def test_each_piece_comes_with_its_result(cluster: Any) -> None:
    with workers(scheduler=cluster.scheduler_address) as pool:
        assert dict(each(pool, operator.neg, range(150))) == {k: -k for k in range(150)}


def of_its_own() -> str:
    return str(os.getpid())


def test_workers_of_another_version_are_refused(cluster: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(parallel, "content", of_its_own)
    with (
        pytest.raises(ConfigError, match="other versions of kbs-process"),
        workers(scheduler=cluster.scheduler_address),
    ):
        pass


def test_a_cluster_that_is_not_there_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(parallel, "PATIENCE", 0.2)
    with pytest.raises(ConfigError, match="no Dask scheduler answers"), workers(scheduler="tcp://127.0.0.1:9"):
        pass


@pytest.mark.parametrize("address", ["nowhere", "ftp://x:1", "tcp://x", ""])
def test_an_address_that_is_none_is_told(monkeypatch: pytest.MonkeyPatch, address: str) -> None:
    monkeypatch.setattr(parallel, "PATIENCE", 0.2)
    with pytest.raises(ConfigError, match="no Dask scheduler answers"), workers(scheduler=address):
        pass
