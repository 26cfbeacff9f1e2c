"""The diagnosis' report."""

from __future__ import annotations

from kbs_process.report.document import Document
from kbs_process.report.panel import Head, Panel
from kbs_process.report.panels import provenance
from kbs_process.report.panels.diagnosis import answer, finds, next_test, remaining, search
from kbs_process.report.records.diagnosis import DiagnosisResults
from kbs_process.report.tables import Tables


def head(results: DiagnosisResults) -> Head:
    """Name, article and answer."""
    return Head(
        "Diagnosis",
        results.name,
        results.title,
        results.article,
        results.verdict,
        results.provenance.version,
    )


def _provenance(results: DiagnosisResults, tables: Tables) -> Panel:
    return provenance.of(results.provenance)


DOCUMENT = Document(
    title="Results of a diagnosis",
    record=DiagnosisResults,
    head=head,
    panels=(answer.panel, finds.panel, search.panel, remaining.panel, next_test.panel, _provenance),
)
