"""What of each recording is periodic in a joint's angle, measured beside predicted."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from kbs_process.campaign.config import Campaign
from kbs_process.plant.laws import select as effects_of
from kbs_process.reduction.analysis import Analysis, passband, select
from kbs_process.signals.grid import overlap
from kbs_process.signals.records import WRENCH_CHANNELS, Array, Signal
from kbs_process.stages.bandpass import UNFILTERED
from kbs_process.stages.orders.known import coincident, known_orders
from kbs_process.stages.orders.map import Waterfall, waterfall
from kbs_process.stages.orders.peaks import ALPHA, Floor, Peak, floor_of, peaks
from kbs_process.stages.orders.tracking import LEAST, Average, Track, average, length_of
from kbs_process.studies.correlate.results import OrderPeak, OrdersIn

_TURN = 2.0 * np.pi
_FORCES = WRENCH_CHANNELS[:3]


@dataclass(frozen=True, slots=True, eq=False)
class Study:
    """What is said of one joint in one recording, and the curves behind it: the channels' measured, then predicted."""

    findings: OrdersIn
    channels: tuple[str, ...]
    units: tuple[str, ...]
    spectrum: Average
    floors: tuple[Floor, ...]
    map: Waterfall


def study(campaign: Campaign, analyses: Sequence[Analysis]) -> Iterator[Study]:
    """Study every joint that turns far enough, recording by recording."""
    for analysis in analyses:
        effects = effects_of(campaign.acting(analysis.entry))
        for index, joint in enumerate(campaign.rig.joints):
            if joint.type == "revolute":
                track, sides = _along(campaign, analysis, index)
                found = follow(analysis.entry.name, joint.name, track, sides, known_orders(joint, effects))
                yield from () if found is None else (found,)


def follow(recording: str, joint: str, track: Track, sides: Sequence[Signal], known: dict[str, float]) -> Study | None:
    """Study the torques of one joint's track, measured and, where there is a second side, predicted.

    None where the joint does not turn far enough, or no torque is recorded.
    """
    channels = [channel for channel in sides[0].channels if channel not in _FORCES]
    length = length_of(track)
    if not channels or length == 0.0:
        return None
    sides = [select(side, channels) for side in sides]
    loads = np.concatenate([side.values for side in sides], axis=1)
    spectrum = average(track, loads, length)
    floors = tuple(floor_of(spectrum, column, len(channels)) for column in range(loads.shape[1]))
    highest = float(spectrum.order[-1])
    named = [
        peak
        for at, channel in enumerate(channels)
        for peak in _named(track, spectrum, floors, at, len(channels), (channel, sides[0].units[at]), known)
    ]
    findings = OrdersIn(
        recording=recording,
        joint=joint,
        windows=spectrum.windows,
        window_rad=length * _TURN,
        resolution=spectrum.resolution,
        lowest=LEAST / length,
        highest=highest,
        by_angle=highest > 0.9 * track.by_angle,
        band_Hz=track.band_Hz,
        rates=(spectrum.rates[0] * _TURN, spectrum.rates[1] * _TURN),
        false_alarm=ALPHA,
        peaks=tuple(sorted(named, key=lambda one: -max(one.measured or 0.0, one.predicted or 0.0))),
        above={name: order for name, order in known.items() if order > highest},
    )
    cells = waterfall(track, loads, length, spectrum.windows)
    return Study(findings, tuple(channels), sides[0].units, spectrum, floors, cells)


def _along(campaign: Campaign, analysis: Analysis, index: int) -> tuple[Track, list[Signal]]:
    """The joint's way, and the loads without gravity on its grid: measured and, where there is one, predicted."""
    pair, motion = analysis.pairs[campaign.rig.frame, UNFILTERED.name], analysis.motion
    moved = np.column_stack([motion.q[:, index], motion.qd[:, index], motion.sigma_q[:, index]]) / _TURN
    angle = Signal(motion.t0, motion.dt, moved, ("q", "qd", "sigma"), ("1", "1/s", "1"), "joint", motion.valid)
    way, *sides = overlap(angle, *(side for side in (pair.measured, pair.predicted) if side is not None))
    sampled = min(way.rate, *analysis.run.load_rates)
    turns, rate, sigma = way.values.T
    uncertain = float(np.sqrt(np.mean(sigma**2))) * _TURN
    valid = way.valid & sides[0].valid
    return Track(turns, rate, valid, way.dt, uncertain, passband(UNFILTERED, sampled)[1]), sides


def _named(
    track: Track,
    spectrum: Average,
    floors: tuple[Floor, ...],
    at: int,
    channels: int,
    channel: tuple[str, str],
    known: dict[str, float],
) -> Iterator[OrderPeak]:
    """Peaks of a channel that are measured, then those that are predicted alone, above the noise of the measurement."""
    measured = peaks(track, spectrum, at, floors[at])
    predicted: list[Peak] = []
    other = at + channels
    if other < len(floors):
        quiet = np.maximum(floors[at].threshold, floors[other].threshold)
        apart = peaks(track, spectrum, other, Floor(floors[at].noise, quiet))
        predicted = [one for one in apart if all(abs(one.order - m.order) > spectrum.resolution for m in measured)]
    for peak in (*measured, *predicted):
        foreseen = None
        if other < len(floors):
            foreseen = float(np.sqrt(np.interp(peak.order, spectrum.order, spectrum.power[:, other])))
        yield OrderPeak(
            channel=channel[0],
            unit=channel[1],
            order=peak.order,
            measured=peak.amplitude if peak in measured else None,
            sigma=peak.sigma,
            predicted=foreseen,
            known=coincident(peak.order, spectrum.resolution, known),
            fixed=peak.fixed,
        )


def tables_of(one: Study) -> dict[str, tuple[dict[str, Array], dict[str, str]]]:
    """Columns and units of two tables: amplitudes over order, and cell by cell over angle or rate and order."""
    spectrum, units = {"order": one.spectrum.order}, {"order": "1"}
    cells = one.map
    rows, columns = np.meshgrid(cells.at[:-1] * _TURN, cells.order[:-1], indexing="ij")
    ends, tops = np.meshgrid(cells.at[1:] * _TURN, cells.order[1:], indexing="ij")
    places = {f"{cells.over}.from": rows, f"{cells.over}.to": ends, "order.from": columns, "order.to": tops}
    of_map = {name: values.ravel() for name, values in places.items()}
    of_map_units = dict(zip(of_map, [{"rate": "rad/s", "angle": "rad"}[cells.over]] * 2 + ["1"] * 2, strict=True))
    for column in range(one.spectrum.power.shape[1]):
        at = column % len(one.channels)
        name = f"{one.channels[at]}.{'measured' if column == at else 'predicted'}"
        spectrum[name], of_map[name] = np.sqrt(one.spectrum.power[:, column]), cells.amplitude[..., column].ravel()
        units[name] = of_map_units[name] = one.units[at]
    for channel, unit, floor in zip(one.channels, one.units, one.floors, strict=False):
        spectrum[f"{channel}.threshold"], units[f"{channel}.threshold"] = np.sqrt(floor.threshold), unit
    return {"": (spectrum, units), ".map": (of_map, of_map_units)}
