"""One recording, measured and predicted, in every band and frame."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from kbs_process.campaign.config import Bands, Campaign, RecordingEntry
from kbs_process.plant.rigid import static_wrench
from kbs_process.reduction.predicting import predict_run
from kbs_process.reduction.preparing import tare
from kbs_process.reduction.relief import errors, forces_in, in_motion, without_forces
from kbs_process.reduction.settings import motion_settings
from kbs_process.signals.records import WRENCH_CHANNELS, Array, Run, Signal
from kbs_process.stages import bandpass
from kbs_process.stages.align.condense import CondenseSettings
from kbs_process.stages.bandpass import UNFILTERED, Band
from kbs_process.stages.gravity import model as gravity
from kbs_process.stages.gravity.model import GravityModel, Static
from kbs_process.stages.gravity.quality import Misfit, misfits
from kbs_process.stages.motion import Motion, estimate
from kbs_process.stages.to_cog import to_spacecraft


@dataclass(frozen=True, slots=True, eq=False)
class Pair:
    """The same signal measured and predicted; a recording that nobody predicts has the former only."""

    measured: Signal
    predicted: Signal | None


@dataclass(frozen=True, slots=True, eq=False)
class Analysis:
    """Everything that is known about one recording once it has been processed."""

    entry: RecordingEntry
    raw: Signal  # loads at the working rate, the wrench's cross-coupling and bias still in
    run: Run  # decoupled
    motion: Motion
    static: Static  # the fitted static loads along the motion, with their uncertainty
    misfits: tuple[Misfit, ...]  # of the static loads, channel by channel
    residual: Signal  # decoupled less static; gaps that are short in the narrowest band are bridged
    predicted: Run | None
    pairs: Mapping[tuple[str, str], Pair]  # by frame and band


def bands_of(settings: Bands) -> tuple[Band, ...]:
    """Return the bands of a campaign, the unfiltered one first."""
    high_pass = settings.high_pass or None
    return (UNFILTERED, *(Band(f"lt{low:g}Hz", high_pass, low) for low in settings.low_pass))


def banded(signal: Signal, run: Run, band: Band) -> Signal:
    """Return what a signal made of a run's readings has in a band; gaps that are short in it are bridged."""
    return bandpass.apply(bandpass.bridged(signal, run.gaps, band, run.reach), band)


def passband(band: Band, rate: float) -> tuple[float, float]:
    """Return a band's limits in Hz; an open one ends at zero or at the working rate's passband."""
    return band.high_pass_Hz or 0.0, band.low_pass_Hz or 0.4 * rate


def analyse(
    campaign: Campaign,
    entry: RecordingEntry,
    raw: Signal,
    run: Run,
    motion: Motion,
    model: GravityModel,
    update: Callable[[float], None],
) -> Analysis:
    """Remove gravity from measurement and prediction alike, cut the bands, move them to the spacecraft."""
    wrench = _loads(run)
    sample, taring = tare(campaign, entry, run, motion, model)
    static = gravity.apply(_at_rest(motion), model, taring)
    residual = wrench.derive(
        model.without_coupling(wrench.values - static.wrench.values),
        "fitted static wrench and the fitted rest of the cross-coupling removed",
        valid=wrench.valid & static.wrench.valid,
    )
    predicted = disturbance = None
    if entry.role != "calibration":
        predicted, disturbance = _predict(campaign, entry, run, motion, model, update)
    return Analysis(
        entry=entry,
        raw=raw,
        run=run,
        motion=motion,
        static=static,
        misfits=misfits(sample, model, taring, _cords(campaign, entry, wrench, motion)),
        residual=bandpass.bridged(residual, run.gaps, Band("", None, min(campaign.bands.low_pass)), run.reach),
        predicted=predicted,
        pairs=_pairs(campaign, residual, disturbance, run),
    )


def _predict(
    campaign: Campaign,
    entry: RecordingEntry,
    run: Run,
    motion: Motion,
    model: GravityModel,
    update: Callable[[float], None],
) -> tuple[Run | None, Signal]:
    """Return the predicted run (of a plant with drives) and its wrench without gravity.

    The plant has the masses and CoGs that the gravity fit found. Its static wrench, and that of the rig's cords, is
    taken at its own angles, as the measurement's is. A rig that is driven by its motion has no drives to predict: there
    is inertia, and what the model's effects add.
    """
    if campaign.drive == "motion":
        moving = gravity.apply(motion, model).wrench
        inertia = moving.values - gravity.apply(_at_rest(motion), model).wrench.values
        added = in_motion(campaign, entry, motion, moving.channels, model.rig)
        # The measurement's residual had the fitted rest of the cross-coupling undone as well.
        return None, moving.derive(model.without_coupling(inertia) + added, "inertia and effects")
    settings = CondenseSettings(working_rate_Hz=campaign.bands.working_rate)
    predicted = predict_run(model.rig, campaign.acting(entry), run, settings, update)
    angles = estimate(predicted, model.rig, motion_settings(campaign))
    static = static_wrench(model.rig, angles.q)
    total = without_forces(_loads(predicted), model.rig, forces_in(campaign, entry), angles.q)
    left = total.derive(total.values - static, "static wrench of the plant removed")
    return predicted, select(left, _loads(run).channels)


def _pairs(campaign: Campaign, residual: Signal, disturbance: Signal | None, run: Run) -> dict[tuple[str, str], Pair]:
    pairs = {}
    for band in bands_of(campaign.bands):
        measured, predicted = banded(residual, run, band), None
        if disturbance is not None:  # what commands drive has no gaps of the readings
            of_angles = campaign.drive == "motion"
            predicted = banded(disturbance, run, band) if of_angles else bandpass.apply(disturbance, band)
        foreseen = {} if predicted is None else framed(campaign, predicted)
        for frame, one in framed(campaign, measured).items():
            pairs[frame, band.name] = Pair(one, foreseen.get(frame))
    return pairs


def framed(campaign: Campaign, loads: Signal) -> dict[str, Signal]:
    """Return loads by frame: as recorded, and at the spacecraft where there is one, and all six channels."""
    spacecraft, found = campaign.rig.spacecraft, {campaign.rig.frame: loads}
    if spacecraft is not None and set(WRENCH_CHANNELS) <= set(loads.channels):
        found["S"] = to_spacecraft(select(loads, WRENCH_CHANNELS), spacecraft)
    return found


def _cords(campaign: Campaign, entry: RecordingEntry, wrench: Signal, motion: Motion) -> Array:
    """What the rig's cords may be wrong by: rms (c,) over a recording."""
    forces = forces_in(campaign, entry)
    variances = [np.mean(error.values**2, axis=0) for error in errors(wrench, campaign.rig, forces, motion.q)]
    rms: Array = np.sqrt(np.sum(variances, axis=0)) if variances else np.zeros(len(wrench.channels))
    return rms


def _at_rest(motion: Motion) -> Motion:
    return replace(motion, qd=np.zeros_like(motion.q), qdd=np.zeros_like(motion.q))


def select(signal: Signal, channels: Sequence[str]) -> Signal:
    """Return the channels asked for, in that order."""
    columns = [signal.channels.index(channel) for channel in channels]
    return Signal(
        t0=signal.t0,
        dt=signal.dt,
        values=signal.values[:, columns],
        channels=tuple(channels),
        units=tuple(signal.units[column] for column in columns),
        frame=signal.frame,
        valid=signal.valid,
        history=signal.history,
    )


def _loads(run: Run) -> Signal:
    loads = run.loads
    assert loads is not None  # every campaign names the topic of a load, and reading demands it
    return loads
