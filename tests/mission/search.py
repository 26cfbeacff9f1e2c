"""Search the reference day: hour, argument of latitude, azimuth's zero and planned hand-overs nearest to the paper.

`cd tests && python -m mission.search` prints each better day that it finds; docs/1996.md has one. What counts:
how far sections end from the published times, how far slews stay below the rate limit, and slews too many. The
archived mission gives all else. Deterministic for a seed.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass, replace
from datetime import timedelta

import numpy as np

from kbs_process.campaign.mission import boundaries
from kbs_process.errors import ConfigError, MissionError
from kbs_process.mission.planner import Plan, plan
from mission import reference

CYCLE = 1.0  # s: coarser than the controller's, and quick
SPREAD = np.array([0.3, 5.0, 20.0, 60.0, 60.0, 60.0])  # of a try about the best: h, deg, deg, s
FREE = ("2", "4", "5b")  # sections that slew, or end with a slew
SLOW = ("6", "7")  # whose ends are any two extremes of a slow pass: they count less


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """A day: its unknowns, what it costs, where its sections end and how fast they slew."""

    x: np.ndarray  # h UTC, deg of latitude's argument, deg of azimuth's zero, s of three hand-overs
    cost: float
    ends: dict[str, float]  # s
    rates: dict[str, float]  # deg/s
    azimuth: tuple[float, float]  # deg, range


def made(x: np.ndarray) -> Found | None:
    """Plan the day of unknowns `x`; nothing where it cannot be planned."""
    day = reference.day()
    midnight = day.mission.orbit.epoch.replace(hour=0, minute=0)
    orbit = replace(
        day.mission.orbit, epoch=midnight + timedelta(hours=float(x[0])), argument_of_latitude=float(np.radians(x[1]))
    )
    attitude = np.array([0.0, 0.0, np.radians(x[2])])
    mission = replace(day.mission, orbit=orbit, attitude=attitude, hand_overs=tuple(x[3:]), cycle=CYCLE)
    try:
        planned = plan(mission, day.lead)
        found = boundaries(replace(day, mission=mission), planned)
    except (MissionError, ConfigError):
        return None
    ends = {entry.name: end for entry, _, end in found}
    late = {entry.name: abs(end - entry.near) for entry, _, end in found}
    rates = {entry.name: _rate(planned, start, end) for entry, start, end in found if entry.name in FREE}
    slews = sum(phase.mode in ("hand-over", "pre-pointing") for phase in planned.phases)
    cost = (
        max(late[name] for name in late if name not in SLOW) / 100.0
        + max(late[name] for name in SLOW) / 1000.0
        + sum(2.0 - rate for rate in rates.values())
        + 1.0 * abs(slews - len(FREE))
    )
    low, high = np.degrees([planned.q[:, 0].min(), planned.q[:, 0].max()])
    return Found(x, cost, ends, rates, (float(low), float(high)))


def _rate(planned: Plan, start: float, end: float) -> float:
    inside = (planned.t >= start) & (planned.t <= end)
    return float(np.degrees(np.abs(np.diff(planned.q[inside], axis=0)).max() / CYCLE))


def search(start: np.ndarray, tries: int, seed: int) -> Found:
    """Return the best of `tries` days, each a random step from the best so far, in ever smaller steps."""
    rng = np.random.default_rng(seed)
    best = made(start)
    for k in range(tries):
        size = SPREAD * 10.0 ** (-2.0 * k / tries) * rng.standard_normal(len(SPREAD)) * (rng.random(len(SPREAD)) < 0.6)
        one = made((best.x if best else start) + size)
        if one and (best is None or one.cost < best.cost):
            best = one
            print(f"{k:5d} {_words(best)}", flush=True)
    assert best is not None, "no try could be planned: start elsewhere"
    return best


def _words(one: Found) -> str:
    ends = ", ".join(f"{name} {end:.0f}" for name, end in one.ends.items())
    rates = ", ".join(f"{name} {rate:.2f}" for name, rate in one.rates.items())
    low, high = one.azimuth
    return f"{one.cost:.3f}: {np.round(one.x, 3)}; ends / s {ends}; deg/s {rates}; azimuth {low:.0f} to {high:.0f} deg"


def main() -> None:
    """Search from a stated start."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=3)
    parser.add_argument("--tries", type=int, default=400)
    parser.add_argument("--start", type=float, nargs=6, default=[4.5, 186.0, 140.0, 1560.0, 4420.0, 6430.0])
    given = parser.parse_args()
    search(np.array(given.start), given.tries, given.seed)


if __name__ == "__main__":
    main()
