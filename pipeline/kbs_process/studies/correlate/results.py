"""What a processed campaign has to say: the contents of its results.json, typed.

These records are the contract between the pipeline, which fills them, and the report, which shows
them; schemas/results.schema.json is generated from them (`python -m kbs_process.studies correlation`).
"""

from __future__ import annotations

from typing import Literal

import msgspec

from kbs_process.results.judged import Budget, Frame, Requirement, Soundness
from kbs_process.results.pointing import JudgedPointing, RecordedPointing
from kbs_process.results.records import Check, Constant, InputFile, Record, ResultsFile, check_lengths
from kbs_process.signals.records import Loss
from kbs_process.stages import compare
from kbs_process.stages.conventions import SignCheck

Role = Literal["calibration", "fit", "held-out"]


class CampaignSummary(Record, frozen=True, kw_only=True):
    """Which campaign this is."""

    name: str
    title: str
    article: str
    configuration: str
    drive: Literal["command", "motion"]  # what drives the plant: the commands, or the measured angles
    frame: Frame = "T"  # of the loads that were recorded
    sources: tuple[InputFile, ...] = ()  # the loggers' files that recordings were imported from


class DocumentHead(Record, frozen=True, kw_only=True):
    """What identifies the report as a document; empty where nobody says."""

    number: str = ""
    revision: str = ""
    operator: str = ""
    serial_number: str = ""  # of the article
    date: str = ""  # of the test


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
    losses: tuple[Loss, ...] = ()
    clocks: tuple[Clock, ...] = ()

    @property
    def lost(self) -> tuple[Loss, ...]:
        """Losses without what was merely put in order."""
        return tuple(loss for loss in self.losses if loss.real)


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


class SixChannels(Record, frozen=True, kw_only=True):
    """The article's torque at the spacecraft from all six channels of one recording at once, in one band."""

    recording: str
    band: str
    chi_square: float  # of a degree of freedom
    explained: bool  # by rigid bodies, floor and budget
    peak: dict[str, float]  # by torque channel, N m
    sigma: dict[str, float]  # of every instant


class RigForce(Record, frozen=True, kw_only=True):
    """What forces of the rig that files describe exert on one channel at rest, in one band; it was taken off."""

    recording: str
    band: str
    frame: Frame
    channel: str
    unit: str
    rms: float


class Rung(Record, frozen=True, kw_only=True):
    """What the gravity model leaves below 0.3 Hz of the fitted recordings, with this part and those before it."""

    name: str
    rms: dict[str, float]  # by channel
    peak: dict[str, float]


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
    ladder: tuple[Rung, ...] = ()


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

    def __post_init__(self) -> None:
        check_lengths(self.channels, self.matrix, *self.matrix, self.sigma, *self.sigma)


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


# Predictions that explain less of the measured variance than this do not describe it.
WEAK = 0.5


class Merit(compare.Merit, frozen=True, kw_only=True):
    """Figures of merit of a prediction on one channel of one recording, in one band."""

    recording: str
    role: Role
    band: str
    frame: Frame
    sigma: float | None = None  # of the measured channel in this band

    @property
    def at_the_noise(self) -> bool:
        """Whether there is too little signal for these figures to say anything of the prediction."""
        return self.sigma is not None and self.measured_rms is not None and self.measured_rms < 2.0 * self.sigma

    @property
    def testable(self) -> bool:
        """Whether the measured disturbance, or a predicted one, would show above its uncertainty."""
        return self.sigma is not None and max(self.measured_rms or 0.0, self.predicted_rms or 0.0) >= 2.0 * self.sigma

    @property
    def correlated(self) -> bool:
        """Whether the prediction explains half of the measured variance, or errs by no more than the uncertainty."""
        within = self.sigma is not None and (self.residual_rms or 0.0) <= 2.0 * self.sigma
        return within or (self.fraction_of_variance or 0.0) >= WEAK


class ModelVerdict(Record, frozen=True, kw_only=True):
    """Does the model predict what was measured? In a word, and in a sentence."""

    status: Literal["correlated", "not correlated", "not testable"]
    sentence: str


class Resonance(Record, frozen=True, kw_only=True):
    """A resonance of the article on the transducer."""

    axis: str
    frequency_Hz: float
    source: str
    sigma_Hz: float | None = None


class ModeAt(Record, frozen=True, kw_only=True):
    """A mode of the article on the transducer at one pose."""

    angle_rad: float
    frequency_Hz: float
    frequency_sigma_Hz: float
    damping: float  # of critical
    damping_sigma: float
    effective: tuple[float, float, float]  # kg m^2, effective moments of inertia about T's x, y, z


