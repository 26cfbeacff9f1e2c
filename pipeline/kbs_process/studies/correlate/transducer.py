"""On the transducer both ways: the coupled plant, and the rigid-base wrench through a modal model."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from scipy.signal import welch

from kbs_process.campaign.config import Campaign
from kbs_process.campaign.modal_file import read_modal
from kbs_process.plant.laws import select
from kbs_process.plant.linear.modal import ModalTable, derive
from kbs_process.plant.rigid import static_wrench
from kbs_process.reduction.analysis import Analysis, bands_of
from kbs_process.reduction.predicting import predict_run
from kbs_process.reduction.relief import forces_in, without_forces
from kbs_process.rig.model import Rig
from kbs_process.signals.grid import overlap
from kbs_process.signals.records import WRENCH_CHANNELS, WRENCH_UNITS, Array, Signal
from kbs_process.stages import bandpass
from kbs_process.stages.align.condense import CondenseSettings
from kbs_process.stages.bandpass import UNFILTERED
from kbs_process.stages.budget import sensor_noise
from kbs_process.stages.motion import estimate
from kbs_process.stages.resonance import Transmitted, amplification, filter_errors, transmit
from kbs_process.stages.to_cog import to_spacecraft
from kbs_process.studies.correlate.results import BothWays, FilterErrorIn, GainAt, ModeAt, OnTransducer

SPACING = np.radians(2.5)  # of the poses at which modes are derived
STILL = np.radians(5.0)  # a joint that turns by no more leaves the modes as they are
TORQUES = ("Tx", "Ty", "Tz")
SEGMENT_S = 51.2  # of the spectra: lines 0.04 Hz wide


@dataclass(frozen=True, slots=True, eq=False)
class Study:
    """What is said of a recording, and the curves behind it."""

    findings: OnTransducer
    gains: dict[str, Array]  # columns of a table: f, and for each pose and torque the gain
    spectra: dict[str, Array]  # columns of a table: f, and of each torque on a rigid base, through the modes, coupled


def rigid_base(rig: Rig) -> Rig:
    """Return the rig on a transducer that does not give."""
    return replace(rig, transducer=replace(rig.transducer, stiffness=None, damping=None))


def study(campaign: Campaign, analyses: Sequence[Analysis], rig: Rig, update: Callable[[float], None]) -> Study | None:
    """Study the first recording that has a prediction; None without one, or on a rigid transducer.

    `rig` has the masses and CoGs that the gravity fit found.
    """
    first = next((one for one in analyses if one.predicted is not None), None)
    if first is None or rig.transducer.stiffness is None:
        return None
    name = first.entry.name
    table, reason = _table(campaign, rig, first.motion.q)
    if table is None:
        return Study(OnTransducer(recording=name, reason=reason), {}, {})
    load, angles = _disturbance(campaign, rigid_base(rig), first, update)
    angle = angles[:, rig.joint_names.index(table.joint)]
    found = transmit(load, angle, table)
    poses = np.unique([angle.min(), 0.5 * (angle.min() + angle.max()), angle.max()])
    findings = OnTransducer(
        recording=name,
        joint=table.joint,
        source=table.source,
        modes=tuple(_modes(table, poses)),
        gains=tuple(_gains(table, poses, campaign.bands.low_pass)),
        errors=tuple(_errors(campaign, found)),
        agreement=tuple(_agreement(campaign, first, found)),
    )
    return Study(findings, _gain_curves(table, poses, load.dt), _spectra(first, found))


def _table(campaign: Campaign, rig: Rig, q: Array) -> tuple[ModalTable | None, str]:
    """Return the campaign's modal model, or one derived along the joint that turns most; or why there is none."""
    travel = np.ptp(q, axis=0)
    names = rig.joint_names
    given = None if campaign.modal is None else read_modal(campaign.modal, names)
    joint = names[int(np.argmax(travel))] if given is None else given.joint
    index = names.index(joint)
    others = [name for name, turned in zip(names, travel, strict=True) if name != joint and turned > STILL]
    if others:
        reason = f"Besides '{joint}', '{', '.join(others)}' turns too; the modes are tabulated over one joint."
        return None, reason
    if given is not None:
        return given, ""
    low, high = q[:, index].min(), q[:, index].max()
    angles = np.linspace(low, high, 1 + max(1, int(np.ceil((high - low) / SPACING))))
    return derive(rig, select(campaign.effects), joint, angles, q.mean(axis=0)), ""


def _disturbance(
    campaign: Campaign, rig: Rig, analysis: Analysis, update: Callable[[float], None]
) -> tuple[Signal, Array]:
    """Predict a run with another rig: its wrench less the static one at its own angles, and these angles."""
    settings = CondenseSettings(working_rate_Hz=campaign.bands.working_rate)
    entry = analysis.entry
    predicted = predict_run(rig, campaign.acting(entry), analysis.run, settings, update)
    assert predicted.wrench is not None
    q = estimate(predicted, rig).q
    wrench = without_forces(predicted.wrench, rig, forces_in(campaign, entry), q)
    return wrench.derive(wrench.values - static_wrench(rig, q), "static wrench of the plant removed"), q


