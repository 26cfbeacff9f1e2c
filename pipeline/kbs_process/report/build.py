"""Render the report of a results folder: a page, and the same on paper."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from kbs_process.errors import OutputError
from kbs_process.report.document import Document
from kbs_process.results.kept import kept
from kbs_process.results.outcome import Outcome
from kbs_process.results.provenance import sha256
from kbs_process.results.records import FILE, ResultsFile, encode
from kbs_process.results.store import files_in

_REMEDY = 'install the extra: pip install "kbs-process[pdf]" (weasyprint also needs the Pango library)'
_MADE = ("index.html", "report.pdf")  # of all else in the folder
_EPOCH = "0"  # the date written into embedded fonts: none of the results' business, hence fixed


def build(results: Path, document: Document[Any], pdf: bool | None = None) -> Path:
    """Write index.html, and report.pdf where possible, into a results folder; return the page's path.

    `pdf`: True demands the PDF, False leaves it out, None makes it where weasyprint is installed.
    """
    from kbs_process.report import page  # draws: matplotlib costs most of a second to import

    made_of = {name: sha256(results / name) for name in files_in(results) if name not in _MADE}
    head, sections = kept("report", (document.title, made_of), lambda: document.read(results))
    target = results / "index.html"
    try:
        _replace(target, page.render(head, sections, "screen").encode())
        if pdf or (pdf is None and available()):
            paper = page.render(head, sections, "paper")
            dated = os.environ.get("SOURCE_DATE_EPOCH")
            _replace(results / "report.pdf", kept("paper", (paper, dated), lambda: to_pdf(paper)))
    except OSError as error:
        raise OutputError(
            f"cannot write the report: {error.strerror or error}",
            where=str(error.filename or results),
            remedy="free space on the disk, or check the folder's permissions",
        ) from None
    return target


def publish(
    folder: Path, target: Path, results: ResultsFile, document: Document[Any] | None, pdf: bool | None, *more: str
) -> Outcome:
    """Write results.json and the report into `folder`, which becomes `target`; return what is told, and `more`.

    Without a `document` there is no report; it can be rendered later.
    """
    page = folder / FILE
    page.write_bytes(encode(results))
    if document is not None:
        page = build(folder, document, pdf)
    status = results.verdict.status
    met = None if status == "none" else status == "pass"
    return Outcome((results.verdict.sentence, *more), met, target / page.name)


def _replace(target: Path, content: bytes) -> None:
    """Write beside `target`, then put it in its place: what was there stays whole until then."""
    aside = target.with_name(f"{target.name}.part")
    try:
        aside.write_bytes(content)
        aside.replace(target)
    finally:
        aside.unlink(missing_ok=True)


def available() -> bool:
    """Say whether weasyprint is installed."""
    return find_spec("weasyprint") is not None


def to_pdf(html: str) -> bytes:
    """Return `html` as PDF; the same page gives the same bytes."""
    try:
        import weasyprint  # an extra, and slow to import
    except (ImportError, OSError) as error:  # OSError: its shared libraries are missing
        raise OutputError(f"no PDF without weasyprint: {error}", remedy=_REMEDY) from None
    with _fixed_date():
        content: bytes = weasyprint.HTML(string=html).write_pdf(presentational_hints=True)
    return content


@contextmanager
def _fixed_date() -> Iterator[None]:
    before = os.environ.get("SOURCE_DATE_EPOCH")
    os.environ["SOURCE_DATE_EPOCH"] = before or _EPOCH
    try:
        yield
    finally:
        if before is None:
            del os.environ["SOURCE_DATE_EPOCH"]
