"""ROS 2 messages: the text of a `ros2msg` schema, and layouts of CDR payloads.

CDR (OMG CORBA 3.0, section 15.3; classic encapsulation of DDS-RTPS, section 10.2): four bytes of
encapsulation that name the byte order, then the fields in order, each number aligned to its own size,
counted from behind the encapsulation; strings and sequences begin with a 32-bit length.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from kbs_process.recordings.mcap.framing import MalformedError
from kbs_process.recordings.mcap.kernels import BIG, FLOAT32, FLOAT64, LITTLE, SIGNED, UNSIGNED
from kbs_process.recordings.mcap.messages.fields import Elements, Field, Key, Step, find_stamp, sibling
from kbs_process.recordings.mcap.messages.layout import LACKING, Cell, Guards, Layout, LayoutDecoder, layout

PRIMITIVES = {  # type -> kind of cell, bytes
    "bool": (UNSIGNED, 1),
    "byte": (UNSIGNED, 1),
    "char": (UNSIGNED, 1),
    "int8": (SIGNED, 1),
    "uint8": (UNSIGNED, 1),
    "int16": (SIGNED, 2),
    "uint16": (UNSIGNED, 2),
    "int32": (SIGNED, 4),
    "uint32": (UNSIGNED, 4),
    "int64": (SIGNED, 8),
    "uint64": (UNSIGNED, 8),
    "float32": (FLOAT32, 4),
    "float64": (FLOAT64, 8),
}
HEADER = "std_msgs/Header"
BUILTIN = {
    "builtin_interfaces/Time": "int32 sec\nuint32 nanosec",
    "builtin_interfaces/Duration": "int32 sec\nuint32 nanosec",
    HEADER: "builtin_interfaces/Time stamp\nstring frame_id",
}
ZSTD = b"\x28\xb5\x2f\xfd"  # how its frames begin
SEPARATOR = re.compile(r"^=+\s*$", re.MULTILINE)
FIELD = re.compile(
    r"(?P<base>[\w/]+)(?:<=\d+)?(?P<array>\[(?:(?P<bound><=)?(?P<size>\d*))\])?\s+(?P<name>\w+)(?P<rest>\s*=.*|\s+.*)?"
)
LARGEST_EXTENT = 10_000  # scalars of one message; sequences count once
PADDING = 7  # bytes behind a message's last field
DEPTH = 64  # of messages within messages


@dataclass(frozen=True, slots=True)
class Member:
    """A field of a definition; `count` is None for a scalar, -1 for a sequence, else an array's size."""

    name: str
    base: str
    count: int | None


Definitions = dict[str, tuple[Member, ...]]


def parse_schema(name: str, text: str) -> tuple[str, Definitions]:
    """Return the message's full name and the members of it and of all messages that it depends on."""
    root = _short(name)
    blocks = {root: ""} | BUILTIN
    first, *others = SEPARATOR.split(text)
    blocks[root] = first
    for block in others:
        head, _, body = block.strip().partition("\n")
        if not head.startswith("MSG:"):
            raise MalformedError(f"a definition that begins with {head[:40]!r} instead of 'MSG: '")
        blocks[_short(head[4:].strip())] = body
    definitions = {key: _members(body, key.partition("/")[0], blocks) for key, body in blocks.items()}
    for key, body in BUILTIN.items():  # or a stamp would be read as something else, unsaid
        if definitions[key] != _members(body, "", BUILTIN):
            raise MalformedError(f"{key} is not as ROS 2 defines it")
    _extent(definitions, root, {})
    return root, definitions


def _short(name: str) -> str:
    """Return package/Name for package/msg/Name."""
    parts = name.split("/")
    return f"{parts[0]}/{parts[-1]}" if len(parts) > 1 else name


def _members(body: str, package: str, blocks: dict[str, str]) -> tuple[Member, ...]:
    members = []
    for line in body.splitlines():
        line = line.split("#", 1)[0].strip()
        if not line:
            continue
        match = FIELD.fullmatch(line)
        if match is None:
            raise MalformedError(f"the definition's line {line!r} cannot be read")
        if (match["rest"] or "").lstrip().startswith("="):
            continue  # a constant
        base = match["base"]
        if base not in PRIMITIVES and base not in ("string", "wstring"):
            choices = (_short(base), f"{package}/{base}", f"std_msgs/{base}")
            base = next((choice for choice in choices if choice in blocks), "")
            if not base:
                raise MalformedError(f"the definition of {match['base']} is missing")
        size = match["size"] or ""
        count = None if not match["array"] else -1 if match["bound"] or not size else int(size[-19:])
        # Elements take a byte at least, so that a payload's size bounds how often one loops over them.
        if count == 0 or len(size) > 19:
            raise MalformedError(f"an array of {size[:19]}{'...' * (len(size) > 19)} elements")
        members.append(Member(match["name"], base, count))
    return tuple(members)


def _extent(definitions: Definitions, name: str, known: dict[str, int], depth: int = 0) -> int:
    """Return how many scalars a message nests; 0 in `known` marks a message whose count is under way."""
    if name not in known and depth < DEPTH:
        known[name] = 0
        inner = [m.base for m in definitions[name] if m.base in definitions]
        known[name] = 1 + len(definitions[name]) + sum(_extent(definitions, m, known, depth + 1) for m in inner)
    if not 0 < known.get(name, 0) <= LARGEST_EXTENT:
        raise MalformedError(f"{name} contains itself, or too much")
    return known[name]


