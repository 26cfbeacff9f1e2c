"""How large the forces are that the equations lack, each row of its own: from repeats, as often as they differ.

    S <- S sum over repeats (f - fbar)^2 / S / numbers,   numbers = rows less those that the motion has taken up

to its fixed point (restricted maximum likelihood of a variance). What numbers are left of a row that is white is told
by one random probe, of which only what lies in the band is seen, as of the row itself: as good as its rows are many.
Kind of estimate: M. Hutchinson, Commun. Stat. Simul. 19 (1990) 433.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kbs_process.diagnosis.smoothing.basis import in_band
from kbs_process.diagnosis.smoothing.columns import Columns
from kbs_process.diagnosis.smoothing.fit import State
from kbs_process.diagnosis.smoothing.problem import Problem
from kbs_process.signals.records import Array

_SEED = 1996


@dataclass(frozen=True, slots=True, eq=False)
class Powers:
    """Power of each row over that which its sigma has, (rows,)."""

    of_repeats: Array | None  # by which they differ; None without any
    of_all: Array  # that is left

    @property
    def noise(self) -> Array:
        """What is noise in them, as far as repeats tell."""
        return self.of_all if self.of_repeats is None else self.of_repeats


def powers(problem: Problem, state: State) -> Powers:
    """Compare what rows leave with what their sigmas say."""
    free: dict[int, Array] = {}
    for g, members in enumerate(problem.groups):
        free |= dict.fromkeys(members, _free(problem, state, g))
    left = [residual / state.sigma for residual in state.residuals(problem)]
    weight = [recording.weight[:, None] for recording in problem.recordings]
    every = sum((np.sum(z**2 * w, axis=0) for z, w in zip(left, weight, strict=True)), np.zeros(problem.rows))
    power = numbers = np.zeros(problem.rows)
    for own in problem.repeats:
        first = max(problem.recordings[k].first for k in own)
        end = min(problem.recordings[k].first + problem.recordings[k].n for k in own)
        cut = [slice(first - problem.recordings[k].first, end - problem.recordings[k].first) for k in own]
        common = np.prod([weight[k][c] for k, c in zip(own, cut, strict=True)], axis=0)
        z = np.stack([left[k][c] for k, c in zip(own, cut, strict=True)])
        power = power + np.sum((z - z.mean(axis=0)) ** 2 * common, axis=(0, 1))
        share = np.mean([free[k] / weight[k].sum() for k in own], axis=0)
        numbers = numbers + (len(own) - 1) * common.sum() * share
    of_repeats = power / numbers if problem.repeats else None
    return Powers(of_repeats, every / sum(free.values()))


def _free(problem: Problem, state: State, g: int) -> Array:
    """Numbers (rows,) of each row that the band and a motion leave, of each recording of a group."""
    recording, (motion, root) = problem.recordings[problem.groups[g][0]], state.banded(problem, g)
    rng = np.random.default_rng([_SEED, g])
    white = in_band(rng.choice([-1.0, 1.0], root.shape), recording.dt)
    whole = np.mean(white**2, axis=0) * recording.weight.sum()
    probes = Columns.of(len(white), problem.rows, ((row, row, one) for row, one in enumerate((white * (root > 0.0)).T)))
    against = motion.against(probes)
    taken = np.sum(against**2, axis=(0, 1))
    return np.asarray(np.maximum(whole - taken, 1e-3 * whole))
