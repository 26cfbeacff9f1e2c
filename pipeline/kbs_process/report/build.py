"""Render the report of a results folder."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from kbs_process.errors import OutputError
from kbs_process.report import pdf as paper
from kbs_process.report.document import Document
from kbs_process.results.outcome import Outcome
from kbs_process.results.records import FILE, ResultsFile, encode


def build(results: Path, document: Document[Any], pdf: bool | None = None) -> Path:
    """Write index.html, and report.pdf where possible, into a results folder; return the page's path.

    `pdf`: True demands the PDF, False leaves it out, None makes it where weasyprint is installed.
    """
    from kbs_process.report import page  # draws: matplotlib costs most of a second to import

    head, sections = document.read(results)
    target = results / "index.html"
    try:
        _replace(target, page.render(head, sections, "screen").encode())
        if pdf or (pdf is None and paper.available()):
            _replace(results / "report.pdf", paper.render(page.render(head, sections, "paper")))
    except OSError as error:
        raise OutputError(
            f"cannot write the report: {error.strerror or error}",
            where=str(error.filename or results),
            remedy="free space on the disk, or check the folder's permissions",
        ) from None
    return target


def publish(
    folder: Path, target: Path, results: ResultsFile, document: Document[Any], pdf: bool | None, *more: str
) -> Outcome:
    """Write results.json and the report into `folder`, which becomes `target`; return what is told, and `more`."""
    (folder / FILE).write_bytes(encode(results))
    page = build(folder, document, pdf)
    met = {"pass": True, "fail": False}.get(results.verdict.status)
    return Outcome((results.verdict.sentence, *more), met, target / page.name)


def _replace(target: Path, content: bytes) -> None:
    """Write beside `target`, then put it in its place: what was there stays whole until then."""
    aside = target.with_name(f"{target.name}.part")
    try:
        aside.write_bytes(content)
        aside.replace(target)
    finally:
        aside.unlink(missing_ok=True)
