"""What a comparison has to say: the contents of its results.json, typed. Sequences are in the order of `compared`."""

from __future__ import annotations

from math import comb
from statistics import NormalDist
from typing import Literal

from kbs_process.results.judged import Frame, Statistic, Verdict
from kbs_process.results.records import Record, ResultsFile, Status

FAR = 3.0  # standard deviations of such differences, beyond which two numbers are said to differ


class Compared(Record, frozen=True, kw_only=True):
    """One folder of results."""

    mark: str  # what figures and tables call it: A, B, ...
    folder: str
    name: str
    title: str
    article: str
    number: str = ""  # of the document
    revision: str = ""
    date: str  # of the test
    made_by: str  # version and commit of the program
    status: Status
    sentence: str
    model: str  # correlated, not correlated, not testable; "" where nothing was predicted
    chi_square: float | None = None  # of a degree of freedom: what gravity leaves over what its uncertainty explains
    page: str = ""  # of its report, relative to that of the comparison


class Judged(Record, frozen=True, kw_only=True):
    """One requirement in all results; None where they do not judge it."""

    name: str
    statistic: Statistic
    frame: Frame
    band_Hz: tuple[float | None, float | None]
    limit: float
    unit: str
    verdict: tuple[Verdict | None, ...]
    value: tuple[float | None, ...]
    low: tuple[float | None, ...]  # the true value lies between low and high, at 95 %
    high: tuple[float | None, ...]
    predicted: tuple[float | None, ...]
    residual: tuple[float | None, ...]  # rms of measured less predicted, of that channel in that recording
    channel: tuple[str | None, ...]  # that decides, and
    recording: tuple[str | None, ...]


class Number(Record, frozen=True, kw_only=True):
    """One fitted number in all results; None where they did not fit it."""

    name: str
    unit: str
    value: tuple[float | None, ...]
    sigma: tuple[float | None, ...]
    distance: float | None  # of the two that differ most, in standard deviations of such differences
    determined: bool  # whether recordings say more of it than the parameter files, in one of the results


def far(results: int) -> float:
    """How many standard deviations the greatest difference exceeds as rarely as that of two results exceeds FAR."""
    normal = NormalDist()
    return -normal.inv_cdf(normal.cdf(-FAR) / comb(results, 2))


class ComparisonResults(ResultsFile, frozen=True, kw_only=True):
    """results.json of a comparison."""

    kind: Literal["comparison"] = "comparison"
    compared: tuple[Compared, ...]  # in the order of their tests' dates, as far as these are known
    requirements: tuple[Judged, ...]
    numbers: tuple[Number, ...]  # those that differ most first
