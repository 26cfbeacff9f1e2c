"""The stability analysis's report."""

from __future__ import annotations

from kbs_process.report import provenance
from kbs_process.report.document import Document
from kbs_process.report.panel import Head
from kbs_process.studies.stability.results import StabilityResults
from kbs_process.studies.stability.sections import margins, onset, poles


def head(results: StabilityResults) -> Head:
    """Name, article and verdict."""
    loop = f"cycle {results.cycle_s:g} s, latency {results.latency}, run with the loop {results.loop}"
    about = f"{results.article} · {loop}"
    title = f"Stability of the pointing loop over {results.joint}"
    return Head("Stability", results.name, title, about, results.verdict, results.provenance.version)


DOCUMENT = Document(
    title="Results of a stability analysis",
    record=StabilityResults,
    head=head,
    panels=(margins.panel, poles.panel, onset.panel, provenance.section),
)
