"""What a flight prediction has to say: the contents of its results.json, typed."""

from __future__ import annotations

from typing import Literal

from kbs_process.results.records import Constant, Record, ResultsFile


class Likelihood(Record, frozen=True, kw_only=True):
    """A probability with its 95 % interval."""

    value: float
    low: float
    high: float


class Distribution(Record, frozen=True, kw_only=True):
    """A statistic of one channel over all samples; the bound holds 95 % of all units with 95 % confidence."""

    channel: str
    nominal: float  # with every parameter at its value
    mean: float
    median: float
    q05: float
    q95: float
    greatest: float
    bound: float | None  # None: too few samples


class FlightRequirement(Record, frozen=True, kw_only=True):
    """A requirement and the probability that a flight unit meets it on every channel."""

    name: str
    quantity: Literal["torque", "force", "pointing"]
    frame: str
    statistic: str
    band_Hz: tuple[float | None, float | None]  # None: open on that side
    limit: float
    unit: str
    source: str
    meets: Likelihood
    channels: tuple[Distribution, ...]
    worst: Distribution  # of the greatest over the channels


class Driver(Record, frozen=True, kw_only=True):
    """An uncertain number and the share of the variance of a requirement's statistic that it explains."""

    name: str
    unit: str
    value: float
    sigma: float
    requirement: str
    share: float


class FlightResults(ResultsFile, frozen=True, kw_only=True):
    """results.json of a flight prediction."""

    name: str
    title: str
    article: str
    kind: Literal["flight"] = "flight"
    trajectory: str
    duration_s: float
    samples: int
    failed: int  # samples that could not be simulated
    seed: int
    by_chance: float  # share that a number without effect exceeds with 5 % probability
    requirements: tuple[FlightRequirement, ...] = ()
    drivers: tuple[Driver, ...] = ()
    parameters: tuple[Constant, ...] = ()
    notes: tuple[str, ...] = ()  # what the prediction assumes
