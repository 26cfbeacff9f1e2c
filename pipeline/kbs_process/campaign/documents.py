"""TOML files as read: their text, their tables, and where in them a key stands."""

from __future__ import annotations

import json
import re
import tomllib
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from kbs_process.campaign.problems import Problems
from kbs_process.errors import ConfigError
from kbs_process.files import regular
from kbs_process.terminal import printable

Tree = dict[str, Any]
Key = tuple[str | int, ...]  # ("recording", 2, "file")

QUESTION = "?"  # stands where a value has still to be put in

# Possessive, so that a line of blanks takes no longer than another.
_HEADER = re.compile(r"^\s*+(\[\[?+)([^\[\]]++)\]\]?+\s*+(?:#.*)?$")
_BARE = re.compile(r"[A-Za-z0-9_-]+")
_ASSIGNMENT = re.compile(r"^\s*+([A-Za-z0-9_.\-\"'](?:[A-Za-z0-9_.\-\"' ]*[A-Za-z0-9_.\-\"'])?)\s*+=")
_AT = re.compile(r"\(at (?:line (\d+), column (\d+)|end of document)\)$")  # where tomllib found a fault


@dataclass(frozen=True, slots=True)
class Document:
    """One TOML file."""

    path: Path
    text: str
    tree: Tree

    def line(self, key: Key) -> int | None:
        """Return the line of a key, or of its nearest ancestor that has one."""
        lines = _lines(self.text)
        return next((lines[key[:depth]] for depth in range(len(key), 0, -1) if key[:depth] in lines), None)

    def place(self, key: Key) -> str:
        """Return "file:line: dotted key"."""
        line = self.line(key)
        file = f"{shown(self.path)}:{line}" if line else shown(self.path)
        return f"{file}: {dotted(key)}" if key else file


def shown(path: Path) -> str:
    """Return the path as a user would type it: relative to the working directory where it is below."""
    path = path.absolute()
    return str(path.relative_to(Path.cwd())) if path.is_relative_to(Path.cwd()) else str(path)


def dotted(key: Key) -> str:
    """Return the key in the notation of the error messages: "recording[2].file", counted from 1."""
    text = ""
    for part in key:
        if isinstance(part, int):
            text += f"[{part + 1}]"
        else:
            text += ("." if text else "") + (part if _BARE.fullmatch(part) else quoted(part))
    return text


def quoted(text: str) -> str:
    """Return a text as TOML writes it: in quotes, on one line, what is not printable as escapes."""
    written = json.dumps(text.encode(errors="replace").decode(), ensure_ascii=False)
    return "".join(sign if printable(sign) == sign else f"\\U{ord(sign):08X}" for sign in written)


def within(folder: Path, name: str, *, where: str) -> Path:
    """Return the path of a file that a campaign names, below its folder `folder`, wherever links lead.

    Raises ConfigError if it lies outside: a description from elsewhere shall not show what else is on a disk.
    """
    path = folder / name
    try:
        inside = path.resolve().is_relative_to(folder.resolve())
    except (OSError, ValueError, RuntimeError):  # no name of a file: who reads it says so
        return path
    if not inside:
        raise ConfigError(
            f"the file '{name}' lies outside the campaign's folder", where=where, remedy="copy it into the folder"
        )
    return path


def read(path: Path, *, role: str, remedy: str) -> Document:
    """Read one TOML file; `role` says what it is for in the message when it is missing."""
    try:
        text = regular(path).read_text(encoding="utf-8").removeprefix("\ufeff")  # as editors of Windows begin a file
    except (FileNotFoundError, NotADirectoryError) as error:
        raise ConfigError(f"{role} does not exist", where=shown(path), remedy=remedy) from error
    except UnicodeDecodeError as error:
        raise ConfigError(
            f"is not UTF-8 text (byte {error.start})", where=shown(path), remedy="save the file as UTF-8"
        ) from error
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else error  # a name with a NUL in it
        raise ConfigError(
            f"{role} cannot be read: {reason}", where=shown(path), remedy=f"{remedy}; check its permissions"
        ) from error
    try:
        document = Document(path, text, tomllib.loads(text))
    except tomllib.TOMLDecodeError as error:
        message, line = _decode_error(str(error), text)
        raise ConfigError(
            f"is not valid TOML: {message}", where=f"{shown(path)}:{line}", remedy="correct this line"
        ) from error
    except (ValueError, RecursionError) as error:  # an integer of more than 4300 digits; brackets upon brackets
        deep = isinstance(error, RecursionError)
        what = "holds arrays in arrays, hundreds deep" if deep else "holds a number of thousands of digits"
        lines = text.splitlines()
        line = max(range(len(lines)), key=lambda number: sum(map(lines[number].count, "[{0123456789")))
        where = f"{shown(path)}:{line + 1}"
        raise ConfigError(what, where=where, remedy="write what the format asks for") from error
    if questions := [_open(document, key) for key in dict.fromkeys(_questions(document.tree))]:
        raise ConfigError(f"{len(questions)} values are still to be put in", where=shown(path), each=questions)
    return document


