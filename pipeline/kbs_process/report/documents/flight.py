"""The flight prediction's report."""

from __future__ import annotations

from kbs_process.report.document import Document
from kbs_process.report.panel import Head, Panel
from kbs_process.report.panels import provenance
from kbs_process.report.panels.flight import compliance, drivers, histories
from kbs_process.report.records.flight import FlightResults
from kbs_process.report.tables import Tables


def head(results: FlightResults) -> Head:
    """Name, article and verdict."""
    about = f"{results.article} · {results.samples} units along {results.trajectory}"
    return Head(
        "Flight prediction", results.name, results.title, about, results.verdict, results.provenance.version
    )


def _provenance(results: FlightResults, tables: Tables) -> Panel:
    return provenance.of(results.provenance)


DOCUMENT = Document(
    title="Results of a flight prediction",
    record=FlightResults,
    head=head,
    panels=(compliance.panel, histories.panel, drivers.panel, _provenance),
)
