"""What a diagnosis has to say: the contents of its results.json, typed.

A residual is whitened: divided by what repeats of one trajectory differ by, channel against channel and frequency by
frequency. `over_floor` is its rms, 1 where prediction and measurement differ by no more than repeats do.
"""

from __future__ import annotations

from typing import Literal

from kbs_process.diagnosis.facts import Answer, Moved, Planned
from kbs_process.diagnosis.facts import Place as Place
from kbs_process.results.records import Check, Conclusion, Notice, Provenance, Record, ResultsFile, check_lengths


class Fitted(Record, frozen=True, kw_only=True):
    """A number of a find, refitted with all known parameters free under their priors; 95 % interval."""

    name: str
    unit: str
    value: float
    sigma: float
    low: float
    high: float


class Rival(Record, frozen=True, kw_only=True):
    """Another law for the same find."""

    name: str
    family: str
    place: Place
    distance: float  # of the two laws' predictions after the rival is refitted, sigma
    simulated: bool  # in the non-linear plant; else along the linear one
    probability: float


class Curve(Record, frozen=True, kw_only=True):
    """A law as measured: what enters at the port against the regressor that orders it."""

    regressor: str
    x_unit: str
    y_unit: str
    x: tuple[float, ...]
    y: tuple[float, ...]
    sigma: tuple[float, ...]
    fitted: tuple[float, ...] = ()  # the accepted law at x

    def __post_init__(self) -> None:
        check_lengths(self.x, self.y, self.sigma, self.fitted or self.x)


class Gated(Record, frozen=True, kw_only=True):
    """What a find does to the prediction of a recording."""

    recording: str
    role: Literal["calibration", "fit", "held-out"]
    before: float  # over floor
    after: float
    gain: float  # -2 log likelihood


class Find(Record, frozen=True, kw_only=True):
    """Physics that was left out, accepted by the gate."""

    name: str  # of the effect in the catalogue, or "measured law"
    family: str
    named: bool
    place: Place
    equation: str
    reference: str
    parameters: tuple[Fitted, ...]
    probability: float
    distance: float  # whitened distance of the signature, known parameters refitted (rho_eff)
    absorbed: float  # kappa: share that known parameters could have taken up
    rivals: tuple[Rival, ...]  # best first
    gate: tuple[Gated, ...]
    curve: Curve | None = None
    held_out_variance: float | None = None  # share of the held-out excess that it explains
    same_ports: tuple[str, ...] = ()  # that these channels cannot tell from its own


class Trial(Record, frozen=True, kw_only=True):
    """A recording's residual over the floor at each step."""

    recording: str
    trajectory: str
    role: Literal["calibration", "fit", "held-out"]
    nominal: float
    known: float  # known parameters refitted
    corrected: float  # with everything that was found
    channels: dict[str, float]  # `corrected`, channel by channel


class Unexplained(Record, frozen=True, kw_only=True):
    """What is left, as a requirement counts it: its statistic at worst, noise included."""

    name: str
    statistic: Literal["peak", "rms"]
    band_Hz: tuple[float, float]
    limit: float
    unit: str
    known: float  # known parameters refitted
    corrected: float  # with everything that was found
    channel: str  # of `corrected`, and
    recording: str

    @property
    def share(self) -> float:
        """Of the limit."""
        return self.corrected / self.limit


class PortTest(Record, frozen=True, kw_only=True):
    """Does a free input at one port suffice? And which other ports look the same from these channels?"""

    port: str
    log10_p: float
    sufficient: bool
    share: float  # of the excess that it can take up
    same_as: tuple[str, ...] = ()


class Suspect(Record, frozen=True, kw_only=True):
    """A candidate of the screen."""

    name: str
    family: str
    place: Place
    distance: float  # of its signature, known parameters refitted; of one that they absorb, without
    absorbed: float | None = None
    outcome: str  # "accepted", "refused: ...", "absorbed by ..."


class NextTest(Record, frozen=True, kw_only=True):
    """The test that would tell what these recordings leave open."""

    law: str
    rivals: tuple[str, ...]  # that it is told from; empty: its numbers are measured better
    trajectory: str
    seconds: float
    file: str  # of its commands, relative to the results folder
    distance: float | None  # of the nearest rival in one recording, known parameters refitted, sigma
    p_wrong: float | None  # with one recording
    recordings: int  # for a wrong choice in 1 of 100
    sigma: float | None  # of the least known combination of its numbers with one recording, over that of now
    tried: tuple[Planned, ...]  # best first, known parameters as they stand


class DiagnosisResults(ResultsFile, frozen=True, kw_only=True):
    """results.json of a diagnosis."""

    name: str
    title: str
    article: str
    verdict: Conclusion
    provenance: Provenance
    kind: Literal["diagnosis"] = "diagnosis"
    answer: Answer
    paragraph: str  # to be pasted into a test report
    floor: str  # where it comes from, and what it is worth
    log10_p: float  # of the mismatch that known parameters within their uncertainties leave
    moved: tuple[Moved, ...]
    finds: tuple[Find, ...]
    trials: tuple[Trial, ...]
    requirements: tuple[Unexplained, ...] = ()
    ports: tuple[PortTest, ...] = ()
    located: tuple[Place, ...] = ()  # where what no law explains enters: ports that look the same
    suspects: tuple[Suspect, ...] = ()
    checks: tuple[Check, ...] = ()
    files: tuple[str, ...] = ()  # of the corrected model, relative to the results folder
    next_test: NextTest | None = None  # where nothing is open, none
    warnings: tuple[Notice, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def model(self) -> str:
        """What the folder of the corrected model holds, in words."""
        return "Corrected model" if self.finds else "Model with its nominal parameters refitted, and nothing added"
