"""Why do prediction and recordings differ? The answer of a diagnosis that was made with the report."""

from __future__ import annotations

from kbs_process.report.panel import Link, Panel, Text
from kbs_process.report.tables import Tables
from kbs_process.results.diagnosed import FOLDER, DiagnosisAnswer
from kbs_process.results.records import FILE, Record, load

_OTHER = "It was made before these results, of the same inputs, by another version of kbs-process: see its provenance."


def panel(results: Record, tables: Tables) -> Panel | None:
    """What the diagnosis says in a paragraph, and where all of it is."""
    folder = tables.folder / FOLDER
    if not (folder / FILE).is_file():
        return None
    diagnosis = load(folder, DiagnosisAnswer)
    made, here = diagnosis.provenance, getattr(results, "provenance", diagnosis.provenance)
    other = (made.version, made.commit, made.source) != (here.version, here.commit, here.source)
    blocks = (
        Text(diagnosis.verdict.sentence),
        Text(diagnosis.paragraph),
        *((Text(_OTHER),) if other else ()),
        Link("The diagnosis: where it enters, what law it is, what remains", f"{FOLDER}/index.html"),
    )
    return Panel(FOLDER, "Diagnosis", "Why do prediction and recordings differ?", blocks)
