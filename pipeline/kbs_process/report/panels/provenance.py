"""What made these results, and from what."""

from __future__ import annotations

from kbs_process.report.panel import Block, Grid, Panel, Text
from kbs_process.report.results import Results
from kbs_process.report.tables import Tables


def panel(results: Results, tables: Tables) -> Panel:
    """The command, the software, and the checksum of every input."""
    made = results.provenance
    software = (
        ("kbs-process", made.version),
        *((("commit", made.commit),) if made.commit else ()),
        ("Python", made.python),
        ("platform", made.platform),
        *made.libraries.items(),
    )
    recorded = {entry.file: entry.sha256 for entry in results.recordings}
    inputs = recorded | {entry.file: entry.sha256 for entry in made.inputs}
    blocks: list[Block] = [
        Text(f"Made by: {made.command}"),
        Grid("Software", ("Component", "Version"), software, "ll"),
        Grid("Inputs", ("File", "SHA-256"), tuple(inputs.items()), "lk"),
    ]
    return Panel("provenance", "Provenance", "What made these results, and from what?", tuple(blocks))
