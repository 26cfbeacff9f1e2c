"""Can what is recorded tell of what is required? Of channels asked before recordings are read, of samples after."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import permutations

import numpy as np

from kbs_process.campaign.config import Campaign, RecordingEntry, Requirement
from kbs_process.errors import ConfigError
from kbs_process.results.judged import Doubt
from kbs_process.rig.model import Amplifier, Rig
from kbs_process.signals.records import COPY, MISSING, WRENCH_CHANNELS, Mask, Run, Stretch
from kbs_process.stages.align.readings import Readings
from kbs_process.stages.align.spikes import GAP
from kbs_process.stages.bandpass import Band, bridged, too_long
from kbs_process.stages.repeats import lag, motion_of

SHOWN = 0.4  # of the rate of distinct readings: the highest frequency that they show
HELD = 0.125  # likewise, of readings of which each comes several times: that takes 3 % off
UNSEEN = 0.05  # share of a recording that may be unknown: an interval at 95 % leaves out as much
ENDS_S, ENDS = 4.0, 40  # that filters and the beginning of streams may cost: seconds, or samples
SEEN = 0.25  # of a band's shortest period: what lasts for as long shows in it
BRIEF = 0.025  # likewise, of missing rows: what hides in less shows in the band at a twentieth of its size
OFTEN = 3  # stretches of missing rows that are alike, from which on a logger drops rows
SHORTEST = 0.25  # of an amplifier's corner's period: what it passes lasts for longer
TOGETHER_S = 0.05  # what repeats have at the same instant, more often than by chance, has a cause
AMPLIFIED = 0.05  # part of a reading that an amplifier may take off at a band's upper edge


def check_requirements(campaign: Campaign) -> None:
    """Raise ConfigError for the first requirement of which nothing is measured, or where no recording is judged."""
    for requirement in campaign.requirements:
        judged_channels(requirement, campaign.rig)
        if all(entry.role == "calibration" for entry in campaign.recordings):
            raise ConfigError(
                "no recording is judged: all are of role 'calibration'",
                where=requirement.name,
                remedy="add a recording of the test, of role 'fit' or 'held-out', or take the requirement out",
            )


def judged_channels(requirement: Requirement, rig: Rig) -> tuple[str, ...]:
    """Return the channels by which a requirement is judged; raise ConfigError where there are none.

    A torque about another point needs the force: at the spacecraft there are all six channels, or none.
    """
    measured = {rig.frame: rig.channels}
    if rig.spacecraft is not None and set(WRENCH_CHANNELS) <= set(rig.channels):
        measured["S"] = WRENCH_CHANNELS
    if requirement.frame not in measured:
        raise ConfigError(
            f"nothing was measured in frame {requirement.frame}: recorded are {', '.join(rig.channels)}",
            where=requirement.name,
            remedy="give [spacecraft] in the parameter files and all six channels, or frame = 'T'",
        )
    channels = tuple(name for name in measured[requirement.frame] if name in requirement.channels)
    if not channels:
        raise ConfigError(
            f"none of {', '.join(requirement.channels)} was measured in frame {requirement.frame}",
            where=requirement.name,
            remedy=f"state a requirement on what is: {', '.join(measured[requirement.frame])}",
        )
    return channels


def needed_channels(requirement: Requirement, rig: Rig) -> tuple[str, ...]:
    """Return the channels of the wrench that a requirement's figure is made of: at the spacecraft, all."""
    return WRENCH_CHANNELS if requirement.frame == "S" else judged_channels(requirement, rig)


def unrecorded(requirement: Requirement, rig: Rig) -> Iterator[Doubt]:
    """Yield a doubt where axes of a requirement are not recorded: each must meet it."""
    lacking = set(requirement.channels).difference(judged_channels(requirement, rig))
    if lacking:
        which = "every axis has to meet the limit, unless 'axes' names those that the requirement is about"
        yield Doubt(f"not recorded: {', '.join(sorted(lacking))}, and {which}", of_failed=False)


def hidden(
    campaign: Campaign, requirement: Requirement, name: str, run: Run, moving: Mask, streams: Mapping[str, Readings]
) -> Iterator[Doubt]:
    """Yield what a recording's samples cannot show of a requirement; `moving` (n,): where its angles are known."""
    edge, channels = requirement.band[1], needed_channels(requirement, campaign.rig)
    for key, readings in streams.items():
        needed = edge / (HELD if key != "angle" and readings.held else SHOWN)
        share, rate = readings.slow(needed, at_rest=key == "angle")
        if share > UNSEEN:
            stream = "encoder" if key == "angle" else key
            yield Doubt(
                f"readings of {stream} are new only {rate:.3g} times a second in {100.0 * share:.0f} % of {name}, and "
                f"a band up to {edge:g} Hz needs {needed:.3g}"
            )
    loads = run.loads
    assert loads is not None  # every recording that is judged has some
    band = Band("", None, edge)
    known = bridged(replace(loads, valid=loads.valid & moving), run.gaps, band, run.reach).valid
    # Where filters lean on what lies beyond an end, samples of a slow stream are known, and not those between.
    slowest = min((run.rates[key] for key in streams if key in run.rates), default=loads.rate)
    edges = np.flatnonzero(np.diff(np.concatenate(([True], known, [True])).astype(np.int8)))
    lengths = np.diff(edges.reshape(-1, 2))
    lacking = int(lengths[lengths * slowest > loads.rate].sum())
    if lacking > max(UNSEEN * len(known), ENDS_S / loads.dt, ENDS):
        share = 100.0 * lacking / len(known)
        yield Doubt(f"in {share:.0f} % of {name} readings or angles are missing", of_failed=False)
    first, last = loads.t[known][[0, -1]] if known.any() else (0.0, 0.0)
    inside = run.gaps[(run.gaps[:, 1] > first) & (run.gaps[:, 0] < last) & np.isfinite(run.gaps).all(axis=1)]
    if len(gaps := too_long(inside, band)):
        start, end = gaps[np.argmax(np.diff(gaps)[:, 0])]
        where = f"readings or angles are missing in {name}, from {start:.2f} s to {end:.2f} s at the longest"
        yield Doubt(f"{where}: what there was up to {edge:g} Hz is not known", of_failed=False)
    within = [one for one in run.stretches if first < one.start + one.length and one.start < last]
    if missing := [one for one in within if one.kind == MISSING]:  # others are judged with and without
        longest = max(missing, key=lambda one: one.length)
        times = f"{len(missing)} times, " if len(missing) > 1 else ""
        where = f"readings are missing in {name}, {times}for {longest.length:.3g} s at {longest.start:.2f} s"
        yield Doubt(f"{where}: what happened may be the cause, and is not known", of_failed=False)
    if coarse := [one for one in _coarse(campaign, streams) if one[0] in channels]:
        steps = ", ".join(f"{channel} in steps of {step:.3g} {unit}" for channel, unit, step in coarse)
        yield Doubt(f"{steps} in {name}: coarser than the resolution that is stated")
    held = sorted({loss.where for loss in run.losses if loss.kind == "held" and loss.where in channels})
    if held:
        yield Doubt(f"{', '.join(held)} held one reading in {name}: what was beyond is not known", of_failed=False)


