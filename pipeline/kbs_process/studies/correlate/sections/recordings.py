"""What was recorded, how completely, and on which clocks."""

from __future__ import annotations

from kbs_process.report.panel import Block, Cell, Fold, Grid, Panel
from kbs_process.report.tables import Tables
from kbs_process.report.text import MISSING, count, measure, number
from kbs_process.studies.correlate.choose import folded
from kbs_process.studies.correlate.results import Recording, Results


def panel(results: Results, tables: Tables) -> Panel:
    """Recordings, then losses, then clocks."""
    blocks: list[Block] = list(folded(_recordings(results.recordings), "Further recordings"))
    losses = _losses(results.recordings)
    if losses.rows:
        blocks.extend(folded(losses, "Further losses"))
    clocks = _clocks(results.recordings)
    if clocks.rows:
        blocks.append(Fold(f"Clocks ({count(len(clocks.rows), 'stream')})", (clocks,)))
    return Panel("recordings", "Recordings", "What was recorded, how completely, and on which clocks?", tuple(blocks))


def _recordings(recordings: tuple[Recording, ...]) -> Grid:
    rows = tuple(
        (
            entry.name,
            entry.trajectory,
            entry.role,
            str(entry.repeat),
            f"{entry.duration_s:.1f}\u00a0s",
            ", ".join(f"{stream} {number(rate, 4)}" for stream, rate in entry.rates.items()) or MISSING,
            Cell(_loss_count(entry), "undecided" if entry.lost else "muted"),
        )
        for entry in recordings
    )
    head = ("Recording", "Trajectory", "Role", "Repeat", "Duration", "Rates / Hz", "Losses")
    return Grid("Recordings", head, rows, "kkkrrlk", "Files and checksums: see provenance.")


def _loss_count(entry: Recording) -> str:
    return count(len(entry.lost), "entry", "entries") if entry.lost else "none"


def _losses(recordings: tuple[Recording, ...]) -> Grid:
    rows = tuple(
        (entry.name, loss.kind, loss.where, f"{loss.count:d}", _when(loss.start_s, loss.end_s), loss.detail)
        for entry in recordings
        for loss in entry.losses
    )
    head = ("Recording", "Kind", "Where", "Count", "Time", "Detail")
    return Grid("Data losses", head, rows, "kklrkl", "Count: messages or blocks. Time: on the recording's own axis.")


def _when(start: float | None, end: float | None) -> str:
    if start is None:
        return MISSING
    return f"{start:.3f}\u00a0s" if end is None else f"{start:.3f} to {end:.3f}\u00a0s"


def _clocks(recordings: tuple[Recording, ...]) -> Grid:
    rows = tuple(
        (
            entry.name,
            clock.stream,
            f"{measure(1e3 * clock.offset_s, 1e3 * (clock.sigma_s or 0.0))}\u00a0ms",
            f"{number(1e6 * clock.skew, 3)}\u00a0ppm",
        )
        for entry in recordings
        for clock in entry.clocks
    )
    note = "Offset and skew of each stream's sensor clock against the recording's time axis."
    return Grid("Clocks", ("Recording", "Stream", "Offset", "Skew"), rows, "llrr", note)
