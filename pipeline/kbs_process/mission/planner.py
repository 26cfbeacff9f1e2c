"""The trajectory of a day: which satellite is tracked when, and how the antenna gets from one to the next.

Rules. A satellite is held until it is lost: behind the Earth, out of the mechanism's range, or faster than the
mechanism; or until a hand-over to another is planned. Then the antenna goes to the satellite that it can be tracking
first, by both axes at once: a hand-over, if that one is in view already, as fast as the limits allow; else
pre-pointing to where it will rise, in all the time there is.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Literal

import numpy as np

from kbs_process.errors import MissionError
from kbs_process.mission.geometry import boresight, separation
from kbs_process.mission.model import Mission
from kbs_process.mission.passes import Track, rendezvous, runs, track, within
from kbs_process.mission.zenith import bridged
from kbs_process.signals.records import Array

Mode = Literal["tracking", "zenith", "hand-over", "pre-pointing"]
EventKind = Literal["acquisition", "loss", "elevation-extreme", "azimuth-extreme"]

HELD = 60.0  # s that a satellite has to stay usable for, to be worth going to
STRIDE = 1.0  # s between the arrival times that are tried
_ROUNDING = 1e-6  # relative, by which differences of angles may exceed a limit


@dataclass(frozen=True, slots=True)
class Phase:
    """A stretch of the trajectory in one mode, from cycle `start` up to, and without, `end`."""

    mode: Mode
    relay: str  # the satellite tracked or gone to
    start: int
    end: int


@dataclass(frozen=True, slots=True)
class Event:
    """A moment that a section of the day may end at."""

    kind: EventKind
    relay: str
    t: float  # s


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """Desired angles at the start of every cycle, and the satellite that they are meant for."""

    t: Array  # (n,) s after the orbit's epoch
    q: Array  # (n, 2) rad
    offset: Array  # (n,) rad, from the planned boresight to the line of sight to the phase's satellite
    phases: tuple[Phase, ...]
    events: tuple[Event, ...]

    def extremes(self, cycle: float) -> tuple[Array, Array]:
        """Greatest rate (2,) rad/s and acceleration (2,) rad/s^2 commanded, from the angles' differences."""
        rate = np.diff(self.q, axis=0) / cycle
        return np.abs(rate).max(axis=0), np.abs(np.diff(rate, axis=0)).max(axis=0) / cycle


def plan(mission: Mission, lead: float = 0.0) -> Plan:
    """Plan the trajectory from `lead` s before the epoch to the end of the mission.

    Raises MissionError where no satellite can be tracked at the beginning or reached later, or none is tracked when a
    hand-over is planned.
    """
    cycle = mission.cycle
    before, after = round(lead / cycle), round(mission.duration / cycle)
    ahead = round(mission.orbit.nodal_period / cycle)  # what the last phase of the plan may aim at
    t = cycle * np.arange(-before, after + ahead + 1, dtype=np.float64)
    n = before + after + 1
    tracks = [bridged(track(mission, relay, t), mission) for relay in mission.relays]
    q = np.empty((len(t), 2))
    offset = np.empty(len(t))
    phases: list[Phase] = []
    k, current = 0, _first(tracks)
    planned = [before + round(begin / cycle) for begin in mission.hand_overs]
    while True:
        lost = _lost(current, k)
        left = _left(current, k, lost, planned)
        others = [one for one in tracks if one is not current] if left < lost else tracks
        q[k:left] = current.q[k:left]
        phases.extend(_modes(current, k, left))
        if left < n:
            arrival, target, path = _next(others, current, left - 1, mission)
            q[left:arrival] = path[1:]
            mode: Mode = "hand-over" if target.in_view[left] else "pre-pointing"
            phases.append(Phase(mode, target.relay.name, left, arrival))
            current, k = target, arrival
        else:
            break
    phases = [Phase(p.mode, p.relay, p.start, min(p.end, n)) for p in phases if p.start < n]
    for at in planned:
        if not any(p.start < at <= p.end and p.mode in ("tracking", "zenith") for p in phases):
            raise MissionError(
                f"at {(at - before) * cycle:g} s a hand-over is planned, and no satellite is tracked then",
                where="[[hand_over]]",
                remedy="plan it while one is tracked, or leave it out",
            )
    by_name = {one.relay.name: one for one in tracks}
    for phase in phases:
        span = slice(phase.start, phase.end)
        offset[span] = separation(boresight(q[span]), by_name[phase.relay].u[span])
    made = Plan(t[:n], q[:n], offset[:n], tuple(phases), _events(t[:n], q[:n], phases))
    _check(made, mission)
    return made


