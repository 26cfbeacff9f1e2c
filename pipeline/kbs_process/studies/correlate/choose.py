"""What to show first: bands, frames, channels and recordings in the order that matters to a reader."""

from __future__ import annotations

from collections.abc import Sequence

from kbs_process.report.panel import Block, Cell, Fold, Grid
from kbs_process.report.text import band_hz
from kbs_process.results.judged import Frame, Requirement
from kbs_process.studies.correlate.results import Band, Merit, Recording, Results

ROLES = ("held-out", "fit", "calibration")
PLATES = 6  # of recordings, on paper
_ROWS = 24


def main_band(results: Results) -> str:
    """Return the requirement's band, or the narrowest where nothing is required."""
    if results.requirements:
        return results.requirements[0].band
    limited = [band for band in results.bands if band.low_pass_Hz is not None]
    chosen = min(limited, key=lambda band: band.low_pass_Hz or 0.0) if limited else None
    return chosen.name if chosen else (results.bands[0].name if results.bands else "unfiltered")


def main_frame(results: Results) -> Frame:
    """Return the requirement's frame, or that of the recorded loads where nothing is required."""
    return results.requirements[0].frame if results.requirements else results.campaign.frame


def band_names(results: Results) -> tuple[str, ...]:
    """Return all bands, the main one first."""
    main = main_band(results)
    return (main, *(band.name for band in results.bands if band.name != main))


def band_label(results: Results, name: str) -> str:
    """Return a band's label, or its name where the results do not describe it."""
    return next((band.label for band in results.bands if band.name == name), name)


def band_range(band: Band) -> str:
    """Return a band's edges in words."""
    return band_hz(band.high_pass_Hz, band.low_pass_Hz)


def by_role(recordings: tuple[Recording, ...]) -> tuple[Recording, ...]:
    """Return recordings with those that were held out first: they test the prediction."""
    return tuple(sorted(recordings, key=lambda recording: ROLES.index(recording.role)))


def peak_limit(results: Results, band: str, frame: str, channel: str, unit: str) -> float | None:
    """Return the limit on the peak of a channel in a band and frame, where a requirement sets one."""
    for requirement in results.requirements:
        if _concerns(requirement, band, frame, channel) and requirement.unit == unit:
            return requirement.limit
    return None


def _concerns(requirement: Requirement, band: str, frame: str, channel: str) -> bool:
    initial = {"torque": "T", "force": "F"}[requirement.quantity]
    return (
        requirement.statistic == "peak"
        and (requirement.band, requirement.frame) == (band, frame)
        and channel.startswith(initial)
    )


def folded(grid: Grid, rest: str) -> tuple[Block, ...]:
    """Return a long table in two: its first rows, and the rest on demand."""
    if len(grid.rows) <= _ROWS + 4:
        return (grid,)
    head = Grid(grid.title, grid.head, grid.rows[:_ROWS], grid.align, grid.note)
    tail = Grid(f"{grid.title} (continued)", grid.head, grid.rows[_ROWS:], grid.align)
    return (head, Fold(f"{rest} ({len(tail.rows)} rows)", (tail,)))


def at_spacecraft(results: Results) -> bool:
    """Whether anything is said of the spacecraft's centre of mass."""
    return "S" in {row.frame for row in results.merit} | {row.frame for row in results.requirements}


def pessimistic(rows: Sequence[Merit]) -> Cell:
    """Whether predicted peaks of these rows are no less than measured ones, and of how many that can be said."""
    short = [
        (row.measured_peak - row.predicted_peak, 2.0 * row.sigma)
        for row in rows
        if row.sigma is not None and not row.at_the_noise
        if row.measured_peak is not None and row.predicted_peak is not None
    ]
    if not short:
        return Cell("not testable", "muted")
    larger = sum(by <= 0.0 for by, _ in short)
    counted = f"{larger} of {len(short)}"
    if larger == len(short):
        return Cell(f"yes, {counted}", "pass")
    return Cell(f"no, {counted}", "undecided") if any(by > most for by, most in short) else Cell(f"open, {counted}")
