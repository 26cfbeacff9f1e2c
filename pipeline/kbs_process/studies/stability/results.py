"""What a stability analysis has to say: the contents of its results.json, typed."""

from __future__ import annotations

from typing import Literal

from kbs_process.results.records import Constant, Record, ResultsFile, check_lengths


class LoopMargins(Record, frozen=True, kw_only=True):
    """Margins of one joint's loop at one pose, the other loops closed; None: there is no such crossing."""

    angle_rad: float  # of the swept joint
    joint: str
    gain: float | None  # factor on Kp and Ki
    gain_frequency_Hz: float | None
    phase_rad: float | None
    phase_frequency_Hz: float | None
    sensitivity_peak: float
    sensitivity_frequency_Hz: float


class CriticalAt(Record, frozen=True, kw_only=True):
    """The factor on all joints' gains at which the linear loop loses stability; None: none was found."""

    angle_rad: float
    factor: float | None
    frequency_Hz: float | None
    at_rest: float | None  # the same with the slopes that friction has at standstill


class Boundary(Record, frozen=True, kw_only=True):
    """A point of the stability boundary in the plane of both gains, at the pose that has the least margin."""

    integral_weight: float  # factor on Ki over factor on Kp
    proportional: float  # factor on Kp
    integral: float  # factor on Ki


class OnsetAt(Record, frozen=True, kw_only=True):
    """Onset found by simulation beside the predicted one."""

    angle_rad: float
    integral_weight: float
    friction: bool  # friction, cogging and encoder rounding in the simulation
    predicted: float
    found: float | None  # None: nothing diverged
    half_width: float | None
    frequency_Hz: float | None


class LimitCycle(Record, frozen=True, kw_only=True):
    """What is left of a kick in the last 10 s of a simulation with friction and encoder rounding."""

    factor: float
    share_of_critical: float
    rms_rad: float
    frequency_Hz: float


class Sensitivity(Record, frozen=True, kw_only=True):
    """How an uncertain parameter moves the critical factor, to first order."""

    name: str
    sigma_of_factor: float


class StabilityResults(ResultsFile, frozen=True, kw_only=True):
    """results.json of a stability analysis."""

    name: str
    title: str
    article: str
    joint: str  # that is swept
    cycle_s: float
    latency: int
    loop: Literal["open", "closed"]  # as the campaign was run
    Kp: tuple[float, ...]
    Ki: tuple[float, ...]
    joints: tuple[str, ...]
    worst_angle_rad: float
    worst_sigma: float  # of the critical factor there
    kick_rad: float
    encoder_step_rad: float
    kind: Literal["stability"] = "stability"
    margins: tuple[LoopMargins, ...] = ()
    critical: tuple[CriticalAt, ...] = ()
    boundary: tuple[Boundary, ...] = ()
    onsets: tuple[OnsetAt, ...] = ()
    limit_cycles: tuple[LimitCycle, ...] = ()
    sensitivities: tuple[Sensitivity, ...] = ()
    parameters: tuple[Constant, ...] = ()

    def __post_init__(self) -> None:
        check_lengths(self.joints, self.Kp, self.Ki)
