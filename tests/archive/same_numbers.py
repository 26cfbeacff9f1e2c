"""Do two results folders hold the same numbers? `python tests/archive/same_numbers.py BEFORE AFTER`.

Compares, bit by bit, every column of every table and every number in results.json below the two folders (of one
campaign, or of many). Left out are provenance, versions and sentences: texts may be worded anew, numbers may not.
Prints each difference, and exits with 1 if there is any.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as parquet

LEFT_OUT = {"provenance", "schema", "version", "software"}


def numbers(tree: Any, place: str = "") -> Iterator[tuple[str, float | bool | None]]:
    """Yield every number of a JSON tree with its place."""
    if isinstance(tree, dict):
        for key in sorted(tree.keys() - LEFT_OUT):
            yield from numbers(tree[key], f"{place}.{key}")
    elif isinstance(tree, list):
        yield f"{place} (length)", len(tree)
        for index, entry in enumerate(tree):
            yield from numbers(entry, f"{place}[{index}]")
    elif not isinstance(tree, str):
        yield place, tree


def differences(before: Path, after: Path) -> Iterator[str]:
    """Yield what differs between two files of one kind."""
    if before.suffix == ".json":
        one, two = (dict(numbers(json.loads(path.read_text()))) for path in (before, after))
        for place in sorted(one.keys() | two.keys()):
            if place not in one or place not in two or repr(one[place]) != repr(two[place]):
                yield f"{place}: {one.get(place, 'absent')} -> {two.get(place, 'absent')}"
        return
    tables = [parquet.read_table(path) for path in (before, after)]
    names = [set(table.column_names) for table in tables]
    for name in sorted(names[0] | names[1]):
        if not (name in names[0] and name in names[1]):
            yield f"{name}: in one of them alone"
            continue
        columns = [table.column(name).to_numpy() for table in tables]
        equal = columns[0].dtype == columns[1].dtype and np.array_equal(
            *columns, equal_nan=columns[0].dtype.kind == "f"
        )
        if not equal:
            yield f"{name}: {columns[0].dtype}{columns[0].shape}, {columns[1].dtype}{columns[1].shape}"


def compare(before: Path, after: Path) -> tuple[int, list[str]]:
    """Return how many files were compared, and every difference with its file."""
    files = [
        {
            path.relative_to(folder)
            for path in folder.rglob("*")
            if path.name == "results.json" or path.suffix == ".parquet"
        }
        for folder in (before, after)
    ]
    told = [f"{path}: in one of the folders alone" for path in sorted(files[0] ^ files[1])]
    for path in sorted(files[0] & files[1]):
        told += [f"{path} {difference}" for difference in differences(before / path, after / path)]
    return len(files[0] & files[1]), told


if __name__ == "__main__":
    count, found = compare(Path(sys.argv[1]), Path(sys.argv[2]))
    print("\n".join(found))
    print(f"{count} files compared, {len(found)} differences")
    sys.exit(bool(found) or not count)
