"""What the documents say of how often the diagnosis is right is what the stored sets say."""

from __future__ import annotations

import pytest

from proof.validations import BLOCK, MARKED, documents


@pytest.mark.slow
def test_the_documents_say_what_the_stored_sets_say() -> None:
    for path, text in documents().items():
        assert path.read_text(encoding="utf-8") == text, f"{path.name}: cd tests && python -m proof.validations"


def test_the_line_stands_in_every_marked_document() -> None:
    for path in MARKED:
        assert len(BLOCK.findall(path.read_text(encoding="utf-8"))) == 1, path.name
