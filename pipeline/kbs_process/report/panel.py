"""What a section of the report is made of; the template knows how each block looks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from kbs_process.results.records import Conclusion, Notice

Tone = Literal["", "pass", "fail", "undecided", "muted"]


@dataclass(frozen=True, slots=True)
class Caption:
    """How to read a figure."""

    shown: str
    good: str
    bad: str
    do: str


@dataclass(frozen=True, slots=True)
class Picture:
    """An image as a data URI."""

    uri: str
    alt: str
    title: str = ""
    width: int = 100  # % of the text's width


@dataclass(frozen=True, slots=True)
class Channel:
    """Curves of one channel for the interactive plots, each packed by `series.pack`.

    The computed curve is None where the page works it out: measured less residual.
    """

    name: str
    unit: str
    limit: float | None
    curves: tuple[dict[str, object] | None, ...]


@dataclass(frozen=True, slots=True)
class View:
    """One choice of the interactive plots: a recording, in one band and frame; or the spectra of one."""

    recording: str
    choice: str  # band and frame, in words
    t0: float  # s
    step: float  # s
    bin_s: float | None  # each pair of points is the least and greatest value in so many seconds
    shaded: tuple[tuple[float, float], ...]  # s, stretches without valid samples
    channels: tuple[Channel, ...]
    places: dict[str, object] | None = None  # of the points of spectra, in place of t0 and step, by their logarithm
    marks: tuple[tuple[float, str], ...] = ()  # places to be marked, and the page's colour for each


@dataclass(frozen=True, slots=True)
class Live:
    """Interactive time histories or spectra; the figure's pictures stand in for them on paper."""

    key: str
    names: tuple[str, ...]  # of a channel's curves, in their order
    views: tuple[View, ...]
    two_scales: bool  # the residual has an axis of its own
    shortcuts: tuple[tuple[str, str], ...] = ()  # name and choice of the views most asked for
    along: tuple[str, str, str] = ("time", "t", "s")  # what the curves are over, its symbol and unit
    choosing: str = "Band and frame"


@dataclass(frozen=True, slots=True)
class Figure:
    """One or more pictures that are read in the same way."""

    title: str
    pictures: tuple[Picture, ...]
    caption: Caption
    live: Live | None = None
    kind: Literal["figure"] = "figure"


@dataclass(frozen=True, slots=True)
class Cell:
    """A table's cell with a tone, or a link."""

    text: str
    tone: Tone = ""
    to: str = ""  # a section, `#key`, or another page, relative to this one


@dataclass(frozen=True, slots=True)
class Grid:
    """A table; `align` holds a letter a column: l(eft), r(ight), c(entre) or k(ey, left and on one line)."""

    title: str
    head: tuple[str, ...]
    rows: tuple[tuple[str | Cell, ...], ...]
    align: str
    note: str = ""
    kind: Literal["grid"] = "grid"


@dataclass(frozen=True, slots=True)
class Text:
    """A paragraph, or with `items` a list under it."""

    text: str
    items: tuple[str, ...] = ()
    tone: Tone = ""
    kind: Literal["text"] = "text"


@dataclass(frozen=True, slots=True)
class Formula:
    """Mathematics as an outline, an SVG path in hundredths of an em."""

    tex: str
    outline: str
    box: tuple[float, float, float, float]  # left, top, width, height


@dataclass(frozen=True, slots=True)
class Equation:
    """A sentence with formulas in it."""

    parts: tuple[str | Formula, ...]
    kind: Literal["equation"] = "equation"


@dataclass(frozen=True, slots=True)
class Notices:
    """Warnings, each with its severity, place and remedy."""

    entries: tuple[tuple[str, str, str, str], ...]  # severity, what, where, remedy
    kind: Literal["notices"] = "notices"


def notices(found: Sequence[Notice]) -> tuple[Notices, ...]:
    """Return the block of what a reader has to know; none where there is nothing."""
    return (Notices(tuple((n.severity, n.what, n.where, n.remedy) for n in found)),) if found else ()


@dataclass(frozen=True, slots=True)
class Fold:
    """Blocks that a reader opens on demand; open on paper."""

    title: str
    blocks: tuple[Block, ...]
    kind: Literal["fold"] = "fold"


@dataclass(frozen=True, slots=True)
class Link:
    """A way to another page of the same results."""

    text: str
    to: str  # relative to the page
    kind: Literal["link"] = "link"


Block = Figure | Grid | Text | Equation | Notices | Fold | Link


@dataclass(frozen=True, slots=True)
class Panel:
    """A section of the report: the question it answers, and the answer."""

    key: str
    title: str
    question: str
    blocks: tuple[Block, ...]


@dataclass(frozen=True, slots=True)
class Head:
    """What stands above all sections."""

    kicker: str  # what kind of report this is
    name: str
    title: str
    about: str
    conclusion: Conclusion
    version: str  # of what made the results
    headline: str = ""  # in place of the conclusion's status, where a report does not judge requirements
    model: tuple[str, str] = ("", "")  # a second verdict, on the model: in a word, and in a sentence
    document: tuple[tuple[str, str], ...] = ()  # what identifies it: label, value
