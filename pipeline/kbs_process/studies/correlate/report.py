"""The correlation report: its sections in the order in which a reader meets them."""

from __future__ import annotations

from collections.abc import Callable

from kbs_process.report import provenance
from kbs_process.report.document import Document
from kbs_process.report.panel import Grid, Head, Panel
from kbs_process.report.tables import Tables
from kbs_process.studies.correlate.results import Results
from kbs_process.studies.correlate.sections import (
    budget,
    compliance,
    conventions,
    coupling,
    diagnosed,
    disturbance,
    gravity,
    lessons,
    merit,
    methods,
    pointing,
    recordings,
    repeatability,
    static,
    transducer,
)
from kbs_process.studies.correlate.sections.spectra import densities, orders

_DRIVE = {"command": "command-driven prediction", "motion": "motion-driven prediction"}


def head(results: Results) -> Head:
    """Name, article and verdict of the campaign."""
    campaign = results.campaign
    configuration = f"configuration {campaign.configuration}" if campaign.configuration else ""
    about = " · ".join(filter(None, (campaign.article, configuration, _DRIVE[campaign.drive])))
    return Head(
        "Disturbance correlation report",
        campaign.name,
        campaign.title,
        about,
        results.verdict,
        results.provenance.version,
        document=_identity(results),
        model=(results.model.status, results.model.sentence) if results.model else ("", ""),
    )


def _identity(results: Results) -> tuple[tuple[str, str], ...]:
    about = results.document
    rows = {
        "Document": about.number,
        "Revision": about.revision,
        "Article's serial number": about.serial_number,
        "Date of test": about.date,
        "Operator": about.operator,
        "Processed with": provenance.maker(results.provenance),
    }
    return tuple((label, value) for label, value in rows.items() if value)


def _signatures(results: Results, tables: Tables) -> Panel:
    """Room for those who stand for the report."""
    people = ("Tested by", results.document.operator), ("Checked by", ""), ("Approved by", "")
    rows = tuple((role, name, "", "") for role, name in people)
    grid = Grid("Signatures", ("Role", "Name", "Date", "Signature"), rows, "llll")
    return Panel("signatures", "Signatures", "Who stands for this report?", (grid,))


def _on_transducer(make: Callable[[Results, Tables], Panel]) -> Callable[[Results, Tables], Panel | None]:
    """A section that says nothing about a rig whose loads are the efforts of its joints alone."""
    return lambda results, tables: make(results, tables) if results.campaign.frame == "T" else None


def _provenance(results: Results, tables: Tables) -> Panel:
    """The command, the software, and the checksum of every input."""
    return provenance.panel(results.provenance, results.campaign.sources)


DOCUMENT = Document(
    title="Results of a processed campaign",
    record=Results,
    head=head,
    panels=(
        compliance.panel,
        disturbance.panel,
        merit.panel,
        lessons.panel,
        densities.panel,
        orders.panel,
        diagnosed.panel,
        _on_transducer(transducer.panel),
        _on_transducer(static.panel),
        gravity.panel,
        _on_transducer(coupling.panel),
        repeatability.panel,
        budget.panel,
        pointing.panel,
        recordings.panel,
        _on_transducer(conventions.panel),
        methods.panel,
        _provenance,
        _signatures,
    ),
)
