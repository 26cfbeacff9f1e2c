"""The reference day's report."""

from __future__ import annotations

from kbs_process.report import provenance
from kbs_process.report.document import Document
from kbs_process.report.panel import Head, Panel
from kbs_process.report.tables import Tables
from kbs_process.studies.reference_day.results import ReferenceDayResults
from kbs_process.studies.reference_day.sections import compliance, errors, mast, sections, torque, trajectory


def head(results: ReferenceDayResults) -> Head:
    """Name, article and verdict."""
    about = f"{results.article} · {len(results.sections)} sections, {results.sections[-1].end_s:.0f} s"
    return Head("Reference day", results.name, results.title, about, results.verdict, results.provenance.version)


def _constants(results: ReferenceDayResults, tables: Tables) -> Panel:
    block = provenance.constants(results.parameters)
    return Panel("constants", "Constants", "With which numbers was this computed?", (block,))


DOCUMENT = Document(
    title="Results of a simulated reference day",
    record=ReferenceDayResults,
    head=head,
    panels=(
        compliance.panel, sections.panel, trajectory.panel, errors.panel, torque.panel, mast.panel,
        _constants, provenance.section,
    ),
)  # fmt: skip