def fields_of(root: str, definitions: Definitions) -> tuple[Field, ...]:
    """Return every number of the message, sequences and arrays as one field each."""
    found: list[Field] = []

    def visit(name: str, prefix: str) -> None:
        names = any(m.name == "name" and m.base == "string" and m.count == -1 for m in definitions[name])
        for member in definitions[name]:
            path = f"{prefix}{member.name}"
            if member.base in PRIMITIVES:
                found.append(Field(path, member.count, named=names and member.count == -1))
            elif member.base in definitions and member.count is None:
                visit(member.base, f"{path}.")

    visit(root, "")
    return tuple(found)


class Ros2Message:
    """A ROS 2 message type."""

    def __init__(self, name: str, text: str) -> None:
        self._root, self._definitions = parse_schema(name, text)
        self.fields = fields_of(self._root, self._definitions)

    def decoder(self, steps: tuple[Step, ...]) -> LayoutDecoder:
        """Return a decoder of the numbers at `steps`."""
        headers = (
            member.name for member in self._definitions[self._root] if (member.base, member.count) == (HEADER, None)
        )
        stamp = find_stamp(self.fields, *(f"{name}.stamp" for name in headers))

        def trace(payload: bytes) -> Layout:
            walk = self._walk(payload)
            cells = [walk.cell(step) for step in steps]
            return layout(payload, walk.guards, [walk.scalars[path] for path in stamp], cells)

        return LayoutDecoder(trace, len(steps))

    def elements(self, payload: bytes, path: str) -> Elements:
        """Return the names and the length of the sequence at `path` in one message."""
        walk = self._walk(payload)
        names = walk.strings.get(sibling(path), [])
        texts = [payload[at : at + length].rstrip(b"\0").decode(errors="replace") for at, length in names]
        return Elements(tuple(texts), walk.sequences[path][1])

    def _walk(self, payload: bytes) -> _Walk:
        walk = _Walk(payload, self._definitions)
        walk.message(self._root, "")
        if (more := len(payload) - walk.at) > PADDING:
            raise MalformedError(f"the payload goes on for {more} bytes that its schema does not have")
        return walk


class _Walk:
    """One pass over one payload."""

    def __init__(self, payload: bytes, definitions: Definitions) -> None:
        if payload.startswith(ZSTD):
            raise MalformedError("compressed one by one, as by rosbag2's --compression-mode message: use file, or none")
        if len(payload) < 4 or payload[0] != 0 or payload[1] not in (0, 1):
            raise MalformedError("no plain CDR" + (" but XCDR2 or a parameter list" if payload[:1] == b"\0" else ""))
        self.form = LITTLE if payload[1] else BIG
        self.payload = payload
        self.definitions = definitions
        self.guards = Guards(payload)
        self.guards.add(0, 2)
        self.at = 4
        self.scalars: dict[str, Cell] = {}
        self.sequences: dict[str, tuple[Cell, int]] = {}  # path -> first element, count
        self.strings: dict[str, list[tuple[int, int]]] = {}  # path -> first byte and length of each

    def cell(self, step: Step) -> Cell:
        if step.key is None:
            return self.scalars[step.path]
        first, count = self.sequences[step.path]
        index = self.index(step.path, step.key)
        if index is None or index >= count:
            return LACKING
        return first._replace(at=first.at + index * first.size)

    def index(self, path: str, key: Key) -> int | None:
        """Return the place of `key` in the sequence `path`; names are looked up in its sibling `name`."""
        if isinstance(key, int):
            return key
        names = self.strings.get(sibling(path), [])
        result = None
        for i, (at, length) in enumerate(names):
            # All of them decide, as an earlier message's order need not hold for the next.
            self.guards.add(at, length)
            if result is None and self.payload[at : at + length].rstrip(b"\0") == key.encode():
                result = i
        return result

    def message(self, name: str, prefix: str) -> None:
        members = self.definitions[name]
        if not members:
            self.skip(1)  # ROS gives an empty message one byte
        for member in members:
            path = f"{prefix}{member.name}"
            count = self.length() if member.count == -1 else member.count
            if member.base in PRIMITIVES:
                self.numbers(path, member.base, count)
            elif member.base in self.definitions:
                for _ in range(1 if count is None else count):
                    self.message(member.base, f"{path}." if count is None else f"{path}[].")
            else:
                self.texts(path, member.base, 1 if count is None else count)

    def skip(self, size: int) -> int:
        if size > len(self.payload) - self.at:
            raise MalformedError(f"the payload ends {size - len(self.payload) + self.at} bytes too early")
        self.at += size
        return self.at - size

    def align(self, size: int) -> None:
        self.at += -(self.at - 4) % size

    def length(self) -> int:
        self.align(4)
        at = self.skip(4)
        self.guards.add(at, 4)
        return int.from_bytes(self.payload[at : at + 4], "little" if self.form == LITTLE else "big")

    def numbers(self, path: str, base: str, count: int | None) -> None:
        kind, size = PRIMITIVES[base]
        if count != 0:  # an empty sequence is not aligned for its elements
            self.align(size)
        at = self.skip(size * (1 if count is None else count))
        cell = Cell(at, size, self.form, kind)
        if count is None:
            self.scalars[path] = cell
        else:
            self.sequences[path] = (cell, count)

    def texts(self, path: str, base: str, count: int) -> None:
        if base == "wstring":
            raise MalformedError("wide strings are not supported")
        places = []
        for _ in range(count):
            length = self.length()
            places.append((self.skip(length), length))
        self.strings[path] = places
