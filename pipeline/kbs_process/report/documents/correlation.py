"""The correlation report: its sections in the order in which a reader meets them."""

from __future__ import annotations

from kbs_process.report.document import Document
from kbs_process.report.panel import Head
from kbs_process.report.panels import (
    budget,
    compliance,
    conventions,
    coupling,
    disturbance,
    gravity,
    merit,
    methods,
    pointing,
    provenance,
    recordings,
    repeatability,
    spectra,
    static,
    transducer,
)
from kbs_process.report.results import Results

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
    )


DOCUMENT = Document(
    title="Results of a processed campaign",
    record=Results,
    head=head,
    panels=(
        compliance.panel,
        disturbance.panel,
        merit.panel,
        spectra.panel,
        transducer.panel,
        static.panel,
        gravity.panel,
        coupling.panel,
        repeatability.panel,
        budget.panel,
        pointing.panel,
        recordings.panel,
        conventions.panel,
        methods.panel,
        provenance.panel,
    ),
)
