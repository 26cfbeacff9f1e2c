"""Every kind of report, by the `kind` in results.json."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from kbs_process.errors import OutputError, did_you_mean
from kbs_process.report.build import build
from kbs_process.report.document import Document
from kbs_process.results.records import FILE, kind_of
from kbs_process.studies.compare import report as compare
from kbs_process.studies.correlate import report as correlate
from kbs_process.studies.diagnose import report as diagnose
from kbs_process.studies.flight import report as flight
from kbs_process.studies.identify import report as identify
from kbs_process.studies.reference_day import report as reference_day
from kbs_process.studies.stability import report as stability

DOCUMENTS: dict[str, Document[Any]] = {
    "comparison": compare.DOCUMENT,
    "correlation": correlate.DOCUMENT,
    "diagnosis": diagnose.DOCUMENT,
    "flight": flight.DOCUMENT,
    "identify": identify.DOCUMENT,
    "reference-day": reference_day.DOCUMENT,
    "stability": stability.DOCUMENT,
}


def render(results: Path, pdf: bool | None = None) -> Path:
    """Write the report of any kind of stored results into their folder; return the page's path."""
    kind = kind_of(results)
    if kind not in DOCUMENTS:
        raise OutputError(
            f"there is no report of kind '{kind}'", where=str(results / FILE), remedy=did_you_mean(kind, DOCUMENTS)
        )
    return build(results, DOCUMENTS[kind], pdf)
