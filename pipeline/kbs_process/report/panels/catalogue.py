"""All sections, in the order in which a reader meets them."""

from __future__ import annotations

from kbs_process.report.panel import PanelMaker
from kbs_process.report.panels import (
    budget,
    compliance,
    conventions,
    coupling,
    disturbance,
    gravity,
    merit,
    methods,
    provenance,
    recordings,
    repeatability,
    spectra,
    static,
)

PANELS: tuple[PanelMaker, ...] = (
    compliance.panel,
    disturbance.panel,
    merit.panel,
    spectra.panel,
    static.panel,
    gravity.panel,
    coupling.panel,
    repeatability.panel,
    budget.panel,
    recordings.panel,
    conventions.panel,
    methods.panel,
    provenance.panel,
)