def _questions(node: Any, key: Key = ()) -> Iterator[Key]:
    """Yield the keys of values that are still to be put in; of a list, its own key."""
    if node == QUESTION:
        yield key[:-1] if isinstance(key[-1], int) else key
    for part, child in node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ():
        yield from _questions(child, (*key, part))


def _open(document: Document, key: Key) -> ConfigError:
    line = document.line(key)
    comment = document.text.splitlines()[line - 1].partition("#")[2].strip() if line else ""
    return ConfigError(f'"{QUESTION}"', where=document.place(key), remedy=comment)


def _decode_error(message: str, text: str) -> tuple[str, int]:
    """Split "Invalid value (at line 3, column 5)" into the message and the line."""
    match = _AT.search(message)
    if match is None:
        return message, 1
    bare = message[: match.start()].rstrip()
    if match.group(1) is None:
        return f"{bare} at the end of the file", text.count("\n") + 1
    return f"{bare} (column {match.group(2)})", int(match.group(1))


@dataclass(frozen=True, slots=True)
class Merged:
    """Several documents as one tree that remembers which file each key comes from."""

    tree: Tree
    documents: tuple[Document, ...]

    def place(self, key: Key) -> str:
        """Return where `key` stands, or, where no file has it, the files and the key."""
        document = max(self.documents, key=lambda document: _depth(document.tree, key))
        if _depth(document.tree, key) == 0:
            return f"{', '.join(shown(document.path) for document in self.documents)}: {dotted(key)}"
        return document.place(key)


def merge(documents: Sequence[Document], problems: Problems) -> Merged:
    """Merge tables key by key; a value given twice is an error that names both places."""
    tree: Tree = {}
    for index, document in enumerate(documents):
        for key in _merge_into(tree, document.tree, ()):
            first = next(other for other in documents[:index] if _depth(other.tree, key) == len(key))
            problems.add(
                document.place(key), f"is given in {first.place(key)} too", "keep one of the two, delete the other"
            )
    return Merged(tree, tuple(documents))


def substituted(tables: Merged, documents: Sequence[Document]) -> Merged:
    """Return `tables` with every value that `documents` give in place of its own; the last one counts."""
    tree = _copied(tables.tree)
    for document in documents:
        _replace_into(tree, document.tree)
    return Merged(tree, (*reversed(documents), *tables.documents))


def _replace_into(tree: Tree, other: Mapping[str, Any]) -> None:
    for name, value in other.items():
        if name in tree and _is_table(tree[name]) and _is_table(value):
            _replace_into(tree[name], value)
        else:
            tree[name] = _copied(value)


def _is_table(value: object) -> bool:
    """Say whether a value is a table whose keys may be spread over files; a quantity is not."""
    return isinstance(value, dict) and "value" not in value


def _merge_into(tree: Tree, other: Mapping[str, Any], key: Key) -> Iterator[Key]:
    for name, value in other.items():
        if name not in tree:
            tree[name] = _copied(value)
        elif _is_table(tree[name]) and _is_table(value):
            yield from _merge_into(tree[name], value, (*key, name))
        else:
            yield (*key, name)


def _copied(value: Any) -> Any:
    return {name: _copied(child) for name, child in value.items()} if isinstance(value, dict) else value


def _depth(node: Any, key: Key) -> int:
    """Return how many leading parts of `key` the tree has."""
    for depth, part in enumerate(key):
        in_table = isinstance(node, dict) and part in node
        in_array = isinstance(node, list) and isinstance(part, int) and part < len(node)
        if not (in_table or in_array):
            return depth
        node = node[part]
    return len(key)


@lru_cache(maxsize=16)
def _lines(text: str) -> dict[Key, int]:
    """Return the first line that spells out each key, in a header or an assignment."""
    found: dict[Key, int] = {}
    table: Key = ()
    counts = Counter[Key]()
    for number, line in enumerate(text.splitlines(), start=1):
        if header := _HEADER.match(line):
            table = _split(header.group(2))
            if header.group(1) == "[[":
                found.setdefault(table, number)
                counts[table] += 1
                table = (*table, counts[table] - 1)
            found.setdefault(table, number)
        elif assignment := _ASSIGNMENT.match(line):
            found.setdefault((*table, *_split(assignment.group(1))), number)
    return found


def _split(name: str) -> Key:
    return tuple(part.strip().strip("\"'") for part in name.split("."))