def _modes(table: ModalTable, poses: Array) -> Iterable[ModeAt]:
    for angle in poses:
        model = table.at(float(angle))
        for k in np.argsort(model.frequency):
            x, y, z = (float(value) for value in model.effective[3:, k])
            yield ModeAt(
                angle_rad=float(angle),
                frequency_Hz=float(model.frequency[k]),
                frequency_sigma_Hz=float(model.frequency_sigma[k]),
                damping=float(model.damping[k]),
                damping_sigma=float(model.damping_sigma[k]),
                effective=(x, y, z),
            )


def _gains(table: ModalTable, poses: Array, edges: Sequence[float]) -> Iterable[GainAt]:
    for entry in amplification(table, poses, edges):
        for index, channel in enumerate(TORQUES):
            yield GainAt(
                angle_rad=entry.angle,
                frequency_Hz=entry.frequency,
                channel=channel,
                gain=float(entry.gain[index]),
                sigma=float(entry.sigma[index]),
            )


def _errors(campaign: Campaign, found: Transmitted) -> Iterable[FilterErrorIn]:
    frames: list[tuple[Literal["T", "S"], Transmitted]] = [("T", found)]
    if (spacecraft := campaign.rig.spacecraft) is not None:
        frames.append(("S", found.moved(lambda signal: to_spacecraft(signal, spacecraft))))
    bands = [band for band in bands_of(campaign.bands) if band.low_pass_Hz is not None]
    for frame, moved in frames:
        for error in filter_errors(moved, bands):
            for index, channel in enumerate(WRENCH_CHANNELS):
                yield FilterErrorIn(
                    band=error.band,
                    frame=frame,
                    channel=channel,
                    unit=WRENCH_UNITS[index],
                    rigid_rms=float(error.rigid_rms[index]),
                    rigid_peak=float(error.rigid_peak[index]),
                    read_rms=float(error.transmitted_rms[index]),
                    read_peak=float(error.transmitted_peak[index]),
                    error_rms=float(error.error_rms[index]),
                    error_rms_sigma=float(error.error_rms_sigma[index]),
                    error_peak=float(error.error_peak[index]),
                    error_peak_sigma=float(error.error_peak_sigma[index]),
                    leak_rms=float(error.leak_rms[index]),
                )


def _agreement(campaign: Campaign, analysis: Analysis, found: Transmitted) -> Iterable[BothWays]:
    for band in bands_of(campaign.bands):
        coupled = analysis.pairs["T", band.name].predicted
        assert coupled is not None  # of a recording that has a prediction
        modal, rigid = bandpass.apply(found.read, band), bandpass.apply(found.rigid, band)
        coupled, modal, rigid = overlap(coupled, modal, rigid)
        valid = coupled.valid & modal.valid
        bandwidth = bandpass.noise_bandwidth(band, coupled.dt)
        noise = sensor_noise(campaign.rig.transducer.noise.value, analysis.run.rates["wrench"], bandwidth).sigma
        for channel, unit in zip(coupled.channels, coupled.units, strict=True):
            one, other = coupled.column(channel)[valid], modal.column(channel)[valid]
            yield BothWays(
                band=band.name,
                channel=channel,
                unit=unit,
                coupled_rms=_rms(one),
                modal_rms=_rms(other),
                rigid_rms=_rms(rigid.column(channel)[valid]),
                difference_rms=_rms(one - other),
                noise_rms=float(noise[WRENCH_CHANNELS.index(channel)]),
            )


def _gain_curves(table: ModalTable, poses: Array, dt: float) -> dict[str, Array]:
    f = np.linspace(0.0, 0.5 / dt, 2001)[1:-1]
    columns = {"f": f}
    for angle in poses:
        H = table.at(float(angle)).transfer(f)
        for index, channel in enumerate(TORQUES):
            columns[f"{channel}.{np.degrees(angle):.1f} deg"] = np.abs(H[:, 3 + index, 3 + index])
    return columns


def _spectra(analysis: Analysis, found: Transmitted) -> dict[str, Array]:
    coupled = analysis.pairs["T", UNFILTERED.name].predicted
    assert coupled is not None
    columns: dict[str, Array] = {}
    for name, signal in (("rigid", found.rigid), ("modal", found.read), ("coupled", coupled)):
        for channel in TORQUES:
            if channel in signal.channels:
                segment = min(len(signal), int(SEGMENT_S / signal.dt))
                f, density = welch(signal.column(channel), 1.0 / signal.dt, nperseg=segment)
                columns |= {"f": f, f"{channel}.{name}": density}
    return columns


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))
