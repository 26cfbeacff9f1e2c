"""What the analyses of all recordings amount to: bands, repeatability, figures of merit, resonances."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence

import msgspec
import numpy as np

from kbs_process.campaign.config import Campaign
from kbs_process.plant.laws import select
from kbs_process.plant.linear.modes import modes
from kbs_process.reduction.analysis import Analysis, banded, bands_of, framed, passband
from kbs_process.reduction.relief import exerted, forces_in
from kbs_process.results.judged import Budget, Frame
from kbs_process.signals.records import COPY
from kbs_process.stages import budget, repeatability, repeats
from kbs_process.stages.bandpass import Band, BandStatement, statement
from kbs_process.stages.compare import compare
from kbs_process.stages.gravity.model import GravityModel
from kbs_process.studies.correlate import results


def statements(bands: Sequence[Band], runs: Sequence[Analysis]) -> dict[str, BandStatement]:
    """Statements for the shortest recording, where edges weigh most."""
    if not runs:
        return {}
    shortest = min((analysis.residual for analysis in runs), key=len)
    return {band.name: statement(band, shortest.dt, len(shortest)) for band in bands}


def band(stated: BandStatement) -> results.Band:
    """Return a band as results.json describes it."""
    label = "unfiltered" if stated.high_Hz is None else f"{stated.low_Hz or 0:g} to {stated.high_Hz:g} Hz"
    return results.Band(
        name=stated.name,
        label=label,
        high_pass_Hz=stated.low_Hz,
        low_pass_Hz=stated.high_Hz,
        method=stated.method,
        edge_s=stated.edge_s,
        edge_error=stated.edge_error,
        edge_error_drift=stated.edge_error_drift,
    )


def repeatabilities(runs: Sequence[Analysis]) -> Iterable[results.Repeatability]:
    """Yield what the repeats of each trajectory have in common, by band, frame and channel."""
    by_trajectory: dict[str, list[Analysis]] = defaultdict(list)
    for analysis in runs:
        by_trajectory[analysis.entry.trajectory].append(analysis)
    for trajectory, group in by_trajectory.items():
        lags = _lags(group)
        if len(lags) < 2:
            continue
        for frame, band in group[0].pairs:
            signals = [group[index].pairs[frame, band].measured for index in lags]
            common = repeatability.on_common_axis(signals, list(lags.values()))
            if repeatability.in_common(common) < 2:
                continue  # a band whose edges take all of so short a recording
            found = repeatability.fit(common)
            for index, channel in enumerate(found.channels):
                yield results.Repeatability(
                    trajectory=trajectory,
                    band=band,
                    frame=_frame(frame),
                    channel=channel,
                    unit=found.units[index],
                    signal_rms=float(found.signal[index]),
                    noise_rms=float(found.noise[index]),
                    ratio=float(found.ratio[index]),
                    n=found.repeats,
                )


def _lags(group: Sequence[Analysis]) -> dict[int, float]:
    """How much later each recording of a group moves than its first; those that do not repeat it are left out."""
    reference = repeats.motion_of(group[0].run)
    lags = {0: 0.0}
    for index, analysis in enumerate(group[1:], start=1):
        if any(loss.kind == COPY for loss in analysis.run.losses):
            continue
        motion = repeats.motion_of(analysis.run)
        late = None if reference is None or motion is None else repeats.lag(reference, motion)
        if late is not None:
            lags[index] = late
    return lags


def merits(campaign: Campaign, runs: Sequence[Analysis], budgets: Sequence[Budget]) -> Iterable[results.Merit]:
    """Yield the figures of merit of every recording that has a prediction, by frame, band and channel."""
    by_name = {band.name: band for band in bands_of(campaign.bands)}
    sigma = {(entry.recording, entry.frame, entry.band, entry.channel): entry.total for entry in budgets}
    for analysis in runs:
        for (frame, name), pair in analysis.pairs.items():
            if pair.predicted is None:
                continue
            limits = passband(by_name[name], campaign.bands.working_rate)
            key = (analysis.entry.name, _frame(frame), name)
            for merit in compare(pair.measured, pair.predicted, limits):
                yield results.Merit(
                    recording=analysis.entry.name,
                    role=analysis.entry.role,
                    band=name,
                    frame=_frame(frame),
                    sigma=sigma.get((*key, merit.channel)),
                    **msgspec.structs.asdict(merit),
                )


def resonances(campaign: Campaign, runs: Sequence[Analysis], model: GravityModel) -> tuple[results.Resonance, ...]:
    """Modes on the transducer at the first and the last pose of the first run: they move with the joints."""
    if not runs:
        return ()
    q, nyquist = runs[0].motion.q, 0.5 * float(runs[0].run.load_rates.max())
    found = []
    for where, pose in (("first pose", q[0]), ("last pose", q[-1])):
        angles = ", ".join(
            f"{name} {np.degrees(angle):.1f} deg" for name, angle in zip(campaign.rig.joint_names, pose, strict=True)
        )
        for mode in modes(model.rig, select(campaign.effects), pose):
            if mode.frequency > nyquist:
                continue
            source = f"turning about {mode.axis}, {where} ({angles})"
            found.append(
                results.Resonance(axis=mode.axis, frequency_Hz=mode.frequency, sigma_Hz=mode.sigma, source=source)
            )
    return tuple(found)


def rig_forces(campaign: Campaign, runs: Sequence[Analysis]) -> Iterable[results.RigForce]:
    """Yield what the described forces of the laboratory exert at rest, by band and frame: it was taken off."""
    for analysis in runs:
        if not (forces := forces_in(campaign, analysis.entry)):
            continue
        pull = exerted(analysis.residual, campaign.rig, forces, analysis.motion.q)
        for band in bands_of(campaign.bands)[1:]:
            for frame, signal in framed(campaign, banded(pull, analysis.run, band)).items():
                for channel, unit, rms in zip(signal.channels, signal.units, budget.rms(signal), strict=True):
                    yield results.RigForce(
                        recording=analysis.entry.name,
                        band=band.name,
                        frame=_frame(frame),
                        channel=channel,
                        unit=unit,
                        rms=float(rms),
                    )


def _frame(name: str) -> Frame:
    return "S" if name == "S" else "joint" if name == "joint" else "T"