class GainAt(Record, frozen=True, kw_only=True):
    """Torque that the transducer reads over torque on a rigid base, at one pose and frequency."""

    angle_rad: float
    frequency_Hz: float
    channel: str
    gain: float
    sigma: float


class FilterErrorIn(Record, frozen=True, kw_only=True):
    """What the resonance adds to one channel of the predicted disturbance, in one band and frame."""

    band: str
    frame: Literal["T", "S"]
    channel: str
    unit: str
    rigid_rms: float  # on a rigid base
    rigid_peak: float
    read_rms: float  # on the transducer
    read_peak: float
    error_rms: float  # of the one less the other
    error_rms_sigma: float
    error_peak: float
    error_peak_sigma: float
    leak_rms: float  # the error's part above the band's upper edge


class BothWays(Record, frozen=True, kw_only=True):
    """The coupled plant against the rigid-base wrench through the modes, on one channel in one band, frame T."""

    band: str
    channel: str
    unit: str
    coupled_rms: float
    modal_rms: float
    rigid_rms: float
    difference_rms: float  # coupled less modal
    noise_rms: float  # of the sensor in this band


class OnTransducer(Record, frozen=True, kw_only=True):
    """The study of one recording; `reason` says why there is none."""

    recording: str
    joint: str = ""
    source: str = ""  # of the modes
    reason: str = ""
    modes: tuple[ModeAt, ...] = ()
    gains: tuple[GainAt, ...] = ()
    errors: tuple[FilterErrorIn, ...] = ()
    agreement: tuple[BothWays, ...] = ()


class OrderPeak(Record, frozen=True, kw_only=True):
    """A load that is periodic in a joint's angle."""

    channel: str
    unit: str
    order: float  # cycles in a turn of the joint
    measured: float | None  # amplitude; None: below the noise's threshold
    sigma: float  # of it, by the noise
    predicted: float | None  # amplitude at the same order; None: nothing was predicted
    known: tuple[str, ...] = ()  # what the rig's description has at this order
    fixed: bool = False  # the rate varies too little to tell the order from a fixed frequency


class OrdersIn(Record, frozen=True, kw_only=True):
    """What of one recording goes with one joint's angle, at the transducer."""

    recording: str
    joint: str
    windows: int
    window_rad: float  # of the joint's travel
    resolution: float  # width of a line
    lowest: float  # order of which a window holds few periods
    highest: float  # that the samples, or the angle's uncertainty, show at the slowest window's rate
    by_angle: bool  # the angle's uncertainty sets it
    band_Hz: float
    rates: tuple[float, float]  # rad/s, least and greatest mean of a window
    false_alarm: float  # probability that chance makes one of the peaks
    peaks: tuple[OrderPeak, ...] = ()
    above: dict[str, float] = msgspec.field(default_factory=dict)  # known orders beyond `highest`


class InstrumentChannel(Record, frozen=True, kw_only=True):
    """What one axis of an accelerometer or gyro reads in a recording, beside the motion; rms about the means."""

    recording: str
    instrument: str
    channel: str  # axis
    unit: str
    zero: float  # mean of measured less encoders
    measured: float
    encoders: float  # by their motion
    encoders_left: float  # measured less that
    predicted: float | None
    predicted_left: float | None
    noise: float  # of measured, as stated


class Results(ResultsFile, frozen=True, kw_only=True):
    """results.json."""

    campaign: CampaignSummary
    kind: Literal["correlation"] = "correlation"
    document: DocumentHead = DocumentHead()
    model: ModelVerdict | None = None  # None: nothing was predicted
    requirements: tuple[Requirement, ...] = ()
    judged_pointing: tuple[JudgedPointing, ...] = ()
    recordings: tuple[Recording, ...] = ()
    conventions: tuple[SignCheck, ...] = ()
    soundness: Soundness = Soundness()
    gravity: Gravity | None = None
    cross_coupling: CrossCoupling | None = None
    bands: tuple[Band, ...] = ()
    repeatability: tuple[Repeatability, ...] = ()
    merit: tuple[Merit, ...] = ()
    resonances: tuple[Resonance, ...] = ()
    transducer: OnTransducer | None = None
    orders: tuple[OrdersIn, ...] = ()
    budget: tuple[Budget, ...] = ()
    six_channels: tuple[SixChannels, ...] = ()
    rig_forces: tuple[RigForce, ...] = ()
    pointing: tuple[RecordedPointing, ...] = ()
    instruments: tuple[InstrumentChannel, ...] = ()
    methods: str = ""  # paragraphs, separated by empty lines
    parameters: tuple[Constant, ...] = ()
    notes: tuple[str, ...] = ()  # assumptions to be said aloud: how torques were moved to S, for one
