"""What the transducer's resonance does to what is read in a band: part of the correlation report's results."""

from __future__ import annotations

from typing import Literal

from kbs_process.results.records import Record


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
