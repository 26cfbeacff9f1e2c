"""The singularity: a satellite that passes close to the zenith asks for more azimuth rate than there is."""

from __future__ import annotations

from dataclasses import replace

from kbs_process.mission.model import Mission
from kbs_process.mission.passes import Track, followed, rendezvous, runs, within
from kbs_process.signals.records import Array, Mask

STEP = 0.5  # s by which a bridge is tried longer at either end
LONGEST = 600.0  # s at either end


def bridged(track: Track, mission: Mission) -> Track:
    """Return the track with bridges over those cycles near the zenith that the mechanism cannot follow.

    At a distance b from the zenith, azimuth turns at up to n / tan(b) and accelerates by up to 0.65 (n / tan b)^2,
    n being the angular rate of the line of sight. A bridge leaves the track as late, and meets it again as early,
    as the limits allow. Where none is possible within the range, the cycles stay unusable.
    """
    q, usable, on_bridge = track.q.copy(), track.usable.copy(), track.bridged.copy()
    possible = followed(track.rate, track.acceleration, mission.limits)
    for first, last in _crossings(track.in_view & ~possible, round(LONGEST / mission.cycle)):
        found = _shortest(track, first, last, mission)
        if found is not None:
            start, path = found
            end = start + len(path)
            q[start:end], usable[start:end], on_bridge[start:end] = path, True, True
    return replace(track, q=q, usable=usable, bridged=on_bridge)


def _crossings(impossible: Mask, apart: int) -> list[tuple[int, int]]:
    """Runs of cycles that cannot be followed; those less than `apart` cycles from each other are one crossing.

    Azimuth accelerates before the zenith and brakes behind it, and may be possible to follow in between.
    """
    merged: list[tuple[int, int]] = []
    for first, last in runs(impossible):
        if merged and first - merged[-1][1] < apart:
            first = merged.pop()[0]
        merged.append((first, last))
    return merged


def _shortest(track: Track, first: int, last: int, mission: Mission) -> tuple[int, Array] | None:
    """Return where the shortest bridge over cycles first to last starts, and its angles."""
    step = max(1, round(STEP / mission.cycle))
    for wider in range(1, round(LONGEST / STEP)):
        start, end = first - wider * step, last - 1 + wider * step
        if start < 0 or end >= len(track.q) or not (track.usable[start] and track.usable[end]):
            return None
        path = rendezvous(track, start, track, end, mission)
        if path is not None and within(path, mission.limits).all():
            return start, path
    return None
