"""The flight prediction's report."""

from __future__ import annotations

from kbs_process.report import provenance
from kbs_process.report.document import Document
from kbs_process.report.panel import Head
from kbs_process.studies.flight.results import FlightResults
from kbs_process.studies.flight.sections import compliance, drivers, histories


def head(results: FlightResults) -> Head:
    """Name, article and verdict."""
    about = f"{results.article} · {results.samples} units along {results.trajectory}"
    return Head("Flight prediction", results.name, results.title, about, results.verdict, results.provenance.version)


DOCUMENT = Document(
    title="Results of a flight prediction",
    record=FlightResults,
    head=head,
    panels=(compliance.panel, histories.panel, drivers.panel, provenance.section),
)
