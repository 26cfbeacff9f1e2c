"""What made these results, and from what."""

from __future__ import annotations

from collections.abc import Mapping

from kbs_process.report.panel import Block, Grid, Panel, Text
from kbs_process.report.records.common import Provenance
from kbs_process.report.results import Results
from kbs_process.report.tables import Tables


def panel(results: Results, tables: Tables) -> Panel:
    """The command, the software, and the checksum of every input."""
    return of(results.provenance, {entry.file: entry.sha256 for entry in results.recordings})


def of(made: Provenance, recorded: Mapping[str, str] | None = None) -> Panel:
    """Return the section for any kind of results; `recorded` gives checksums of recordings by file."""
    software = (
        ("kbs-process", made.version),
        *((("commit", made.commit),) if made.commit else ()),
        *((("source, SHA-256", made.source),) if made.source else ()),
        ("Python", made.python),
        ("platform", made.platform),
        *made.libraries.items(),
    )
    inputs = dict(recorded or {}) | {entry.file: entry.sha256 for entry in made.inputs}
    blocks: list[Block] = [
        Text(f"Made by: {made.command}"),
        Grid("Software", ("Component", "Version"), software, "ll"),
        Grid("Inputs", ("File", "SHA-256"), tuple(inputs.items()), "lk"),
    ]
    return Panel("provenance", "Provenance", "What made these results, and from what?", tuple(blocks))
