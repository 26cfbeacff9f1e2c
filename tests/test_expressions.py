"""No regular expression of the product takes longer on a hostile text than in proportion to its length."""

from __future__ import annotations

import re
import time
from collections.abc import Iterator
from importlib import import_module
from itertools import product
from pathlib import Path
from typing import Any

import pytest

import kbs_process

PACKAGE = Path(kbs_process.__file__).parent
HEADS = ("", "[", "a", "1", "0 1 G ", "$")
REPEATED = (" ", "\t\n", "a", "1", "1.", "1 ", "a ", "a.", "[ ", "=\n", "a'", "1.0 ", "$a", "(at ")
TAILS = ("", "x", "]x", "=x", "$")
LONG_S = 0.1  # for 20,000 characters, a hundred times what is needed


def expressions() -> Iterator[tuple[str, re.Pattern[Any]]]:
    for path in sorted(PACKAGE.rglob("*.py")):
        if "re.compile(" in path.read_text(encoding="utf-8"):
            name = ".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts)
            for key, value in vars(import_module(name)).items():
                if isinstance(value, re.Pattern):
                    yield f"{name}.{key}", value


EXPRESSIONS = dict(expressions())


def too_slow(expression: re.Pattern[Any], length: int) -> str | None:
    """Return the beginning of a text of a length that takes too long to match, None where none does."""
    for head, repeated, tail in product(HEADS, REPEATED, TAILS):
        text: Any = head + repeated * (length // len(repeated)) + tail
        given = text.encode() if isinstance(expression.pattern, bytes) else text
        for use in (expression.match, expression.fullmatch):
            took = [LONG_S + 1.0]
            while len(took) < 4 and min(took) > LONG_S:  # a machine may be busy
                start = time.perf_counter()
                use(given)
                took.append(time.perf_counter() - start)
            if min(took) > LONG_S:
                return str(text[:20])
    return None


def test_there_are_expressions() -> None:
    assert "kbs_process.campaign.documents._HEADER" in EXPRESSIONS


@pytest.mark.parametrize("name", EXPRESSIONS)
def test_time_grows_no_faster_than_the_text(name: str) -> None:
    assert [too_slow(EXPRESSIONS[name], length) for length in (300, 20_000)] == [None, None]


def test_one_that_grows_faster_is_seen() -> None:
    assert too_slow(re.compile(r"(\d+\.?\d*)x"), 8_000) == "1" * 20
