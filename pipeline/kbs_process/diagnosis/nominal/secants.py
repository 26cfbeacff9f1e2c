"""Slopes along valleys, by differences of the plant along these.

Where numbers make up for each other (a stiffness, inertias, the coupling's gain), a step moves each by hundreds of the
differences that its column is taken over, and what the columns say of it nearly cancels: the rest is their errors, as
friction sticks or slips by a hair. So the plant is asked again, over a step that is as long as the valley is.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from kbs_process.diagnosis.nominal.costs import GROSS
from kbs_process.diagnosis.nominal.ground import Ground
from kbs_process.signals.records import Array

if TYPE_CHECKING:
    from kbs_process.diagnosis.nominal.costs import Gradients
    from kbs_process.diagnosis.nominal.tangents import Tangents

_ALIKE = 1e-4  # of what recordings would tell of each number alone: a direction of which they tell less is a valley
_LENGTH = 3.0  # standard deviations of a direction, that it is gone along
_APART = 1e-3  # of the longest: directions that differ by less are one


def along_valleys(search: Tangents, theta: Array, gradients: Gradients) -> Gradients:
    """`gradients` taken at theta (p,), so corrected that they give what the plant does along valleys.

    The least correction that does, lengths in prior sigmas: Broyden's, of several steps at once. What laws add is exact
    and stays. Source: R. B. Schnabel, Quasi-Newton methods using multiple secant equations (1983).
    """
    bases = {drive: slope.base for drive, slope in gradients.items()}
    trials = [k for k in search.experiment.fit if search.experiment.trials[k].drive in bases]
    data = sum(float(z @ z) for z in (search.residual(k, bases) for k in trials))
    rows = sum(search.metric[k].rows for k in trials)
    # Where much is left, standard deviations are as wide, and the plant is not linear over them.
    if not data <= (1.0 + GROSS) * rows:
        return gradients
    weight = 1.0 / max(1.0, data / rows)
    ground = Ground(search, theta, search.jacobians(gradients), weight)
    points = ground.valleys(search.stated, _ALIKE, _LENGTH)
    gone = list(zip(points, search.predict(points, search.references), strict=True))
    gone = [(p, there) for p, there in gone if all(np.isfinite(one.values).all() for one in there.values())]
    if not gone:
        return gradients
    steps = np.array([point - theta for point, _ in gone])
    back = np.linalg.pinv(steps / search.spread, rcond=_APART) / search.spread[:, None]
    new = {}
    for drive, slope in gradients.items():
        seen = np.array([there[drive].values for _, there in gone]) - slope.base.values
        missed = seen - np.tensordot(steps, slope.columns, axes=1)
        new[drive] = replace(slope, columns=slope.columns + np.tensordot(back, missed, axes=1))
    return new