def _first(tracks: list[Track]) -> Track:
    """Return the first satellite of the list that can be tracked at the beginning."""
    for one in tracks:
        if one.usable[0]:
            return one
    raise MissionError(
        "no relay satellite can be tracked at the beginning",
        where="[orbit]",
        remedy="choose another epoch or argument of latitude",
    )


def _lost(track: Track, k: int) -> int:
    """First cycle from k on in which the satellite cannot be tracked; the number of cycles where there is none."""
    gone = np.flatnonzero(~track.usable[k:])
    return k + int(gone[0]) if len(gone) else len(track.usable)


def _left(track: Track, k: int, lost: int, planned: list[int]) -> int:
    """First cycle after k in which a hand-over is planned and no bridge under way, at most `lost`."""
    free = [at + np.flatnonzero(~track.bridged[at - 1 : lost]) for at in planned if k < at < lost]
    return min((int(at[0]) for at in free if len(at)), default=lost)


def _modes(track: Track, start: int, end: int) -> list[Phase]:
    """Split a stretch on a track into tracking and bridges over the zenith."""
    cuts = sorted(
        {start, end, *(k for run in runs(track.bridged[start:end]) for k in (start + run[0], start + run[1]))}
    )
    return [
        Phase("zenith" if track.bridged[a] else "tracking", track.relay.name, a, b) for a, b in itertools.pairwise(cuts)
    ]


def _next(tracks: list[Track], current: Track, k: int, mission: Mission) -> tuple[int, Track, Array]:
    """Return the earliest arrival on any track from cycle k of the current one, and the angles on the way."""
    stride, held = max(1, round(STRIDE / mission.cycle)), round(HELD / mission.cycle)
    found: list[tuple[int, Track, Array]] = []
    for one in tracks:
        arrivals = (
            arrival
            for first, last in runs(one.usable & ~one.bridged)
            for arrival in range(max(first, k + 2), min(last, len(one.usable)) - held, stride)
        )
        for arrival in arrivals:
            if found and arrival >= found[0][0]:
                break
            path = rendezvous(current, k, one, arrival, mission)
            if path is not None and within(path, mission.limits).all():
                found = [(arrival, one, path)]
                break
    if not found:
        raise MissionError(
            f"after {k * mission.cycle:.0f} s no relay satellite can be reached within an orbit",
            where="[limits]",
            remedy="widen the mechanism's range or rates, or add a relay satellite",
        )
    return found[0]


def _events(t: Array, q: Array, phases: list[Phase]) -> tuple[Event, ...]:
    """Return losses, acquisitions and, while a satellite is tracked, turns of either axis, in order of time."""
    kinds: tuple[EventKind, EventKind] = ("azimuth-extreme", "elevation-extreme")
    events: list[Event] = []
    for index, phase in enumerate(phases):
        if phase.mode in ("hand-over", "pre-pointing"):
            events.append(Event("loss", phases[index - 1].relay, float(t[phase.start])))
            if phase.end < len(t):
                events.append(Event("acquisition", phase.relay, float(t[phase.end])))
        elif phase.mode == "tracking":
            sense = np.sign(np.diff(q[phase.start : phase.end], axis=0))
            for turn, axis in zip(*np.nonzero(sense[1:] * sense[:-1] < 0.0), strict=True):
                events.append(Event(kinds[axis], phase.relay, float(t[phase.start + turn + 1])))
    return tuple(sorted(events, key=lambda event: event.t))


def _check(made: Plan, mission: Mission) -> None:
    """Refuse a trajectory that breaks a limit: what cannot be followed must not be commanded."""
    limits = mission.limits
    rate, acceleration = made.extremes(mission.cycle)
    whole = 1.0 + _ROUNDING
    broken = rate.max() > whole * limits.rate or acceleration.max() > whole * limits.acceleration
    if broken or not within(made.q, limits).all():
        raise MissionError(
            f"the planned trajectory breaks the limits: {np.degrees(rate.max()):.3f} deg/s, "
            f"{np.degrees(acceleration.max()):.4f} deg/s^2",
            where="[limits]",
            remedy="report this with the mission file: it is a fault of the planner",
        )
