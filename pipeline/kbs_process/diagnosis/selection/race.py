"""Leaders of a screen in the plant: each goes a few steps, then who leads shows the others the way.

Phases of tooth contact that made up for what was left out are farther away than a descent goes, and to look for better
ones costs more than all else. Where they are right beside one law, they are about right beside each that does the same.
So whoever leads looks for them, and the others begin where it has brought the known numbers; then the next one does, as
a wrong law that leads shows a wrong way. Where the most promising does not do what the screen promised, known numbers
were pulled too far: they are drawn back beside it and let go again.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from kbs_process.diagnosis.experiments.floor import Floor
from kbs_process.diagnosis.experiments.thresholds import FAR_BEHIND, FIRST, MOST, SETTLED_TIMES, TOLERATED, WAYS
from kbs_process.diagnosis.nominal.joint import Entered, Own, Standing, bare, entered, moved_on, with_extra
from kbs_process.diagnosis.nominal.settling import detected, released
from kbs_process.diagnosis.proposing.sizes import of_mounting, sized
from kbs_process.diagnosis.proposing.tryout import extra_of
from kbs_process.diagnosis.proposing.view import View
from kbs_process.diagnosis.screening.screen import Found
from kbs_process.diagnosis.selection.effort import Effort
from kbs_process.diagnosis.side_by_side import side_by_side


@dataclass(frozen=True, slots=True, eq=False)
class Runner:
    """A suspect in the plant, as far as it has come."""

    found: Found
    standing: Standing
    leapt: bool = False  # whether better phases were looked for beside it

    @property
    def cost(self) -> float:
        """-2 log posterior; infinite for a plant that diverged."""
        return float(np.nan_to_num(self.standing.known.cost, nan=np.inf))


def raced(chosen: Sequence[Found], view: View, floor: Floor, simulate: Effort, *, leaps: bool = True) -> list[Runner]:
    """Suspects refitted, best first. Those that the first steps leave far behind go no farther.

    A search that has cost too much is told so before each look for better phases, which there is if `leaps`.
    """

    def begun(found: Found) -> Entered:
        extra = extra_of(found, view.standing, view.bench, view.scene)
        start = entered(view.standing, extra, simulate)
        # Where numbers have yet to give way, to a cord that carries weight, it begins worse than nothing.
        return start.on(1 if start.left < view.standing.known.excess else 2)

    def gone_on(of: Entered) -> Entered:
        return of.on(FIRST - 1).ended() if of.left <= far else of

    def led(by: Standing, runner: Runner) -> Runner:
        """A runner from where another has brought the known numbers, if it gets farther from there."""
        extra = extra_of(runner.found, by, view.bench, view.scene)
        known = runner.standing.known
        extra = replace(extra, start=known.value[len(view.standing.known.free) :])
        new = replace(runner, standing=with_extra(by, extra, simulate))
        return min(runner, new, key=lambda one: one.cost)

    if view.standing.known.gross:
        chosen = [sized(view.bench, one, view.suspects, simulate) if of_mounting(one) else one for one in chosen]
    heat = side_by_side(begun, chosen)
    far = FAR_BEHIND * max(min((one.left for one in heat), default=0.0), TOLERATED * view.standing.known.fit_rows)
    ahead = side_by_side(gone_on, heat)
    runners = [Runner(found, one.standing) for found, one in zip(chosen, ahead, strict=True)]
    runners.sort(key=lambda one: -one.found.score.gain)
    if runners and _stuck(runners[0], view):
        runners[0] = replace(runners[0], standing=released(runners[0].standing, floor, simulate))
    runners.sort(key=lambda one: one.cost)
    near = [one for one in runners if _near(one, runners[0])]
    behind = [one for one in runners if one not in near]
    for _ in range(WAYS):
        next_one = next((one for one in near if not one.leapt), None)
        if next_one is None or at_floor(near[0], floor) or not simulate.goes_on():
            break
        first = replace(next_one, standing=moved_on(next_one.standing, simulate, leaps=leaps), leapt=True)
        way = bare(first.standing, own_of(first.found, view.standing, first.standing), simulate)
        others = [one for one in near if one is not next_one]
        near = [first, *side_by_side(partial(led, way), others)]
        near.sort(key=lambda one: one.cost)
    return [*near, *behind]


def own_of(found: Found, before: Standing, after: Standing) -> Own:
    """The numbers that a law has brought: its amplitudes, then its shapes."""
    names = after.known.names[len(before.known.names) :]
    return Own(names, names[: len(found.suspect.amplitudes)])


def _stuck(runner: Runner, view: View) -> bool:
    """Whether it does less than half of what the screen promised, beside numbers that something had pulled.

    They stand where they made up for what was left out, and a few steps do not bring them back. What they gain without
    it, as they do where they were drawn back, is not its own.
    """
    bounded = view.bench.background.bounded
    alone = 0.0 if bounded is None else bounded.alone
    gained = view.standing.known.cost - alone - runner.cost
    return runner.standing.known.strained and gained < MOST * runner.found.score.gain


def _near(one: Runner, best: Runner) -> bool:
    least = best.standing.known
    return one.standing.known.excess <= SETTLED_TIMES * max(least.excess, TOLERATED * least.fit_rows)


def at_floor(one: Runner, floor: Floor) -> bool:
    """Whether it leaves nothing of the recordings that are fitted."""
    experiment = one.standing.known.experiment
    return not detected(one.standing, floor, experiment.fit).left