def doubtful(
    campaign: Campaign, recordings: Sequence[tuple[RecordingEntry, Run]], edge: float
) -> dict[str, list[Stretch]]:
    """What was bridged, by recording, and may be what happened: it is likely, lasts as long as a band up to `edge`, Hz,
    shows, or comes at the same instant of repeats; of missing rows, if they stand alone. Nothing is that no amplifier
    passes, nor are missing rows that are brief in the band.
    """
    amplifier = campaign.rig.transducer.amplifier
    shortest = 0.0 if amplifier is None else SHORTEST / float(amplifier.corner)
    long = {
        entry.name: [
            one
            for one in run.stretches
            if one.length > shortest and (one.likely or one.kind != MISSING or one.length * edge > BRIEF)
        ]
        for entry, run in recordings
    }
    found = {
        entry.name: [
            one
            for one in long[entry.name]
            if one.likely or (_alone(one, run) if one.kind == MISSING else one.length * edge >= SEEN)
        ]
        for entry, run in recordings
    }
    repeats = [one for one in recordings if all(loss.kind != COPY for loss in one[1].losses)]
    for (entry, run), (other, repeat) in permutations(repeats, 2):
        own, its = motion_of(run), motion_of(repeat)
        here, there = (np.array([one.start + 0.5 * one.length for one in long[key.name]]) for key in (entry, other))
        if entry.trajectory == other.trajectory and own and its and len(here) and len(there):
            here = here + (lag(own, its) or 0.0)
            chance = len(here) * len(there) * 2.0 * TOGETHER_S / (len(own) * own.dt)
            there = np.concatenate(([-np.inf], np.sort(there), [np.inf]))
            after = np.searchsorted(there, here)
            near = np.minimum(there[after] - here, here - there[after - 1]) < TOGETHER_S
            if np.count_nonzero(near) > chance + 3.0 * np.sqrt(chance):
                found[entry.name] += [one for one, at_once in zip(long[entry.name], near, strict=True) if at_once]
    return found


def _alone(one: Stretch, run: Run) -> bool:
    """Whether several rows are missing, and seldom as many or half of them: a logger that drops rows does so often."""
    like = sum(other.kind == MISSING and 2.0 * other.length > one.length for other in run.stretches)
    return one.length * max(run.load_rates) > GAP and like < OFTEN


def rounding(campaign: Campaign, streams: Mapping[str, Readings]) -> dict[str, float]:
    """Standard deviation, by channel, of readings that are rounded more coarsely than is stated."""
    return {channel: step / float(np.sqrt(12.0)) for channel, _, step in _coarse(campaign, streams)}


def _coarse(campaign: Campaign, streams: Mapping[str, Readings]) -> Iterator[tuple[str, str, float]]:
    """Channels of the wrench that read in greater steps than is stated, and than their noise hides."""
    rig = campaign.rig
    if "wrench" not in streams:
        return
    index = rig.loads.index(rig.transducer.channels)
    noise, stated = rig.transducer.noise.value[index], rig.transducer.resolution.value[index]
    for column, step in enumerate(streams["wrench"].steps()):
        if step > max(2.0 * noise[column], 1.5 * stated[column]):
            yield rig.transducer.channels[column], rig.loads.units[index[column]], float(step)


def attenuated(amplifier: Amplifier | None, edge: float) -> Iterator[Doubt]:
    """Yield a doubt where the amplifier takes more off at a band's upper edge than may be left uncorrected."""
    if amplifier is None:
        return
    lost = 1.0 - 1.0 / np.sqrt(1.0 + (edge / float(amplifier.corner)) ** (2 * amplifier.order))
    if lost > AMPLIFIED:
        yield Doubt(
            f"the amplifier takes {100.0 * lost:.0f} % off at {edge:g} Hz, the band's upper edge", of_failed=False
        )


def amplified(frequencies: Sequence[float], edge: float) -> Iterator[Doubt]:
    """Yield a doubt where a resonance is so near to a band that what it amplifies is no error, but the signal.

    `budget.resonance` holds for modes above the band's upper edge by half an octave.
    """
    lowest = min(frequencies, default=np.inf)
    if 2.0 * edge**2 > lowest**2:
        yield Doubt(f"the resonance at {lowest:.3g} Hz lies in or next to a band up to {edge:g} Hz")
