"""Does anything beside the physics tell what is concealed: names, sizes, times, order, compressibility, metadata?

Every property of a trial's folder that a cheat could read is a number here, and whether any of them goes with the
class (concealed or not; the port) is put to a permutation test of the greatest rank statistic over all properties:
its p-value needs no assumption and no correction for their number.

    python -m proof.leaks WORK SCORE      of a bench whose seals have been broken, run from tests/
"""

from __future__ import annotations

import io
import sys
import tarfile
import zlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from mcap.reader import make_reader
from numpy.typing import NDArray
from scipy.stats import rankdata

from proof.bundle import SEAL
from proof.score import Bench
from proof.truth import Truth

Array = NDArray[np.float64]
_PERMUTATIONS = 4000
# What a clock that drops messages does to a recording's size is its physics, and for the diagnosis to find.
_SHOWS_IN_SIZE = frozenset({"drops", "skew"})


def properties(name: str, content: bytes) -> dict[str, float]:
    """Everything about a packed trial that is no sample of a signal, as numbers."""
    found: dict[str, float] = {"name": float(int(name[1:], 16)), "size": float(len(content))}
    with tarfile.open(fileobj=io.BytesIO(content)) as archive:
        members = archive.getmembers()
        files = {m.name: archive.extractfile(m).read() for m in members}  # type: ignore[union-attr]
    found["files"] = float(len(members))
    found["time"] = float(sum(m.mtime for m in members))
    found["names' length"] = float(sum(len(m.name) for m in members))
    found["seal's size"] = float(len(files[SEAL]))
    found["seal, compressed"] = _ratio(files[SEAL])
    texts = b"".join(content for file, content in sorted(files.items()) if file.endswith(".toml"))
    found["description's size"] = float(len(texts))
    found["description, compressed"] = _ratio(texts)
    found["lines"] = float(texts.count(b"\n"))
    recordings = [(file, content) for file, content in sorted(files.items()) if file.endswith(".mcap")]
    each = [_of_recording(file, content) for file, content in recordings]
    for key in each[0]:
        values = [one[key] for one in each]
        found |= {f"{key}, mean": float(np.mean(values)), f"{key}, spread": float(np.ptp(values))}
        found[f"{key}, first"] = values[0]
    found["epochs rise"] = float(np.corrcoef([one["epoch"] for one in each], np.arange(len(each)))[0, 1])
    return found


def _of_recording(file: str, content: bytes) -> dict[str, float]:
    summary = make_reader(io.BytesIO(content)).get_summary()
    assert summary is not None and summary.statistics is not None
    counted = summary.statistics
    duration = (counted.message_end_time - counted.message_start_time) * 1e-9
    return {
        "file name": float(zlib.crc32(file.encode())),
        "bytes": float(len(content)),
        "messages a second": counted.message_count / max(duration, 1e-9),
        "duration": duration,
        "epoch": counted.message_start_time * 1e-9,
        "epoch's second": (counted.message_start_time % 1_000_000_000) * 1e-9,
        "chunks": float(counted.chunk_count),
        "channels": float(counted.channel_count),
        "metadata": float(counted.metadata_count + counted.attachment_count),
        "compressed": _ratio(content),
        "order of topics": float(zlib.crc32(" ".join(c.topic for c in summary.channels.values()).encode())),
    }


def _ratio(content: bytes) -> float:
    return len(zlib.compress(content, 1)) / max(1, len(content))


def greatest(numbers: Array, classes: NDArray[np.int64]) -> tuple[float, int]:
    """Greatest share of a property's rank variance that classes explain, and the property (column) it is of."""
    shares = _shares(_ranked(numbers), classes)
    return float(shares.max()), int(shares.argmax())


def permutation_p(numbers: Array, classes: NDArray[np.int64], seed: int = 0) -> float:
    """P-value of `greatest` under exchange of the classes; numbers (trials, properties)."""
    generator = np.random.default_rng(seed)
    ranked = _ranked(numbers)
    seen = _shares(ranked, classes).max()
    others = [_shares(ranked, generator.permutation(classes)).max() for _ in range(_PERMUTATIONS)]
    return float((1 + np.count_nonzero(np.array(others) >= seen - 1e-12)) / (1 + _PERMUTATIONS))


def _ranked(numbers: Array) -> Array:
    ranks = np.asarray(rankdata(numbers, axis=0), dtype=float)
    ranks -= ranks.mean(axis=0)
    spread = ranks.std(axis=0)
    return ranks[:, spread > 0.0] / spread[spread > 0.0] if (spread > 0.0).any() else np.zeros((len(ranks), 1))


def _shares(ranked: Array, classes: NDArray[np.int64]) -> Array:
    member = (classes[:, None] == np.unique(classes)[None, :]).astype(float)
    sums = member.T @ ranked
    shares: Array = (sums**2 / member.sum(axis=0)[:, None]).sum(axis=0) / len(ranked)
    return shares


def examine(packed: Mapping[str, bytes], truths: Sequence[Truth]) -> dict[str, dict[str, Any]]:
    """The test for each question that a cheat would ask."""
    told = {truth.trial: truth for truth in truths}
    names = sorted(name for name in packed if not _sizes_are_physics(told[name]))
    table = [properties(name, packed[name]) for name in names]
    labels = sorted(set.intersection(*(set(row) for row in table)))
    numbers = np.array([[row[label] for label in labels] + [k] for k, row in enumerate(table)])
    labels.append("place in the order")
    varying = [k for k in range(len(labels)) if np.ptp(numbers[:, k]) > 0.0]
    numbers, labels = numbers[:, varying], [labels[k] for k in varying]
    questions = {
        "anything concealed": [told[name].kind == "concealed" for name in names],
        "strength": [told[name].level for name in names],
        "port": [told[name].effects[0].port if told[name].effects else "" for name in names],
    }
    found = {}
    for question, answers in questions.items():
        classes = np.unique(np.array(answers), return_inverse=True)[1].astype(np.int64)
        share, place = greatest(numbers, classes)
        found[question] = {
            "trials": len(names),
            "properties": len(labels),
            "p": permutation_p(numbers, classes),
            "most telling": labels[place],
            "its share": share,
        }
    return found


def _sizes_are_physics(truth: Truth) -> bool:
    return any(effect.family in _SHOWS_IN_SIZE for effect in truth.effects)


def main() -> None:
    """Print the test for a finished bench: its work folder and its score."""
    work, score = Path(sys.argv[1]), Path(sys.argv[2])
    bench = msgspec.json.decode(score.read_bytes(), type=Bench)
    packed = {truth.trial: (work / "trials" / f"{truth.trial}.tar").read_bytes() for truth in bench.truths}
    for question, answer in examine(packed, bench.truths).items():
        print(f"{question}: " + ", ".join(f"{key} {value}" for key, value in answer.items()))


if __name__ == "__main__":
    main()
