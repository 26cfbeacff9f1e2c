"""Collects what is wrong with a campaign, so that a user sees several faults at once."""

from __future__ import annotations

from dataclasses import dataclass, field

from kbs_process.errors import ConfigError

SHOWN = 5


@dataclass(slots=True)
class Problems:
    """Errors found so far, in the order in which they were found."""

    subject: str  # what is being checked: the campaign's folder
    found: dict[str, ConfigError] = field(default_factory=dict)  # by their words

    @property
    def enough(self) -> bool:
        """Whether all that is told has been found: of what comes now, only the number counts."""
        return len(self.found) >= SHOWN

    def add(self, where: str, what: str, remedy: str = "") -> None:
        """Note one error; the same words are noted once."""
        error = ConfigError(what, where=where, remedy=remedy)
        self.found.setdefault(str(error), error)

    def raise_any(self) -> None:
        """Raise one error that tells the first few of those found; return if there are none."""
        if not self.found:
            return
        found = list(self.found.values())
        if len(found) == 1:
            raise found[0]
        more = len(self.found) - SHOWN
        rest = [ConfigError(f"and {more} more")] if more > 0 else []
        what = f"{len(self.found)} things are wrong"
        raise ConfigError(what, where=self.subject, each=[*found[:SHOWN], *rest])
