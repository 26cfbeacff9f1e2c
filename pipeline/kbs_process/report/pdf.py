"""The report on paper."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec

from kbs_process.errors import OutputError

_REMEDY = 'install the extra: pip install "kbs-process[pdf]" (weasyprint also needs the Pango library)'
_EPOCH = "0"  # the date written into embedded fonts: none of the results' business, hence fixed


def available() -> bool:
    """Say whether weasyprint is installed."""
    return find_spec("weasyprint") is not None


def render(html: str) -> bytes:
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
