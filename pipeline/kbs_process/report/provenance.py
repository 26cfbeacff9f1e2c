"""What made these results, and from what."""

from __future__ import annotations

from collections.abc import Sequence

from kbs_process.report.panel import Block, Fold, Grid, Panel, Text
from kbs_process.report.tables import Tables
from kbs_process.report.text import count, measure, unit
from kbs_process.results.records import Constant, InputFile, Provenance, ResultsFile


def panel(made: Provenance, imported: Sequence[InputFile] = ()) -> Panel:
    """Return the section for any kind of results; `imported`: the loggers' files that recordings were made from."""
    software = (
        ("kbs-process", made.version),
        *((("commit", made.commit),) if made.commit else ()),
        *((("source, SHA-256", made.source),) if made.source else ()),
        ("Python", made.python),
        ("platform", made.platform),
        *made.libraries.items(),
    )
    inputs = [(one.file, one.sha256) for one in made.inputs] + [
        (f"{one.file}, imported", one.sha256) for one in imported
    ]
    blocks: list[Block] = [
        Text(f"Made by: {made.command}"),
        Grid("Software", ("Component", "Version"), software, "ll"),
        Grid("Inputs", ("File", "SHA-256"), tuple(inputs), "lk"),
    ]
    return Panel("provenance", "Provenance", "What made these results, and from what?", tuple(blocks))


def maker(made: Provenance) -> str:
    """Return the program's version, and the commit or the source that it was."""
    changed = "+" if made.commit.endswith("+") else ""
    code = f"commit {made.commit[:12]}{changed}" if made.commit else f"source {made.source[:12]}"
    return f"kbs-process {made.version}, {code}"


def section(results: ResultsFile, tables: Tables) -> Panel:
    """The section, as the last one of a document."""
    return panel(results.provenance)


def constants(entries: Sequence[Constant]) -> Fold:
    """Return a table of constants that a reader opens on demand."""
    rows = tuple((entry.name, *_value(entry.value, entry.sigma), unit(entry.unit), entry.source) for entry in entries)
    grid = Grid("Constants used", ("Name", "Value", "Unit", "Source"), rows, "lrll")
    return Fold(f"Constants ({count(len(rows), 'parameter')})", (grid,))


def _value(value: float | str, sigma: float | str | None) -> tuple[str]:
    if isinstance(value, str) or isinstance(sigma, str):
        return (f"{value} ± {sigma}" if sigma not in (None, "") else f"{value}",)
    return (measure(value, sigma),)
