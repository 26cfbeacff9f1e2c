"""Why do prediction and recordings differ? The answer of a diagnosis that was made with the report."""

from __future__ import annotations

from kbs_process.report.panel import Link, Panel, Text
from kbs_process.report.records.common import FILE, Record, load
from kbs_process.report.records.diagnosis import DiagnosisResults
from kbs_process.report.tables import Tables

FOLDER = "diagnosis"  # inside the results that it belongs to
_OTHER = "It was made before these results, of the same inputs, by another version of kbs-process: see its provenance."


def panel(results: Record, tables: Tables) -> Panel | None:
    """What the diagnosis says in a paragraph, and where all of it is."""
    folder = tables.folder / FOLDER
    if not (folder / FILE).is_file():
        return None
    diagnosis = load(folder, DiagnosisResults)
    made, here = diagnosis.provenance, getattr(results, "provenance", diagnosis.provenance)
    other = (made.version, made.commit, made.source) != (here.version, here.commit, here.source)
    blocks = (
        Text(diagnosis.verdict.sentence),
        Text(diagnosis.paragraph),
        *((Text(_OTHER),) if other else ()),
        Link("The diagnosis: where it enters, what law it is, what remains", f"{FOLDER}/index.html"),
    )
    return Panel(FOLDER, "Diagnosis", "Why do prediction and recordings differ?", blocks)
