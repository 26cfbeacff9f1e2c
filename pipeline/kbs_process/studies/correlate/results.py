"""What a processed campaign has to say: the contents of its results.json, typed.

These records are the contract between the pipeline, which fills them, and the report, which shows
them; schemas/results.schema.json is generated from them (`python -m kbs_process.studies correlation`).
"""

from __future__ import annotations

from typing import Literal

import msgspec

from kbs_process.results.judged import Budget as Budget
from kbs_process.results.judged import BudgetItem as BudgetItem
from kbs_process.results.judged import ChannelResult as ChannelResult
from kbs_process.results.judged import Frame as Frame
from kbs_process.results.judged import Requirement as Requirement
from kbs_process.results.judged import Verdict as Verdict
from kbs_process.results.pointing import RecordedPointing
from kbs_process.results.records import Check as Check
from kbs_process.results.records import Conclusion as Conclusion
from kbs_process.results.records import Constant as Constant
from kbs_process.results.records import InputFile as InputFile
from kbs_process.results.records import Notice as Notice
from kbs_process.results.records import Provenance as Provenance
from kbs_process.results.records import Record as Record
from kbs_process.results.records import ResultsFile
from kbs_process.results.records import encode as encode
from kbs_process.signals.records import PUT_IN_ORDER
from kbs_process.studies.correlate.on_transducer import OnTransducer

Role = Literal["calibration", "fit", "held-out"]


class CampaignSummary(Record, frozen=True, kw_only=True):
    """Which campaign this is."""

    name: str
    title: str
    article: str
    configuration: str
    drive: Literal["command", "motion"]  # what drives the plant: the commands, or the measured angles
    frame: Frame = "T"  # of the loads that were recorded


class LossEntry(Record, frozen=True, kw_only=True):
    """Samples or messages that a recording lacks, holds twice, or holds damaged."""

    kind: str
    where: str
    count: int
    start_s: float | None = None
    end_s: float | None = None
    detail: str = ""


class Clock(Record, frozen=True, kw_only=True):
    """A stream's sensor clock against the recording's time axis: t = stamp (1 + skew) + offset."""

    stream: str
    offset_s: float
    skew: float  # s/s
    sigma_s: float | None = None


class Recording(Record, frozen=True, kw_only=True):
    """One recording, as it was read."""

    name: str  # the stem of its tables
    file: str
    trajectory: str
    role: Role
    repeat: int
    sha256: str
    duration_s: float
    rates: dict[str, float] = msgspec.field(default_factory=dict)  # Hz, by stream
    losses: tuple[LossEntry, ...] = ()
    clocks: tuple[Clock, ...] = ()

    @property
    def lost(self) -> tuple[LossEntry, ...]:
        """Losses without what was merely put in order."""
        return tuple(loss for loss in self.losses if loss.kind != PUT_IN_ORDER)


class Convention(Record, frozen=True, kw_only=True):
    """A self-test of signs and frames on this campaign's own data."""

    check: str
    expected: str
    found: str
    ok: bool


class FittedParameter(Record, frozen=True, kw_only=True):
    """A parameter before (prior) and after a fit."""

    name: str
    unit: str
    prior: float | None
    prior_sigma: float | None
    value: float
    sigma: float


class GravityChannel(Record, frozen=True, kw_only=True):
    """How much gravity there was on a channel, and how much of it is left."""

    channel: str
    unit: str
    static_peak: float | None  # greatest magnitude of the static model
    residual_rms: float | None  # measured less static
    encoder_sigma: float | None  # of the static wrench, from the angles' uncertainty
    model_sigma: float | None = None  # of the static wrench, from the fitted parameters' covariance


class StaticChannel(Record, frozen=True, kw_only=True):
    """A channel of one recording: its taring, and what the model leaves next to what its uncertainty explains."""

    channel: str
    unit: str
    constant: float
    sigma: float
    left: float  # rms below the fit's low-pass
    explained: float
    ok: bool


class StaticRecording(Record, frozen=True, kw_only=True):
    """How one recording was tared, and how well the gravity model describes it."""

    recording: str
    fitted: bool  # the constants are the fit's; else they were estimated with the model held
    channels: tuple[StaticChannel, ...]


