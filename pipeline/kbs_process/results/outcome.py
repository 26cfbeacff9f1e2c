"""What a study tells the command line when it is done."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True)
class Outcome:
    """What the command line tells."""

    verdict_lines: tuple[str, ...]
    requirement_met: bool | None  # None: there is no requirement; one that is undecided is not met
    report: Path
    lossy: bool = False  # whether a recording lacks something

    @property
    def failed(self) -> bool:
        """Whether --check gives exit status 1."""
        return self.requirement_met is False or self.lossy

    @property
    def lines(self) -> tuple[str, ...]:
        """The verdict, and where the report is."""
        return (*self.verdict_lines, f"Report: {self.report}")
