"""Documents that are run: the files they hold, their commands, and the output they show."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?(?![\w.]*\w)")
TOLERANCE = 0.05  # of a number that is shown: the same to a reader, and on every machine
_BLOCK = re.compile(r"(?:<!-- file: (?P<file>\S+) -->\n)?```(?P<language>\w+)\n(?P<body>.*?)```", re.DOTALL)


@dataclass(frozen=True, slots=True)
class File:
    """A file that the reader is asked to write."""

    path: str
    text: str


@dataclass(frozen=True, slots=True)
class Command:
    """A command that the reader is asked to type, and what is shown below it."""

    line: str
    shown: str


def steps(document: Path) -> Iterator[File | Command]:
    """Yield files and commands in the order in which they stand."""
    for block in _BLOCK.finditer(document.read_text(encoding="utf-8")):
        if block["file"]:
            yield File(block["file"], block["body"])
        elif block["language"] == "console":
            for part in re.split(r"^\$ ", block["body"], flags=re.MULTILINE)[1:]:
                line, _, shown = part.partition("\n")
                yield Command(line, shown)


def agrees(shown: str, actual: str) -> bool:
    """Is the output as shown? "..." stands for anything, numbers are within TOLERANCE, words are the same."""
    pattern, numbers = "", []
    for part in re.split(rf"(\.\.\.|{NUMBER.pattern})", _squeezed(shown)):
        if part == "...":
            pattern += ".*?"
        elif NUMBER.fullmatch(part):
            pattern += f"({NUMBER.pattern})"
            numbers.append(float(part))
        else:
            pattern += re.escape(part)
    found = re.fullmatch(pattern, _squeezed(actual), flags=re.DOTALL)
    return found is not None and all(
        abs(float(value) - number) <= TOLERANCE * abs(number)
        for value, number in zip(found.groups(), numbers, strict=True)
    )


def _squeezed(text: str) -> str:
    """Columns are as wide as their widest number: runs of blanks are one."""
    return re.sub(r"[ \t]+", " ", text).strip()
