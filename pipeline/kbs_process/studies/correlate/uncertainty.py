"""The uncertainty budget of every recording: each channel, in every band, at the transducer and at the spacecraft."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from kbs_process.campaign.config import Campaign
from kbs_process.reduction.analysis import Analysis, banded, bands_of, passband, select
from kbs_process.reduction.relief import errors, forces_in
from kbs_process.results.judged import Budget, BudgetItem, Frame
from kbs_process.rig.model import LAB, Rig
from kbs_process.signals.records import WRENCH_CHANNELS, Array, Signal
from kbs_process.stages import bandpass, budget
from kbs_process.stages.align.clocks import late_sigma
from kbs_process.stages.bandpass import Band, BandStatement
from kbs_process.stages.decouple import Decoupling
from kbs_process.stages.gravity import error as gravity_error
from kbs_process.stages.gravity.model import GravityModel
from kbs_process.stages.six_channels import Together, together
from kbs_process.stages.to_cog import sigma_at_spacecraft, sigma_of_pose
from kbs_process.studies.correlate import results


def budgets(
    campaign: Campaign,
    runs: Sequence[Analysis],
    model: GravityModel,
    decoupling: Decoupling,
    statements: Mapping[str, BandStatement],
    repeated: Sequence[results.Repeatability],
    resonances: Sequence[results.Resonance],
    noise: Mapping[str, Mapping[str, float]],
    late: Mapping[str, float],
) -> Iterable[Budget]:
    """Yield every recording's own budget; where nothing of a recording is known in a band, there is none.

    `noise`: of a sample, rms, by recording and channel, as measured; what is stated counts where it is more, and no
    noise is more than all that is read in the band. `late`: s, by recording, what clocks are off by as gravity shows.
    """
    lowest = min((mode.frequency_Hz for mode in resonances), default=None)
    spacecraft, own = campaign.rig.spacecraft, campaign.rig.frame
    slopes = [gravity_error.Slopes.of(analysis.motion, model) for analysis in runs]
    for band in bands_of(campaign.bands)[1:]:
        for analysis, along in zip(runs, slopes, strict=True):
            measured = analysis.pairs[own, band.name].measured
            if not measured.valid.any():
                continue
            of_band = [entry for entry in repeated if (entry.frame, entry.band) == (own, band.name)]
            repeats = _repeat_noise(of_band, measured.channels, analysis.entry.trajectory)
            shown = np.nan_to_num([noise.get(analysis.entry.name, {}).get(key, 0.0) for key in measured.channels])
            edges = statements[band.name]
            known = float(np.hypot(analysis.entry.clock_sigma, late.get(analysis.entry.name, 0.0)))
            entries = _entries(campaign, analysis, model, along, decoupling, band, edges, shown, repeats, lowest, known)
            frame: Frame = "joint" if own == "joint" else "T"
            yield from _rows(entries, frame, band.name, analysis.entry.name, measured)
            if spacecraft is not None and set(WRENCH_CHANNELS) <= set(measured.channels):
                whole = select(measured, WRENCH_CHANNELS)
                six = [measured.channels.index(channel) for channel in WRENCH_CHANNELS]
                moved = [replace(entry, sigma=sigma_at_spacecraft(entry.sigma[six], spacecraft)) for entry in entries]
                pose = sigma_of_pose(whole, spacecraft)
                moved.append(budget.Entry("to the spacecraft", "position and attitude of S in T", pose, grows=True))
                yield from _rows(moved, "S", band.name, analysis.entry.name, whole)


def all_together(
    campaign: Campaign, runs: Sequence[Analysis], budget: Sequence[Budget], rig: Rig
) -> dict[tuple[str, str], Together]:
    """Return the torque at the spacecraft that rigid bodies, and all six channels, make likely: by recording and band.

    `rig` has the masses and centres of gravity as fitted. Not where a hand or a cord moves the article: more acts on
    it than its joints.
    """
    spacecraft, found = rig.spacecraft, dict[tuple[str, str], Together]()
    if spacecraft is None or campaign.drive != "command" or rig.transducer.on != LAB or len(rig.joints) >= 6:
        return found
    for band in bands_of(campaign.bands)[1:]:
        for analysis in runs:
            name, measured = analysis.entry.name, analysis.pairs["T", band.name].measured
            known = {b.channel: b.total for b in budget if (b.recording, b.band, b.frame) == (name, band.name, "T")}
            sigma = np.array([known.get(channel, 0.0) for channel in WRENCH_CHANNELS])
            if not forces_in(campaign, analysis.entry) and np.all(sigma > 0.0):
                wrench = select(measured, WRENCH_CHANNELS)
                found[name, band.name] = together(wrench, analysis.motion.q, sigma, rig, spacecraft)
    return found


def six_channels(found: Mapping[tuple[str, str], Together]) -> Iterable[results.SixChannels]:
    """Yield what results.json holds of each."""
    for (name, band), one in found.items():
        peaks = np.abs(one.wrench.values[one.wrench.valid]).max(axis=0)
        yield results.SixChannels(
            recording=name,
            band=band,
            chi_square=one.chi_square,
            explained=one.explained,
            peak=dict(zip(WRENCH_CHANNELS[3:], peaks[3:].tolist(), strict=True)),
            sigma=dict(zip(WRENCH_CHANNELS[3:], np.hypot(one.sigma, one.bodies)[3:].tolist(), strict=True)),
        )


def _entries(
    campaign: Campaign,
    analysis: Analysis,
    model: GravityModel,
    slopes: gravity_error.Slopes,
    decoupling: Decoupling,
    band: Band,
    stated: BandStatement,
    noise: Array,
    repeat_noise: Array | None,
    resonance: float | None,
    clocks: float,
) -> list[budget.Entry]:
    """The budget of one recording in one band, in the frame of the recorded loads."""

    def cut(signal: Signal) -> Signal:
        return banded(signal, analysis.run, band)

    rig = campaign.rig
    measured = analysis.pairs[rig.frame, band.name].measured
    limits = passband(band, campaign.bands.working_rate)
    rates, width = analysis.run.load_rates, bandpass.noise_bandwidth(band, measured.dt)
    most = budget.rms(measured) / budget.sensor_noise(np.ones(len(measured.channels)), rates, width).sigma
    least = rig.loads.noise[rig.loads.index(measured.channels)]
    bridged = bandpass.bridging_noise(analysis.run.gaps, band, float(np.max(rates)))
    sensor = budget.sensor_noise(bridged * np.maximum(least, np.minimum(noise, most)), rates, width)
    late = late_sigma(analysis.run.clocks, rig.transducer.amplifier, clocks)
    entries = [
        sensor,
        *([_cross_coupling(analysis, model, decoupling, band)] if rig.transducer.channels else []),
        *gravity_error.entries(analysis.motion, analysis.static, model, slopes, cut),
        budget.clock(analysis.static.wrench, late, cut, gravity_error.moving(analysis.motion)),
        *budget.filter_edges(
            measured, stated.edge_error, stated.edge_error_drift, budget.drifting_part(measured, band)
        ),
        *([budget.resonance(measured, resonance, limits)] if rig.transducer.channels else []),
    ]
    forces = forces_in(campaign, analysis.entry)
    if unknown := list(errors(measured, rig, forces, analysis.motion.q)):
        in_motion = gravity_error.moving(analysis.motion)
        entries.append(budget.from_shapes("rig", budget.CORDS, unknown, cut, in_motion))
    if repeat_noise is not None:
        entries.append(budget.repeatability(repeat_noise, sensor.sigma))
    return entries


def _cross_coupling(analysis: Analysis, model: GravityModel, decoupling: Decoupling, band: Band) -> budget.Entry:
    """What the matrix's uncertainty makes of a recording's wrench, counted once.

    Where the gravity fit estimates what the calibration left, its covariance holds the leak of the static wrench; here
    remains that of the disturbance, by the fit's own sigmas. Where it does not, the calibration's sigmas concern all.
    """
    measured = analysis.pairs["T", band.name].measured
    if not model.settings.cross_coupling:
        assert analysis.run.wrench is not None  # of a rig with a transducer
        wrench = bandpass.apply(analysis.run.wrench, band)
        leak = budget.cross_coupling(wrench, decoupling.sigma)
        efforts = len(measured.channels) - len(wrench.channels)
        return replace(leak, sigma=np.append(leak.sigma, np.zeros(efforts)))
    index = model.equation.index
    fitted = model.equation.whole_coupling(model.fit.sigma[: model.equation.size])[np.ix_(index, index)]
    return budget.cross_coupling(measured, fitted)


def _repeat_noise(of_band: Sequence[results.Repeatability], channels: Sequence[str], trajectory: str) -> Array | None:
    """The noise of a trajectory's repeats, (c,); the largest of all where it was not repeated; else None."""
    own = [entry for entry in of_band if entry.trajectory == trajectory]
    worst = np.zeros(len(channels))
    for entry in own or of_band:
        column = channels.index(entry.channel)
        worst[column] = max(worst[column], entry.noise_rms or 0.0)
    return worst if of_band else None


def _rows(
    entries: Sequence[budget.Entry], frame: Frame, band: str, recording: str, measured: Signal
) -> Iterable[Budget]:
    sums = budget.total(entries)
    for index, (channel, unit) in enumerate(zip(measured.channels, measured.units, strict=True)):
        yield Budget(
            channel=channel,
            unit=unit,
            frame=frame,
            band=band,
            recording=recording,
            contributions=tuple(
                BudgetItem(stage=entry.stage, source=entry.source, sigma=float(entry.sigma[index]), grows=entry.grows)
                for entry in entries
            ),
            total=float(sums[index]),
        )
