"""The identification's report."""

from __future__ import annotations

from kbs_process.report import provenance
from kbs_process.report.document import Document
from kbs_process.report.panel import Block, Head, Panel, Text, notices
from kbs_process.report.prose import Prose
from kbs_process.report.tables import Tables
from kbs_process.studies.identify.results import IdentifyResults
from kbs_process.studies.identify.sections import parameters, residuals


def head(results: IdentifyResults) -> Head:
    """Name, article and outcome."""
    return Head(
        "Identification", results.name, results.title, results.article, results.verdict, results.provenance.version
    )


def _methods(results: IdentifyResults, tables: Tables) -> Panel:
    spread = Prose("kbs_process.studies.identify", "notes")("spread", percent=f"{100 * results.run_to_run:.3g}")
    blocks: tuple[Block, ...] = (*notices(results.warnings), *(Text(note) for note in (*results.notes, spread)))
    return Panel("methods", "Methods", "How were these numbers obtained?", blocks)


DOCUMENT = Document(
    title="Results of an identification",
    record=IdentifyResults,
    head=head,
    panels=(parameters.panel, residuals.panel, _methods, provenance.section),
)
