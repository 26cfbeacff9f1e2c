"""Results of stages, kept by content: what was computed from the same numbers by the same code is not computed again.

The key of a result is the SHA-256 of the stage's name, its inputs, this package's files, every installed package with
its version, and the machine. What is kept is numbers and words, and no code: an entry is read as a tree of records of
this package, of which nothing is run. Whether a result was kept or has just been computed, its arrays lie in memory in
the same way, so that all that follows comes to the same bits.
"""

from __future__ import annotations

import dataclasses
import hashlib
import platform
import sys
from collections.abc import Callable, Hashable, Sequence
from contextlib import suppress
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any, TypeVar

import msgspec
import numpy as np

import kbs_process
from kbs_process.cache import find, keep, limit
from kbs_process.results.code import content

T = TypeVar("T")
_CONTAINERS: dict[str, Callable[[list[Any]], Any]] = {"tuple": tuple, "list": list, "set": set, "frozenset": frozenset}
_ALIGNED = 64  # bytes, as numpy lays arrays out at best


def kept(stage: str, inputs: object, make: Callable[[], T]) -> T:
    """Return what `make` makes of `inputs`, all that it depends on: from the cache where that has it.

    Inputs and results are numbers, words, arrays and paths, in records and containers of any depth. A path is a name:
    give the SHA-256 of a file that is read beside it. What `make` raises is raised, and not kept.
    """
    if not limit():
        return _laid_out(make())
    key = _key(stage, inputs)
    if (content := find(key)) is not None:
        with suppress(Exception):  # reading what somebody else put there raises anything at all
            found: T = _read(content)
            return found
    result = make()
    arrays: list[Any] = []
    tree = _packed(result, arrays)
    keep(key, _written(tree, arrays))
    made: T = _unpacked(tree, arrays)
    return made


def _laid_out(result: T) -> T:
    arrays: list[Any] = []
    made: T = _unpacked(_packed(result, arrays), arrays)
    return made


def _key(stage: str, inputs: object) -> str:
    arrays: list[Any] = []
    tree = _packed(inputs, arrays)
    key = hashlib.sha256(msgspec.msgpack.encode([_made_by(), stage, tree, _shapes(arrays)]))
    for array in arrays:
        key.update(_bytes(array))
    return key.hexdigest()


@cache
def _made_by() -> list[Any]:
    """What computes: this package's files, all others by name and version, and the machine, whose sums may differ."""
    folders = [Path(entry) for entry in dict.fromkeys(sys.path) if Path(entry).is_dir()]
    installed = sorted(path.name for folder in folders for path in folder.glob("*-info"))
    return [content(), installed, sys.version, platform.machine(), platform.node()]


def _packed(value: Any, arrays: list[Any]) -> Any:
    """Return a value as a tree of what msgpack knows; its arrays, in C's order or Fortran's, are added to `arrays`."""
    kind: Any = type(value)
    if value is None or kind in (bool, int, float, str, bytes):
        return value
    if isinstance(value, np.ndarray):
        if value.dtype.hasobject:
            raise TypeError("an array of objects cannot be kept")
        arrays.append(value if value.flags.forc else value.copy(order="C"))
        return ["array", len(arrays) - 1]
    if isinstance(value, np.generic):
        return ["number", *_packed(np.asarray(value), arrays)]
    if isinstance(value, Path):
        return ["path", str(value)]
    if kind.__name__ in _CONTAINERS and kind.__module__ == "builtins":
        ordered = sorted(value) if kind in (set, frozenset) else value
        return [kind.__name__, *(_packed(one, arrays) for one in ordered)]
    if kind is dict:
        return ["dict", *(_packed(one, arrays) for pair in value.items() for one in pair)]
    values = [_packed(getattr(value, name), arrays) for name in _fields(kind)]
    return ["record", kind.__module__, kind.__qualname__, *values]


def _unpacked(tree: Any, arrays: Sequence[Any]) -> Any:
    if not isinstance(tree, list):
        return tree
    kind, *rest = tree
    if kind == "array":
        return arrays[rest[0]]
    if kind == "number":
        return arrays[rest[1]][()]
    if kind == "path":
        return Path(rest[0])
    if kind == "record":
        record = _record(rest[0], rest[1])
        return record(**dict(zip(_fields(record), (_unpacked(one, arrays) for one in rest[2:]), strict=True)))
    values = [_unpacked(one, arrays) for one in rest]
    return dict(zip(values[::2], values[1::2], strict=True)) if kind == "dict" else _CONTAINERS[kind](values)


def _record(module: str, name: str) -> Any:
    """A record of this package by its name: an entry of a cache calls nothing else."""
    if not module.startswith(f"{kbs_process.__name__}."):
        raise TypeError(f"{module}.{name} is no record of this package")
    found: Any = import_module(module)
    for part in name.split("."):
        found = getattr(found, part)
    _fields(found)
    return found


@cache
def _fields(record: Hashable) -> tuple[str, ...]:
    """Names of the fields of a record: a dataclass, a struct or a named tuple."""
    if not isinstance(record, type) or not record.__module__.startswith(f"{kbs_process.__name__}."):
        raise TypeError(f"{record} cannot be kept")
    if dataclasses.is_dataclass(record):
        return tuple(field.name for field in dataclasses.fields(record))
    if issubclass(record, msgspec.Struct):
        return record.__struct_fields__
    names: tuple[str, ...] | None = getattr(record, "_fields", None)
    if names is None:
        raise TypeError(f"{record} cannot be kept")
    return names


def _shapes(arrays: Sequence[Any]) -> list[Any]:
    return [[array.dtype.str, array.shape, array.flags.c_contiguous] for array in arrays]


def _bytes(array: Any) -> memoryview:
    """The bytes of an array as they lie in memory."""
    return memoryview(array.ravel(order="K").view(np.uint8))


def _written(tree: Any, arrays: Sequence[Any]) -> list[memoryview]:
    """What is kept: the length of the tree, the tree, the arrays, each aligned."""
    head = msgspec.msgpack.encode([tree, _shapes(arrays)])
    parts = [memoryview(len(head).to_bytes(8, "little") + head)]
    at = len(parts[0])
    for array in arrays:
        parts += memoryview(bytes(-at % _ALIGNED)), _bytes(array)
        at += len(parts[-2]) + len(parts[-1])
    return parts


def _read(content: memoryview) -> Any:
    at = 8 + int.from_bytes(content[:8], "little")
    tree, shapes = msgspec.msgpack.decode(content[8:at])
    arrays = []
    for code, shape, by_rows in shapes:
        at += -at % _ALIGNED
        dtype = np.dtype(code)
        size = dtype.itemsize * int(np.prod(shape, dtype=np.int64))
        flat = np.frombuffer(content[at : at + size], dtype=dtype)
        # A copy: an array alone does not hold all the others, and lies where numpy puts it.
        arrays.append(flat.copy().reshape(shape, order="C" if by_rows else "F"))
        at += size
    return _unpacked(tree, arrays)
