"""Finds that later ones made needless.

What was found first may have stood in for what was found later, or for phases that had not been found yet.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from kbs_process.diagnosis.finding import explained_share
from kbs_process.diagnosis.floor import Floor
from kbs_process.diagnosis.gate import gate
from kbs_process.diagnosis.hypothesis import Simulate
from kbs_process.diagnosis.joint import Standing, without
from kbs_process.diagnosis.leaders import taken
from kbs_process.diagnosis.outcome import Find
from kbs_process.diagnosis.thresholds import TAKEN


@dataclass(frozen=True, slots=True, eq=False)
class Accepted:
    find: Find
    names: tuple[str, ...]  # of its numbers; none of a law that was taken off each recording


def needed(
    accepted: Sequence[Accepted], standing: Standing, floor: Floor, simulate: Simulate
) -> tuple[list[Accepted], Standing]:
    """Leave out what later finds made needless: each has to pass the gate once more, as the last of all.

    Finds of one law at one place are one.
    """
    kept: list[Accepted] = []
    for k, one in enumerate(accepted):
        others = [*kept, *accepted[k + 1 :]]
        alone = len(kept) == k and k + 1 == len(accepted)  # nothing has changed since it was found
        alike = any(other.find.identity == one.find.identity for other in others)
        if alone or alike or not one.names:
            kept.append(one)
            continue
        rest = without(standing, one.names, simulate)
        known = standing.known
        free = ~np.isfinite(known.parameters.sigma)
        amplitudes = [i for i, name in enumerate(known.names) if name in one.names and free[i]]
        verdict = gate(rest.known, known, amplitudes)
        if verdict.passed and taken(rest, standing, floor) >= TAKEN:
            share = explained_share(rest.known, known)
            kept.append(replace(one, find=replace(one.find, gate=verdict, held_out_variance=share)))
        else:
            standing = rest
    return kept, standing