class Gravity(Record, frozen=True, kw_only=True):
    """The gravity (and where identified, inertia) fit."""

    parameters: tuple[FittedParameter, ...]
    channels: tuple[GravityChannel, ...]
    checks: tuple[Check, ...] = ()
    samples: int = 0
    reduced_chi_square: float | None = None
    feasible: str = ""  # a sentence: is computed gravity compensation feasible?
    recordings: tuple[StaticRecording, ...] = ()
    low_pass_Hz: float | None = None  # below which the model was fitted


class Contribution(Record, frozen=True, kw_only=True):
    """A standard deviation or rms that one cause contributes to one channel."""

    channel: str
    unit: str
    value: float


class CrossCoupling(Record, frozen=True, kw_only=True):
    """raw = (I + matrix) wrench: rows are raw channels, columns true ones; SI units by channel pair."""

    channels: tuple[str, ...]
    matrix: tuple[tuple[float, ...], ...]
    sigma: tuple[tuple[float, ...], ...]
    largest: str  # a sentence: the largest coupling and its effect
    contributions: tuple[Contribution, ...] = ()  # rms taken away from each channel


class Band(Record, frozen=True, kw_only=True):
    """A frequency band and how it was cut out."""

    name: str  # as in the tables' file names
    label: str
    high_pass_Hz: float | None
    low_pass_Hz: float | None
    method: str
    edge_s: float = 0.0  # at each end, where the filter's transient exceeds `edge_error`
    edge_error: float | None = None  # relative to the signal, whose spectrum is flat
    edge_error_drift: float | None = None  # relative to a signal that drifts like a random walk


class Repeatability(Record, frozen=True, kw_only=True):
    """Signal and noise of one channel over the repeats of a trajectory, rms in `unit`."""

    trajectory: str
    band: str
    frame: Frame
    channel: str
    unit: str
    signal_rms: float | None
    noise_rms: float | None
    ratio: float | None
    n: int


class Merit(Record, frozen=True, kw_only=True):
    """Figures of merit of a prediction on one channel of one recording, in one band."""

    recording: str
    role: Role
    band: str
    frame: Frame
    channel: str
    unit: str
    measured_rms: float | None
    predicted_rms: float | None
    residual_rms: float | None
    measured_peak: float | None
    predicted_peak: float | None
    correlation: float | None
    fraction_of_variance: float | None  # 1 - var(measured - predicted) / var(measured)
    spectral_ratio: float | None  # predicted over measured power density, geometric mean over the band
    pessimism: float | None  # predicted over measured peak
    sigma: float | None = None  # of the measured channel in this band

    @property
    def at_the_noise(self) -> bool:
        """Whether there is too little signal for these figures to say anything of the prediction."""
        return self.sigma is not None and self.measured_rms is not None and self.measured_rms < 2.0 * self.sigma


class Resonance(Record, frozen=True, kw_only=True):
    """A resonance of the article on the transducer."""

    axis: str
    frequency_Hz: float
    source: str
    sigma_Hz: float | None = None


class Results(ResultsFile, frozen=True, kw_only=True):
    """results.json."""

    campaign: CampaignSummary
    verdict: Conclusion
    provenance: Provenance
    kind: Literal["correlation"] = "correlation"
    requirements: tuple[Requirement, ...] = ()
    warnings: tuple[Notice, ...] = ()
    recordings: tuple[Recording, ...] = ()
    conventions: tuple[Convention, ...] = ()
    gravity: Gravity | None = None
    cross_coupling: CrossCoupling | None = None
    bands: tuple[Band, ...] = ()
    repeatability: tuple[Repeatability, ...] = ()
    merit: tuple[Merit, ...] = ()
    resonances: tuple[Resonance, ...] = ()
    transducer: OnTransducer | None = None
    budget: tuple[Budget, ...] = ()
    pointing: tuple[RecordedPointing, ...] = ()
    methods: str = ""  # paragraphs, separated by empty lines
    parameters: tuple[Constant, ...] = ()
    notes: tuple[str, ...] = ()  # assumptions to be said aloud: how torques were moved to S, for one
