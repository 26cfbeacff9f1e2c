"""Users' pages keep to the glossary, and to short sentences."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from docs.prose import plain, sentences

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = (
    ROOT / "README.md",
    ROOT / "campaigns" / "README.md",
    *sorted(page for page in DOCS.glob("*.md") if page.name not in ("glossary.md", "catalogue.md")),
)
GLOSSARY = (DOCS / "glossary.md").read_text(encoding="utf-8")
MEAN, LONGEST = 18, 40


def avoided() -> list[str]:
    """The words that users' pages do not use, from the glossary's table."""
    table = GLOSSARY.partition("## Words that users' pages do not use")[2].partition("\n## ")[0]
    rows = re.findall(r"^\| ([^|]+) \| [^|]+ \|$", table, flags=re.MULTILINE)
    return [word.lower() for row in rows[2:] for word in row.split(", ")]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_a_users_page_keeps_to_the_glossary(page: Path) -> None:
    text = re.sub(r"\s+", " ", plain(page.read_text(encoding="utf-8")))
    assert [word for word in avoided() if re.search(rf"(?<![\w-]){re.escape(word)}(?![\w-])", text)] == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_sentences_of_a_users_page_are_short(page: Path) -> None:
    found = sentences(page.read_text(encoding="utf-8"))
    assert sum(map(len, found)) / len(found) <= MEAN
    assert [" ".join(words) for words in found if len(words) > LONGEST] == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_users_read_no_names_of_source_files(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    written = set(re.findall(r"<!-- file: (\S+) -->", text))
    named = set(re.findall(r"[\w/]+\.py\b", re.sub(r"```.*?```", "", text, flags=re.DOTALL)))
    assert named <= written | {Path(name).name for name in written}


def test_the_glossary_has_both_tables() -> None:
    assert len(avoided()) > 30
    terms = re.findall(r"^\| ([^|]+) \| [A-Z][^|]+\. \|$", GLOSSARY, flags=re.MULTILINE)
    assert len(terms) == len(set(terms)) > 40
    assert [term.lower() for term in terms] == sorted(term.lower() for term in terms)


def test_what_counts_as_a_sentence() -> None:
    prose = "# A heading\n\nOne two, `a code`. Three [four five](x.md)\nsix.\n\n"
    text = prose + "| a | b |\n\n- item one\n- item two\n\n    code\n"
    assert [len(words) for words in sentences(text)] == [3, 4, 2, 2]
