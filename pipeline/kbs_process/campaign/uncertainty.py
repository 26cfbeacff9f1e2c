"""The uncertainty budget of every channel, in every band, at the transducer and at the spacecraft."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Literal

import numpy as np

from kbs_process.campaign.analysis import Analysis, bands_of, passband
from kbs_process.campaign.config import Campaign
from kbs_process.report import results
from kbs_process.rig.model import Amplifier
from kbs_process.signals.records import WRENCH_CHANNELS, Array, Signal
from kbs_process.stages import bandpass, budget, gravity_error
from kbs_process.stages.bandpass import Band, BandStatement
from kbs_process.stages.decouple import Decoupling
from kbs_process.stages.gravity import GravityModel
from kbs_process.stages.to_cog import sigma_at_spacecraft, sigma_of_pose


def budgets(
    campaign: Campaign,
    runs: Sequence[Analysis],
    model: GravityModel,
    decoupling: Decoupling,
    statements: Mapping[str, BandStatement],
    repeated: Sequence[results.Repeatability],
    resonances: Sequence[results.Resonance],
) -> Iterable[results.Budget]:
    if not runs:
        return
    lowest = min((mode.frequency_Hz for mode in resonances), default=None)
    for band in bands_of(campaign.bands)[1:]:
        channels, units = runs[0].residual.channels, runs[0].residual.units
        noise = _repeat_noise(repeated, band.name, channels)
        of_runs = [
            _entries(campaign, analysis, model, decoupling, band, statements[band.name], noise, lowest)
            for analysis in runs
        ]
        entries = _quadratic_mean(of_runs)
        yield from _rows(entries, "T", band.name, channels, units)
        spacecraft = campaign.rig.spacecraft
        if spacecraft is not None and channels == WRENCH_CHANNELS:
            moved = [
                budget.Entry(entry.stage, entry.source, sigma_at_spacecraft(entry.sigma, spacecraft))
                for entry in entries
            ]
            poses = [sigma_of_pose(analysis.pairs["T", band.name].measured, spacecraft) for analysis in runs]
            pose = np.sqrt(np.mean(np.square(poses), axis=0))
            moved.append(budget.Entry("to the spacecraft", "position and attitude of S in T", pose))
            yield from _rows(moved, "S", band.name, channels, units)


def _entries(
    campaign: Campaign,
    analysis: Analysis,
    model: GravityModel,
    decoupling: Decoupling,
    band: Band,
    stated: BandStatement,
    repeat_noise: Array | None,
    resonance: float | None,
) -> list[budget.Entry]:
    """The budget of one recording in one band, in T."""

    def cut(signal: Signal) -> Signal:
        return bandpass.apply(signal, band)

    measured = analysis.pairs["T", band.name].measured
    limits = passband(band, campaign.bands.working_rate)
    index = [WRENCH_CHANNELS.index(channel) for channel in measured.channels]
    assert analysis.run.wrench is not None
    sensor = budget.sensor_noise(
        campaign.rig.transducer.noise.value[index],
        analysis.run.rates["wrench"],
        bandpass.noise_bandwidth(band, measured.dt),
    )
    entries = [
        sensor,
        budget.cross_coupling(cut(analysis.run.wrench), decoupling.sigma),
        *gravity_error.entries(analysis.motion, analysis.static, model, cut),
        budget.clock(analysis.static.wrench, _late_sigma(analysis, campaign.rig.transducer.amplifier), cut),
        budget.filter_edges(measured, stated.edge_error),
        budget.resonance(measured, resonance, limits),
    ]
    if repeat_noise is not None:
        entries.append(budget.repeatability(repeat_noise, sensor.sigma))
    return entries


def _late_sigma(analysis: Analysis, amplifier: Amplifier | None) -> float:
    """How well it is known when angles and wrench belong together, s: their clocks, and the amplifier's delay."""
    clock = analysis.run.clocks.get("angle") or analysis.run.clocks.get("rate")
    known = 0.0 if clock is None else float(np.hypot(clock.sigma_offset_s, clock.latency_s))
    known = known if np.isfinite(known) else 0.0
    if amplifier is None:
        return known
    return float(np.hypot(known, amplifier.delay * float(amplifier.corner.sigma) / float(amplifier.corner)))


def _repeat_noise(
    repeated: Sequence[results.Repeatability], band: str, channels: Sequence[str]
) -> Array | None:
    """The largest noise of the trajectories in T, (c,); None without repeats."""
    worst = np.zeros(len(channels))
    of_band = [entry for entry in repeated if entry.band == band and entry.frame == "T"]
    for entry in of_band:
        column = channels.index(entry.channel)
        worst[column] = max(worst[column], entry.noise_rms or 0.0)
    return worst if of_band else None


def _quadratic_mean(of_runs: Sequence[Sequence[budget.Entry]]) -> list[budget.Entry]:
    return [
        budget.Entry(
            same[0].stage, same[0].source, np.sqrt(np.mean([entry.sigma**2 for entry in same], axis=0))
        )
        for same in zip(*of_runs, strict=True)
    ]


def _rows(
    entries: Sequence[budget.Entry],
    frame: Literal["S", "T"],
    band: str,
    channels: Sequence[str],
    units: Sequence[str],
) -> Iterable[results.Budget]:
    sums = budget.total(entries)
    for index, channel in enumerate(channels):
        yield results.Budget(
            channel=channel,
            unit=units[index],
            frame=frame,
            band=band,
            contributions=tuple(
                results.BudgetItem(stage=entry.stage, source=entry.source, sigma=float(entry.sigma[index]))
                for entry in entries
            ),
            total=float(sums[index]),
        )
