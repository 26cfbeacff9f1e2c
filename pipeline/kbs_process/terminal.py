"""What may be written to a terminal: names and texts from files could hold commands to it."""

from __future__ import annotations

import unicodedata


def printable(text: str) -> str:
    """Return the text with control characters (save line ends), and those that turn a line's direction, as escapes."""
    return "".join(_shown(character) for character in text)


def _shown(character: str) -> str:
    if character == "\n" or unicodedata.category(character) not in ("Cc", "Cf", "Zl", "Zp"):
        return character
    return character.encode("unicode_escape").decode("ascii")
