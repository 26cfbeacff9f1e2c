"""Requirements as judged, and the uncertainty budgets that they are judged by: records of results.json."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import msgspec

from kbs_process.results.records import Record

Verdict = Literal["pass", "fail", "undecided"]
Frame = Literal["T", "S", "joint"]  # the transducer's, the spacecraft's, or the joints' own, of their efforts
Statistic = Literal["peak", "rms"]
WRONG = "the model of this rig is wrong"


class ChannelResult(Record, frozen=True, kw_only=True):
    """A requirement's statistic on one channel, over all recordings that count."""

    channel: str
    value: float | None  # measured, in the requirement's unit
    sigma: float | None
    predicted: float | None
    recording: str | None  # where the measured value occurs
    time_s: float | None
    low: float | None = None  # the true one lies between low and high, at 95 %
    high: float | None = None


class Way(Record, frozen=True, kw_only=True):
    """A statistic at the spacecraft in two ways, each with the interval that holds the true one at 95 %."""

    recording: str
    channel: str
    moved: tuple[float, float, float]  # value, low, high: by the measured forces
    together: tuple[float, float, float]  # by all six channels at once
    agree: bool  # the second counts; else the worse does


class Requirement(Record, frozen=True, kw_only=True):
    """A requirement and what was found: the worst recording and channel decide."""

    name: str
    quantity: Literal["torque", "force"]
    frame: Frame
    statistic: Statistic
    band: str  # name of a Band
    band_Hz: tuple[float | None, float | None]  # None: open on that side
    limit: float
    unit: str
    value: float | None  # measured
    sigma: float | None
    margin: float | None  # limit less value, in `unit`
    verdict: Verdict
    recording: str | None = None
    channel: str | None = None
    time_s: float | None = None
    predicted_value: float | None = None  # the same statistic of the prediction
    predicted_sigma: float | None = None
    channels: tuple[ChannelResult, ...] = ()
    source: str = ""
    low: float | None = None  # the true value lies between low and high, at 95 %
    high: float | None = None
    doubt: str = ""  # why it is undecided, whatever the figures are
    mute: tuple[str, ...] = ()  # channels that no recording shows to respond
    untested: bool = False  # whether no load tests the sign and axis of any channel
    axes: tuple[str, ...] = ("x", "y", "z")  # that it is about
    left_out: str = ""  # what the campaign leaves out of all this, and the figure of that
    together: bool = False  # whether the value is that of all six channels at once
    ways: tuple[Way, ...] = ()  # by recording and channel, where rigid bodies explain all six
    only_without: bool = False  # whether it is met, and what is left out would not be, or is not known to be
    lever_m: float | None = None  # from the transducer to the point about which torques are judged, elsewhere


class Beyond(Record, frozen=True, kw_only=True):
    """A fitted number that is further from what was known of it than chance allows."""

    name: str
    unit: str
    prior: float
    prior_sigma: float
    value: float
    distance: float  # value less prior, in standard deviations of such differences


@dataclass(frozen=True, slots=True)
class Doubt:
    """Why a requirement cannot be judged, and whether "not met" is in doubt as well as "met"."""

    why: str
    of_failed: bool = True


class Soundness(Record, frozen=True, kw_only=True):
    """Is the model of the rig right? What was fitted against what was known."""

    sound: bool = True
    probability: float = 1.0  # that chance alone moves all fitted numbers so far
    beyond: tuple[Beyond, ...] = ()  # the farthest first
    reasons: tuple[str, ...] = ()
    suggestions: tuple[str, ...] = ()  # simple faults, each of which explains the data alone
    gains: dict[str, float] = msgspec.field(default_factory=dict)  # by channel: relative sigma, by gravity alone
    calibrated: bool = True  # the calibrations by themselves agree with what was known


class BudgetItem(Record, frozen=True, kw_only=True):
    """One stage's part in a channel's uncertainty."""

    stage: str
    source: str
    sigma: float
    grows: bool = False  # with what is read: at a peak it is more than over the recording


class Budget(Record, frozen=True, kw_only=True):
    """The uncertainty budget of one channel of a recording in one band; `total` is the root sum of squares."""

    channel: str
    unit: str
    frame: Frame
    band: str
    contributions: tuple[BudgetItem, ...]
    total: float
    recording: str | None = None  # None: of all recordings alike

    def part(self, source: str) -> float:
        """Return what one source contributes, one sigma; zero where it does not."""
        return next((item.sigma for item in self.contributions if item.source == source), 0.0)
