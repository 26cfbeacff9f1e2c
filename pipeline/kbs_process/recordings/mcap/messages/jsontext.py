"""JSON messages: typed decoding of the numbers wanted, and nothing else, by msgspec.

msgspec rounds every number correctly, so a float64 written in its shortest form is read back bit by bit.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import chain
from operator import attrgetter
from typing import Annotated, Any

import msgspec
import numpy as np

from kbs_process.recordings.mcap.kernels import MOST_SECONDS, NO_STAMP, Bytes, Words
from kbs_process.recordings.mcap.messages.fields import Elements, Field, Key, Step, find_stamp, sibling
from kbs_process.recordings.mcap.messages.layout import Decoded
from kbs_process.signals.records import Array, Mask, Stamps

DEPTH = 16  # of objects within objects
SECONDS = Annotated[int, msgspec.Meta(ge=-(2**63), le=2**63 - 1)]  # a part of a stamp


class JsonMessage:
    """Messages that carry no binding schema: their numbers are learnt from the first of them."""

    def __init__(self, samples: Iterable[bytes]) -> None:
        found: dict[str, Field] = {}
        for sample in samples:
            _visit(_plain(sample), "", False, DEPTH, found)
        # What is a number or null in some messages is none where others have an object there, or names.
        objects = {outer for path in found for outer in _outer(path)}
        names = {sibling(field.path) for field in found.values() if field.named}
        self.fields = tuple(
            field for path, field in found.items() if path not in objects and names.isdisjoint([path, *_outer(path)])
        )

    def decoder(self, steps: tuple[Step, ...]) -> JsonDecoder:
        """Return a decoder of the numbers at `steps`."""
        return JsonDecoder(steps, find_stamp(self.fields))

    def elements(self, payload: bytes, path: str) -> Elements:
        """Return the names and the length of the sequence at `path` in one message."""
        node: Any = _plain(payload)
        *outer, last = path.split(".")
        for key in outer:
            node = node.get(key) if isinstance(node, dict) else None
        if not isinstance(node, dict) or not isinstance(node.get(last), list):
            return Elements((), 0)
        return Elements(_names(node), len(node[last]))


def _plain(payload: bytes) -> object:
    try:
        return msgspec.json.decode(payload)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError):
        return None


def _outer(path: str) -> list[str]:
    """Return the paths of the objects that a path lies in."""
    parts = path.split(".")
    return [".".join(parts[:count]) for count in range(1, len(parts))]


def _names(node: dict[str, Any]) -> tuple[str, ...]:
    """Return the names that an object gives to the elements of its lists, none where it has no such list."""
    names = node.get("name")
    return tuple(names) if isinstance(names, list) and all(isinstance(name, str) for name in names) else ()


def _visit(node: object, path: str, named: bool, depth: int, found: dict[str, Field]) -> None:
    if isinstance(node, dict) and depth:
        named = bool(_names(node))
        for key, value in node.items():
            if key.isidentifier():
                _visit(value, f"{path}.{key}" if path else key, named, depth - 1, found)
    elif not path:
        return
    elif isinstance(node, list) and all(map(_number, node)):
        found.setdefault(path, Field(path, -1, named))
    elif _number(node):
        found.setdefault(path, Field(path))


def _number(node: object) -> bool:
    """Whether a node is a number, or one that is missing; true and false are none."""
    return node is None or (isinstance(node, int | float) and not isinstance(node, bool))


class JsonDecoder:
    """Decodes the numbers at `steps` and the stamp of each message."""

    def __init__(self, steps: Sequence[Step], stamp: tuple[str, ...]) -> None:
        self._steps = tuple(steps)
        scalars = [step.path for step in steps if step.key is None]
        lists = {step.path for step in steps if step.key is not None}
        named = {sibling(step.path) for step in steps if isinstance(step.key, str)}
        types: dict[str, Any] = dict.fromkeys(scalars, float | None)
        types |= dict.fromkeys(lists, list[float | None]) | dict.fromkeys(named, list[str])
        types |= dict.fromkeys(stamp, SECONDS)
        self._decode = msgspec.json.Decoder(_struct(types)).decode
        self._scalars = [i for i, step in enumerate(steps) if step.key is None]
        self._lists = [i for i, step in enumerate(steps) if step.key is not None]
        # Two paths or more, so that attrgetter returns a tuple.
        self._get_scalars = attrgetter(*map(_attribute, (*scalars, *scalars[:1]))) if scalars else None
        self._get_stamp = attrgetter(*map(_attribute, stamp)) if stamp else None
        self._get_list = {path: attrgetter(_attribute(path)) for path in lists | named}

    def __call__(self, buffer: Bytes, at: Words, size: Words, log: Stamps) -> Decoded:
        n, c = len(at), len(self._steps)
        stamp, values = log.copy(), np.full((n, c), np.nan)
        good = np.ones(n, dtype=np.bool_)
        view = memoryview(buffer)  # type: ignore[arg-type]
        ends = at + size
        messages = []
        decode = self._decode
        for i, (first, last) in enumerate(zip(at.tolist(), ends.tolist(), strict=True)):
            try:
                messages.append(decode(view[first:last]))
            except (msgspec.DecodeError, UnicodeDecodeError, RecursionError):
                good[i] = False
        missing: Mask = np.zeros(values.shape, dtype=np.bool_)
        present: Mask = np.zeros(c, dtype=np.bool_)
        if messages:
            if self._get_stamp is not None:
                stamp[good] = self._stamps(messages)
            decoded = np.full((len(messages), c), np.nan)
            absent = np.zeros(decoded.shape, dtype=np.bool_)
            self._read_scalars(messages, decoded, absent)
            self._read_lists(messages, decoded, absent)
            values[good], missing[good] = decoded, absent
            present |= ~absent.all(axis=0)
        lacking: Mask = np.logical_or.reduce(missing, axis=1)
        flawless = bool(good.all() and not lacking.any() and np.isfinite(values).all())
        return Decoded(stamp, values, good, present, lacking, flawless, "" if good.all() else "no such JSON object")

    def _stamps(self, messages: list[Any]) -> Stamps:
        assert self._get_stamp is not None
        flat = chain.from_iterable(map(self._get_stamp, messages))
        parts = np.fromiter(flat, dtype=np.int64, count=2 * len(messages)).reshape(-1, 2)
        seconds, nanoseconds = parts.T
        known = (
            (seconds >= -MOST_SECONDS) & (seconds <= MOST_SECONDS) & (nanoseconds >= 0) & (nanoseconds < 1_000_000_000)
        )
        return np.where(known, seconds * 1_000_000_000 + nanoseconds, NO_STAMP)

    def _read_scalars(self, messages: list[Any], values: Array, absent: Mask) -> None:
        if self._get_scalars is None:
            return
        width = len(self._scalars)
        flat = list(chain.from_iterable(map(self._get_scalars, messages)))
        table = np.array(flat, dtype=np.float64).reshape(len(messages), width + 1)  # None becomes NaN
        values[:, self._scalars] = table[:, :width]
        gone = np.fromiter((item is None for item in flat), np.bool_, len(flat)) if None in flat else None
        if gone is not None:
            absent[:, self._scalars] = gone.reshape(table.shape)[:, :width]

    def _read_lists(self, messages: list[Any], values: Array, absent: Mask) -> None:
        for path in dict.fromkeys(self._steps[column].path for column in self._lists):
            columns = [column for column in self._lists if self._steps[column].path == path]
            rows = list(map(self._get_list[path], messages))
            get_names = self._get_list.get(sibling(path))
            names = [()] * len(rows) if get_names is None else list(map(get_names, messages))
            flat = list(chain.from_iterable(rows))
            width = len(rows[0])
            if None not in flat and set(map(len, rows)) == {width} and names.count(names[0]) == len(names):
                # The usual case: all messages are alike, and one look at the first tells where everything is.
                table = np.array(flat, dtype=np.float64).reshape(len(rows), width)
                for column in columns:
                    place = _place(self._steps[column].key, names[0])
                    if place is not None and place < width:
                        values[:, column] = table[:, place]
                    else:
                        absent[:, column] = True
                continue
            for column in columns:
                key = self._steps[column].key
                picks = [_pick(row, _place(key, name)) for row, name in zip(rows, names, strict=True)]
                values[:, column] = np.array(picks, dtype=np.float64)
                absent[:, column] = [pick is None for pick in picks]


def _place(key: Key | None, names: Sequence[str]) -> int | None:
    if isinstance(key, str):
        return names.index(key) if key in names else None
    return key


def _pick(row: list[float | None], place: int | None) -> float | None:
    return None if place is None or place >= len(row) else row[place]


def _attribute(path: str) -> str:
    """Return the attribute that holds what is at a path: never a name that means something to Python."""
    return ".".join(f"at_{part}" for part in path.split("."))


def _struct(types: dict[str, Any]) -> Any:
    """Return a msgspec structure with fields at the dotted paths of `types`; only the stamp is required."""
    groups: dict[str, dict[str, Any]] = {}
    members: list[Any] = []
    for path, kind in types.items():
        head, _, rest = path.partition(".")
        if rest:
            groups.setdefault(head, {})[rest] = kind
        elif kind is SECONDS:
            members.append((_attribute(head), kind, msgspec.field(name=head)))
        elif kind == float | None:
            members.append((_attribute(head), kind, msgspec.field(name=head, default=None)))
        else:
            members.append((_attribute(head), kind, msgspec.field(name=head, default_factory=list)))
    for head, inner in groups.items():
        nested = _struct(inner)
        required = any(field.required for field in msgspec.structs.fields(nested))
        default = {} if required else {"default_factory": nested}
        members.append((_attribute(head), nested, msgspec.field(name=head, **default)))
    return msgspec.defstruct("Message", members, gc=False, kw_only=True)
