"""Protobuf messages: the descriptors in a schema, and layouts of payloads.

Wire format: fields in any order, each a tag (number and wire type) and its content; proto3 leaves out
numbers that are zero. So the tags are part of the layout, guarded like every length and varint.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import count

from kbs_process.recordings.mcap.framing import MalformedError
from kbs_process.recordings.mcap.kernels import FLOAT32, FLOAT64, LITTLE, SIGNED, UNSIGNED, VARINT, ZIGZAG
from kbs_process.recordings.mcap.messages.fields import Elements, Field, Step, find_stamp, sibling
from kbs_process.recordings.mcap.messages.layout import LACKING, LEFT_OUT, Cell, Guards, Layout, LayoutDecoder, layout

WIRE_VARINT, WIRE_64, WIRE_BYTES, WIRE_32 = 0, 1, 2, 5
FIXED_SIZE = {WIRE_64: 8, WIRE_32: 4}
REPEATED = 3
STRING, MESSAGE = 9, 11
KINDS = {  # descriptor.proto, FieldDescriptorProto.Type -> kind of cell, wire type
    1: (FLOAT64, WIRE_64),
    2: (FLOAT32, WIRE_32),
    3: (SIGNED, WIRE_VARINT),
    4: (UNSIGNED, WIRE_VARINT),
    5: (SIGNED, WIRE_VARINT),  # a negative int32 is ten bytes long
    6: (UNSIGNED, WIRE_64),
    7: (UNSIGNED, WIRE_32),
    8: (UNSIGNED, WIRE_VARINT),
    13: (UNSIGNED, WIRE_VARINT),
    14: (SIGNED, WIRE_VARINT),
    15: (SIGNED, WIRE_32),
    16: (SIGNED, WIRE_64),
    17: (ZIGZAG, WIRE_VARINT),
    18: (ZIGZAG, WIRE_VARINT),
}
DEPTH = 16  # of messages within messages
LARGEST_EXTENT = 10_000  # numbers and messages of one message


@dataclass(frozen=True, slots=True)
class Member:
    """A field of a descriptor."""

    name: str
    type: int
    message: str  # full name of its message type, where it is one
    repeated: bool


Descriptors = dict[str, dict[int, Member]]


@dataclass(frozen=True, slots=True)
class Item:
    """A field on the wire: its number, wire type, and where tag and content lie."""

    number: int
    wire: int
    tag: int
    at: int
    end: int


def items(payload: bytes, start: int, end: int) -> Iterator[Item]:
    """Yield the fields in payload[start:end]; lengths of bytes lie between tag and content."""
    at = start
    while at < end:
        tag = at
        key, at = _varint(payload, at, end)
        wire = key & 7
        if wire == WIRE_VARINT:
            _, stop = _varint(payload, at, end)
        elif wire == WIRE_BYTES:
            length, at = _varint(payload, at, end)
            stop = at + length
        elif wire in FIXED_SIZE:
            stop = at + FIXED_SIZE[wire]
        else:
            raise MalformedError(f"wire type {wire}")
        if stop > end:
            raise MalformedError(f"a field ends {stop - end} bytes behind its message")
        yield Item(key >> 3, wire, tag, at, stop)
        at = stop


def _varint(payload: bytes, at: int, end: int) -> tuple[int, int]:
    value = 0
    for i, byte in enumerate(payload[at : min(end, at + 10)]):
        value |= (byte & 0x7F) << (7 * i)
        if byte < 0x80:
            return value, at + i + 1
    raise MalformedError("a varint without an end")


def parse_descriptors(data: bytes) -> Descriptors:
    """Return the messages of a serialised FileDescriptorSet by their full names (descriptor.proto)."""
    found: Descriptors = {}
    for file in _children(data, 1):
        package = next((text.decode() for text in _children(file, 2)), "")
        for message in _children(file, 4):
            _add_message(found, f"{package}." if package else "", message, 0)
    return found


def _children(data: bytes, number: int) -> list[bytes]:
    return [data[i.at : i.end] for i in items(data, 0, len(data)) if (i.number, i.wire) == (number, WIRE_BYTES)]


def _add_message(found: Descriptors, prefix: str, data: bytes, depth: int) -> None:
    if depth > DEPTH:
        raise MalformedError("messages defined too deeply within messages")
    name = prefix + next((text.decode() for text in _children(data, 1)), "")
    found[name] = {}
    for field in _children(data, 2):
        numbers = {i.number: _varint(field, i.at, i.end)[0] for i in items(field, 0, len(field)) if i.wire == 0}
        texts = {i.number: field[i.at : i.end].decode() for i in items(field, 0, len(field)) if i.number in (1, 6)}
        found[name][numbers.get(3, 0)] = Member(
            texts.get(1, ""), numbers.get(5, 0), texts.get(6, "").lstrip("."), numbers.get(4) == REPEATED
        )
    for nested in _children(data, 3):
        _add_message(found, f"{name}.", nested, depth + 1)


def fields_of(root: str, descriptors: Descriptors) -> tuple[Field, ...]:
    """Return every number of the message, repeated ones as one field each."""
    found: list[Field] = []
    visits = count()

    def visit(name: str, prefix: str, depth: int) -> None:
        if depth > DEPTH or next(visits) + len(found) > LARGEST_EXTENT:
            raise MalformedError(f"{root} contains itself, or too much")
        members = descriptors.get(name)
        if members is None:
            raise MalformedError(f"the descriptor of {name} is missing")
        names = any(m.name == "name" and m.type == STRING and m.repeated for m in members.values())
        for member in members.values():
            if member.type in KINDS:
                size = -1 if member.repeated else None
                found.append(Field(prefix + member.name, size, names and member.repeated))
            elif member.type == MESSAGE and not member.repeated:
                visit(member.message, f"{prefix}{member.name}.", depth + 1)

    visit(root, "", 0)
    return tuple(found)


class ProtobufMessage:
    """A protobuf message type."""

    def __init__(self, name: str, data: bytes) -> None:
        self._root, self._descriptors = name, parse_descriptors(data)
        self.fields = fields_of(name, self._descriptors)

    def decoder(self, steps: tuple[Step, ...]) -> LayoutDecoder:
        """Return a decoder of the numbers at `steps`."""
        stamp = find_stamp(self.fields)
        wanted = _ancestry([*(step.path for step in steps), *stamp])

        def trace(payload: bytes) -> Layout:
            walk = self._walk(payload, wanted)
            cells = [walk.cell(step) for step in steps]
            return layout(payload, walk.guards, [walk.scalar(path) for path in stamp], cells)

        return LayoutDecoder(trace, len(steps))

    def elements(self, payload: bytes, path: str) -> Elements:
        """Return the names and the length of the sequence at `path` in one message."""
        walk = self._walk(payload, _ancestry([path]))
        names = tuple(name.decode(errors="replace") for name in walk.names.get(sibling(path), []))
        return Elements(names, len(walk.sequences.get(path, [])))

    def _walk(self, payload: bytes, wanted: frozenset[str]) -> _Walk:
        walk = _Walk(payload, self._descriptors, wanted)
        walk.message(self._root, "", 0, len(payload))
        return walk


def _ancestry(paths: list[str]) -> frozenset[str]:
    """Return the paths, the names that go with them, and everything that they lie in."""
    parts = [path.split(".") for path in (*paths, *map(sibling, paths))]
    return frozenset(".".join(part[:i]) for part in parts for i in range(1, len(part) + 1))


class _Walk:
    """One pass over one payload."""

    def __init__(self, payload: bytes, descriptors: Descriptors, wanted: frozenset[str]) -> None:
        self.payload = payload
        self.descriptors = descriptors
        self.wanted = wanted
        self.guards = Guards(payload)
        self.scalars: dict[str, Cell] = {}
        self.sequences: dict[str, list[Cell]] = {}
        self.names: dict[str, list[bytes]] = {}

    def cell(self, step: Step) -> Cell:
        if step.key is None:
            return self.scalar(step.path)
        index = step.key
        if isinstance(index, str):
            names = self.names.get(sibling(step.path), [])
            if index.encode() not in names:
                return LACKING
            index = names.index(index.encode())
        sequence = self.sequences.get(step.path, [])
        return sequence[index] if index < len(sequence) else LACKING

    def scalar(self, path: str) -> Cell:
        return self.scalars.get(path, LEFT_OUT)

    def message(self, name: str, prefix: str, start: int, end: int) -> None:
        members = self.descriptors[name]
        for item in items(self.payload, start, end):
            # Tag and length alike; of a varint only where it ends.
            self.guards.add(item.tag, item.at - item.tag)
            if item.wire == WIRE_VARINT:
                self.guards.add(item.at, item.end - item.at, 0x80)
            member = members.get(item.number)
            path = "" if member is None else f"{prefix}{member.name}"
            if member is None or path not in self.wanted:
                continue
            if member.type == MESSAGE and item.wire == WIRE_BYTES:
                self.message(member.message, f"{path}.", item.at, item.end)
            elif member.type == STRING and member.repeated and item.wire == WIRE_BYTES:
                self.guards.add(item.at, item.end - item.at)
                self.names.setdefault(path, []).append(self.payload[item.at : item.end])
            elif member.type in KINDS:
                self.number(member, path, item)

    def number(self, member: Member, path: str, item: Item) -> None:
        kind, wire = KINDS[member.type]
        if member.repeated and item.wire == WIRE_BYTES:
            self.sequences.setdefault(path, []).extend(self.packed(kind, wire, item))
        elif item.wire != wire:
            raise MalformedError(f"{path} has wire type {item.wire}")
        elif member.repeated:
            self.sequences.setdefault(path, []).append(_cell(kind, wire, item.at, item.end))
        else:
            self.scalars[path] = _cell(kind, wire, item.at, item.end)

    def packed(self, kind: int, wire: int, item: Item) -> list[Cell]:
        cells, at = [], item.at
        while at < item.end:
            if wire == WIRE_VARINT:
                _, end = _varint(self.payload, at, item.end)
                self.guards.add(at, end - at, 0x80)
            else:
                end = at + FIXED_SIZE[wire]
            if end > item.end:
                raise MalformedError("packed numbers that do not fill their field")
            cells.append(_cell(kind, wire, at, end))
            at = end
        return cells


def _cell(kind: int, wire: int, at: int, end: int) -> Cell:
    return Cell(at, end - at, VARINT if wire == WIRE_VARINT else LITTLE, kind)
