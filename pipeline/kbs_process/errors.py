"""Every error that a user may see: what is wrong, where, and what to do next."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from difflib import get_close_matches

from kbs_process.terminal import printable

_LISTED = 40  # names that an error tells
_COMPARED = 2000  # names that one may be meant by


class KbsError(Exception):
    """An error that ends the command with one clear message and `exit_status`; `each` is what it consists of.

    Names in it are from files, so what they hold of line ends and commands to a terminal is escaped.
    """

    exit_status = 2

    def __init__(self, what: str, *, where: str = "", remedy: str = "", each: Sequence[KbsError] = ()) -> None:
        super().__init__(what)
        self.what = printable(what)
        self.where = printable(where)
        self.remedy = printable(remedy)
        self.each = each

    def __str__(self) -> str:
        place = f"{self.where}: " if self.where else ""
        remedy = f"\n  -> {self.remedy}" if self.remedy else ""
        return "\n".join([f"{place}{self.what}{remedy}", *map(str, self.each)])


class ConfigError(KbsError):
    """A campaign's TOML file is missing, malformed or contradicts itself."""


class RecordingError(KbsError):
    """A recording cannot be read, or lacks what the campaign needs from it."""


class SchemaError(RecordingError):
    """A recording's schema is damaged, so that no message of it can be read."""


class FitError(KbsError):
    """The recordings do not determine what a fit is asked for."""


class SimulationError(KbsError):
    """The plant's solution is not finite, or its parameters make no sense."""


class DivergenceError(SimulationError):
    """The plant has no solution: it grew beyond all bounds, or there is no equilibrium to begin from."""


class MissionError(KbsError):
    """A mission's orbit, relay satellites and limits allow no trajectory."""


class OutputError(KbsError):
    """Results cannot be written; what was there before is untouched."""


def did_you_mean(word: str, known: Iterable[str], taken: Collection[str] = (), before: str = "") -> str:
    """Return "did you mean 'x'?" for the closest of `known` that is not `taken`, or all of them where none is close.

    Each is told with what stands `before` it.
    """
    names = sorted(known)
    free = [name for name in names if name not in taken and abs(len(name) - len(word)) <= len(word)]
    close = get_close_matches(word[:200], free[:_COMPARED], n=1, cutoff=0.6)
    if close:
        return f"did you mean '{before}{close[0]}'?"
    more = f" and {len(names) - _LISTED} more" if len(names) > _LISTED else ""
    return "known: " + ", ".join(before + name for name in names[:_LISTED]) + more if names else "nothing is known here"
