"""What accelerometer and gyro read, beside what encoders and model say of the motion where they are."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from kbs_process.campaign.config import Campaign
from kbs_process.plant.inertial import reading
from kbs_process.plant.rigid import kinematics
from kbs_process.reduction.analysis import Analysis
from kbs_process.reduction.settings import motion_settings
from kbs_process.results.records import Notice
from kbs_process.rig.model import Rig
from kbs_process.signals.records import Array, Mask, Run, Signal
from kbs_process.signals.smoothing import kernel_length, smooth
from kbs_process.stages.motion import estimate
from kbs_process.studies.correlate.results import InstrumentChannel

_ALIKE = 0.2  # of the motion's size: an instrument that differs by less has the unit that its topic says
_TURNED = 0.9  # cosine between readings and motion, below which axes or signs are others
_CLEAR = 5.0  # times its own noise: less motion does not test an instrument
_UNITS = {"g": 1.0 / 9.80665, "deg/s": float(np.degrees(1.0)), "mm/s^2 or mrad/s": 1e3}


@dataclass(frozen=True, slots=True, eq=False)
class Beside:
    """One instrument in one recording, (n, 3) each in its own axes, below the corner of the motion."""

    recording: str
    stream: str
    signal: Signal
    measured: Array
    encoders: Array
    predicted: Array | None
    noise: float  # rms of `measured`, as the parameter files state it
    valid: Mask

    def findings(self) -> Iterator[InstrumentChannel]:
        """Yield what is said of each channel: rms about the means, which hold zeros and what gravity does not tell."""

        def rms(x: Array) -> float:
            return float(np.std(x[self.valid]))

        for i, channel in enumerate(self.signal.channels):
            measured, encoders = self.measured[:, i], self.encoders[:, i]
            predicted = None if self.predicted is None else self.predicted[:, i]
            yield InstrumentChannel(
                recording=self.recording,
                instrument=self.stream,
                channel=channel,
                unit=self.signal.units[i],
                zero=float(np.mean((measured - encoders)[self.valid])),
                measured=rms(measured),
                encoders=rms(encoders),
                encoders_left=rms(measured - encoders),
                predicted=None if predicted is None else rms(predicted),
                predicted_left=None if predicted is None else rms(measured - predicted),
                noise=self.noise,
            )

    def columns(self) -> dict[str, Array | Mask]:
        """Return the table of the histories."""
        found: dict[str, Array | Mask] = {"t": self.signal.t, "valid": self.valid}
        for i, channel in enumerate(self.signal.channels):
            found |= {f"{channel}.measured": self.measured[:, i], f"{channel}.encoders": self.encoders[:, i]}
            found |= {} if self.predicted is None else {f"{channel}.predicted": self.predicted[:, i]}
        return found


def study(campaign: Campaign, analyses: Sequence[Analysis], rig: Rig) -> Iterator[Beside]:
    """Yield each instrument of each recording; `rig` has the fitted parameters."""
    band = motion_settings(campaign).band_Hz
    undelayed = replace(rig, transducer=replace(rig.transducer, amplifier=None))  # of the wrench, not of these
    for analysis in analyses:
        run = analysis.run
        recorded = {"accelerometer": run.accelerometer, "gyro": run.gyro}
        there = {key: signal for key, signal in recorded.items() if signal is not None}
        if not there:
            continue
        moved = _readings(campaign, run, undelayed)
        foreseen = None if analysis.predicted is None else _readings(campaign, analysis.predicted, undelayed)
        for key, signal in there.items():
            kept = min(1.0, 2.0 * 1.5 * band / run.rates[key])  # of white noise, by the low-pass
            n, edge = len(signal), kernel_length(band, signal.dt)
            inside = np.arange(n)
            yield Beside(
                recording=analysis.entry.name,
                stream=key,
                signal=signal,
                measured=smooth(signal.values, signal.dt, band),
                encoders=moved[key][:n],
                predicted=None if foreseen is None else _as_long(foreseen[key], n),
                noise=float(rig.instruments[key].noise) * kept**0.5,
                valid=signal.valid & (inside >= edge) & (inside < n - edge),
            )


def _as_long(x: Array, n: int) -> Array:
    return np.concatenate([x, np.repeat(x[-1:], max(0, n - len(x)), axis=0)])[:n]


def _readings(campaign: Campaign, run: Run, rig: Rig) -> dict[str, Array]:
    motion = estimate(run, rig, motion_settings(campaign))
    links = kinematics(rig, motion.q, motion.qd, motion.qdd)
    return {key: reading(links[one.on], one) for key, one in rig.instruments.items()}


def notices(found: Sequence[Beside]) -> Iterator[Notice]:
    """Yield what an instrument's readings say of its unit and its axes, by all recordings."""
    for key in dict.fromkeys(one.stream for one in found):
        own = [one for one in found if one.stream == key]
        measured = np.concatenate([one.measured[one.valid] for one in own])
        moved = np.concatenate([one.encoders[one.valid] for one in own])
        size, motion = (float(np.linalg.norm(x)) for x in (measured, moved))
        if motion < _CLEAR * max(one.noise for one in own) * np.sqrt(measured.size):
            continue
        ratio, cosine = size / motion, float(np.sum(measured * moved) / max(size * motion, 1e-300))
        what = ""
        if not 1.0 - _ALIKE < ratio < 1.0 / (1.0 - _ALIKE):
            like = [unit for unit, factor in _UNITS.items() if abs(ratio / factor - 1.0) < _ALIKE]
            what = f"reads {ratio:.3g} times what the encoders' motion makes there"
            what += f", as if in {like[0]}" if like else ""
            remedy = f"convert its readings to {own[0].signal.units[0]}"
        elif cosine < _TURNED:
            what = f"reads other directions than the encoders' motion has (cosine {cosine:.2f})"
            remedy = f"check {key}.attitude, {key}.on and the order of its fields"
        if what:
            yield Notice(severity="warning", what=f"the {key} {what}", where=own[0].recording, remedy=remedy)


def units(one: Beside) -> Mapping[str, str]:
    """Return the units of the table's columns."""
    unit = one.signal.units[0]
    return {name: "s" if name == "t" else unit for name in one.columns() if name != "valid"}
