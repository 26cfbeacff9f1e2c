"""The diagnosis' report."""

from __future__ import annotations

from collections.abc import Mapping

from kbs_process.diagnosis.facts import Answer
from kbs_process.report import provenance
from kbs_process.report.document import Document
from kbs_process.report.panel import Head, Panel
from kbs_process.report.tables import Tables
from kbs_process.studies.diagnose.results import DiagnosisResults
from kbs_process.studies.diagnose.sections import answer, finds, next_test, remaining, search

_HEADLINES: Mapping[Answer, str] = {
    "none": "No mismatch",
    "parameters off": "Parameters off",
    "physics": "Physics left out",
    "undecided": "Undecided",
}


def head(results: DiagnosisResults) -> Head:
    """Name, article and answer."""
    return Head(
        "Diagnosis",
        results.name,
        results.title,
        results.article,
        results.verdict,
        results.provenance.version,
        _HEADLINES[results.answer],
    )


def _provenance(results: DiagnosisResults, tables: Tables) -> Panel:
    return provenance.panel(results.provenance)


DOCUMENT = Document(
    title="Results of a diagnosis",
    record=DiagnosisResults,
    head=head,
    panels=(answer.panel, finds.panel, search.panel, remaining.panel, next_test.panel, _provenance),
)
