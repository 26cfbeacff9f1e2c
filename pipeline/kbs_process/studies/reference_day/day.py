"""The day assessed: where its sections end, and how well the antenna points and how quietly it turns in each."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from kbs_process.campaign.config import Campaign
from kbs_process.campaign.mission import Day, boundaries
from kbs_process.mission.planner import Plan
from kbs_process.reduction.analysis import bands_of, passband
from kbs_process.reduction.pointing import estimate
from kbs_process.results.pointing import PointingEstimate
from kbs_process.signals.grid import overlap
from kbs_process.signals.records import Array, Signal
from kbs_process.stages import bandpass, pointing
from kbs_process.stages.bandpass import Band
from kbs_process.stages.pointing import PointingStatistics
from kbs_process.stages.to_cog import to_spacecraft
from kbs_process.studies.reference_day.flying import CORNER, TORQUES, Flown
from kbs_process.studies.reference_day.on_mast import answer, off_boresight
from kbs_process.studies.reference_day.results import MastIn, PublishedSection, Section, Torque

WIDEST = "widest"  # band, of which no table is kept


@dataclass(frozen=True, slots=True, eq=False)
class Assessed:
    """The day in its sections."""

    error: Signal  # joint angles less desired ones
    boresight: Signal  # cross-elevation, elevation, line of sight
    torques: dict[str, Signal]  # at the spacecraft's centre of mass, by the band's name, narrowest first
    sections: tuple[Section, ...]
    joints: tuple[PointingStatistics, ...]  # of the joints' errors, over the day
    whole: tuple[PointingEstimate, ...]  # of the boresight, over the day


def assess(campaign: Campaign, day: Day, planned: Plan, flown: Flown) -> Assessed:
    """Cut the day into its sections, and take the statistics of each."""
    angle, rigid = overlap(flown.angle, flown.wrench)
    error = pointing.error(angle, planned.t, planned.q)
    boresight = pointing.line_of_sight(error, angle.values[:, 1])
    mast = None if day.mast is None else answer(rigid, angle, day.mast)
    torques = _torques(campaign, rigid if mast is None else mast.wrench)
    changed = None if mast is None else (_torques(campaign, rigid), off_boresight(mast.turn.values, angle.values))
    period = day.mission.orbit.nodal_period
    sections = []
    for entry, start, end in boundaries(day, planned):
        inside = (error.t >= start) & (error.t < end)
        azimuth, elevation = map(estimate, pointing.statistics(error, period, day.smoothing, inside))
        sections.append(
            Section(
                name=entry.name,
                start_s=start,
                end_s=end,
                ends_with=entry.until,
                modes=_modes(planned, start, end),
                greatest_rate=_rate(planned, start, end),
                azimuth=azimuth,
                elevation=elevation,
                torques=(
                    *(
                        _greatest(band.name, passband(band, signal.rate)[1], signal, start, end)
                        for band, signal in torques.items()
                    ),
                    _greatest(WIDEST, CORNER, flown.torque, start, end),
                ),
                published=PublishedSection(**entry.published.model_dump(), end_s=entry.near)
                if entry.published
                else None,
                mast=changed and _of_mast(*changed, error.t, start, end),
            )
        )
    return Assessed(
        error=error,
        boresight=boresight,
        torques={band.name: signal for band, signal in torques.items()},
        sections=tuple(sections),
        joints=pointing.statistics(error, period, day.smoothing),
        whole=tuple(map(estimate, pointing.statistics(boresight, period, day.smoothing))),
    )


def _of_mast(rigid: dict[Band, Signal], turned: Array, t: Array, start: float, end: float) -> MastIn:
    across, along = np.abs(turned[(t >= start) & (t < end)]).max(axis=0)
    peaks = tuple(_greatest(band.name, 0.0, signal, start, end).value for band, signal in rigid.items())
    return MastIn(rigid=peaks, cross_elevation=float(across), elevation=float(along))


def _modes(planned: Plan, start: float, end: float) -> tuple[str, ...]:
    inside = [
        f"{phase.mode} {phase.relay}"
        for phase in planned.phases
        if planned.t[phase.start] < end - 1.0 and planned.t[phase.end - 1] > start + 1.0
    ]
    return tuple(name for name, _ in itertools.groupby(inside))


def _rate(planned: Plan, start: float, end: float) -> float:
    inside = (planned.t >= start) & (planned.t <= end)
    t, q = planned.t[inside], planned.q[inside]
    return float(np.abs(np.diff(q, axis=0) / np.diff(t)[:, None]).max())


def _torques(campaign: Campaign, wrench: Signal) -> dict[Band, Signal]:
    """Return the wrench at the spacecraft's centre of mass in every band, narrowest first."""
    assert campaign.rig.spacecraft is not None  # by fly
    unfiltered, *bands = bands_of(campaign.bands)
    return {band: to_spacecraft(bandpass.apply(wrench, band), campaign.rig.spacecraft) for band in (*bands, unfiltered)}


def _greatest(name: str, highest: float, signal: Signal, start: float, end: float) -> Torque:
    columns = [signal.channels.index(channel) for channel in TORQUES]
    first, last = np.searchsorted(signal.t, (start, end))
    inside = slice(int(first), int(last))
    x = np.where(signal.valid[inside, None], np.abs(signal.values[inside, columns]), 0.0)
    row, column = np.unravel_index(int(np.argmax(x)), x.shape)
    return Torque(
        band=name,
        label=f"up to {highest:g} Hz",
        value=float(x[row, column]),
        axis=TORQUES[int(column)],
        time_s=float(signal.t[first + row]),
        rms=float(np.sqrt(np.mean(np.sum(x**2, axis=1)))),
    )
