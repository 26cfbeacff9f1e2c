"""All kinds of reports, by the `kind` in results.json."""

from __future__ import annotations

from typing import Any

from kbs_process.report.document import Document
from kbs_process.report.documents import correlation, diagnosis, flight, identify, reference_day, stability

DOCUMENTS: dict[str, Document[Any]] = {
    "correlation": correlation.DOCUMENT,
    "diagnosis": diagnosis.DOCUMENT,
    "flight": flight.DOCUMENT,
    "identify": identify.DOCUMENT,
    "reference-day": reference_day.DOCUMENT,
    "stability": stability.DOCUMENT,
}
