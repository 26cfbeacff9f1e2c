"""What an identification has to say: the contents of its results.json, typed."""

from __future__ import annotations

from typing import Literal

from kbs_process.results.records import Check, Record, ResultsFile, check_lengths


class Interval(Record, frozen=True, kw_only=True):
    """95 % interval by profile likelihood, and the points of the profile."""

    low: float
    high: float
    x: tuple[float, ...]
    D: tuple[float, ...]  # -2 log likelihood above the least

    def __post_init__(self) -> None:
        check_lengths(self.x, self.D)


class Identified(Record, frozen=True, kw_only=True):
    """One number: before, after, and what is to be known about it."""

    name: str
    unit: str
    group: Literal["critical", "gearbox", "rig"]  # the paper's five; the rest of drives and transducer; all else
    prior: float
    prior_sigma: float | None  # None: nothing was known, a phase
    value: float
    sigma: float
    interval: Interval | None
    partner: str  # the number that it is most correlated with
    correlation: float
    at_bound: bool


class Followed(Record, frozen=True, kw_only=True):
    """Where the search from one start led."""

    start_cost: float
    cost: float  # -2 log posterior
    phases: dict[str, float]  # rad


class Misfit(Record, frozen=True, kw_only=True):
    """What is unexplained of one channel of one recording, rms in units of its sensor's noise, in the fit's band."""

    recording: str
    role: Literal["fit", "held-out"]
    channel: str
    before: float
    after: float


class Correlations(Record, frozen=True, kw_only=True):
    """Correlation matrix of the estimates of drives and transducer."""

    names: tuple[str, ...]
    matrix: tuple[tuple[float, ...], ...]

    def __post_init__(self) -> None:
        check_lengths(self.names, self.matrix, *self.matrix)


class IdentifyResults(ResultsFile, frozen=True, kw_only=True):
    """results.json of an identification."""

    name: str
    title: str
    article: str
    kind: Literal["identify"] = "identify"
    band_Hz: tuple[float, float]
    samples: int  # numbers in the whitened residual
    misfit_rms: float  # of it, with the sensors' noise: 1 if all is explained
    run_to_run: float
    parameters: tuple[Identified, ...]
    starts: tuple[Followed, ...]
    checks: tuple[Check, ...]
    misfits: tuple[Misfit, ...]
    correlations: Correlations
    files: tuple[str, ...]  # corrected parameter files, relative to the results folder
    notes: tuple[str, ...] = ()
