"""Sentences and words of a Markdown page, without code, tables, headings and comments."""

from __future__ import annotations

import re

_LEFT_OUT = re.compile(r"```.*?```|<!--.*?-->|!\[[^\]]*\]\([^)]*\)", re.DOTALL)
_LINK = re.compile(r"\[([^\]]*)\]\([^)]*\)")
_CODE = re.compile(r"`[^`]*`")
_ITEM = re.compile(r"^\s*(?:[-*]|\d+\.) ")
_END = re.compile(r"(?<=[.!?])[\"')*]*\s+")


def sentences(text: str) -> list[list[str]]:
    """Return the words of each sentence; a list's item begins one, and a piece of code is one word."""
    found = []
    for paragraph in _paragraphs(_LEFT_OUT.sub("", text)):
        plain = _LINK.sub(r"\1", _CODE.sub("`", paragraph))
        for sentence in _END.split(plain):
            words = [word for word in sentence.split() if re.search(r"[\w`]", word)]
            if words:
                found.append(words)
    return found


def plain(text: str) -> str:
    """Return the words that a reader reads, tables and headings among them, in lower case."""
    return _CODE.sub("`", _LINK.sub(r"\1", _LEFT_OUT.sub("", text))).lower()


def _paragraphs(text: str) -> list[str]:
    """Return paragraphs and items; lines of a table, headings and indented code are none."""
    parts: list[list[str]] = [[]]
    for line in text.splitlines():
        if not line.strip() or line.startswith(("#", "|", "    ")):
            parts.append([])
        elif _ITEM.match(line):
            parts.append([_ITEM.sub("", line)])
        else:
            parts[-1].append(line)
    return [" ".join(part) for part in parts if part]


if __name__ == "__main__":
    import sys
    from pathlib import Path

    for name in sys.argv[1:]:
        lengths = [len(words) for words in sentences(Path(name).read_text(encoding="utf-8"))]
        print(f"{name}: {len(lengths)} sentences, mean {sum(lengths) / len(lengths):.1f}, longest {max(lengths)}")
