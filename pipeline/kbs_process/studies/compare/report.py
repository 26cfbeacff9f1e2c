"""The report of a comparison."""

from __future__ import annotations

from kbs_process.report import provenance
from kbs_process.report.document import Document
from kbs_process.report.panel import Head
from kbs_process.report.text import count
from kbs_process.studies.compare.axis import FEW
from kbs_process.studies.compare.results import ComparisonResults
from kbs_process.studies.compare.sections import numbers, requirements, spectra, verdicts


def head(results: ComparisonResults) -> Head:
    """What was compared, and what differs."""
    names = list(dict.fromkeys(one.name for one in results.compared))
    name = ", ".join(names) if len(names) <= FEW else f"{names[0]} … {names[-1]}"
    about = " · ".join(dict.fromkeys(one.article for one in results.compared if one.article))
    title = count(len(results.compared), "folder of results", "folders of results")
    made = results.provenance.version
    return Head("Comparison", name, title, about, results.verdict, made, headline="Compared")


DOCUMENT = Document(
    title="Results of a comparison",
    record=ComparisonResults,
    head=head,
    panels=(verdicts.panel, requirements.panel, numbers.panel, spectra.panel, provenance.section),
)
