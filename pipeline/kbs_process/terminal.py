"""What may be written to a terminal, or into a line: names and texts from files could hold commands, and line ends."""

from __future__ import annotations

import unicodedata


def printable(text: str) -> str:
    """Return the text as one line: control characters, and those that turn a line's direction, as escapes."""
    return "".join(_shown(character) for character in text)


def _shown(character: str) -> str:
    if unicodedata.category(character) not in ("Cc", "Cf", "Cs", "Zl", "Zp"):
        return character
    return character.encode("unicode_escape").decode("ascii")
