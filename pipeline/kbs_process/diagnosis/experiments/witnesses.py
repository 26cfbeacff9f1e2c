"""Recordings that say nothing of a law, as it does nothing in them."""

from __future__ import annotations

from kbs_process.diagnosis.experiments.hypothesis import Simulate
from kbs_process.diagnosis.experiments.thresholds import LEAST_RHO
from kbs_process.diagnosis.nominal.joint import Own, Standing, bare


def blind(standing: Standing, own: Own, simulate: Simulate) -> frozenset[int]:
    r"""Held-out trials in which a law does too little to be seen, all other numbers being what they are.

    Equation: $|W (y - y_0)|^2 < \rho^2$, $y_0$ being what the plant without the law predicts there, and $\rho$ the
        distance from which on a suspect is looked at.
    Validity: what changes in such a recording when all numbers are refitted is the others' doing. A motion of one axis,
        with phases of its own that no other recording shows, had been predicted worse beside a friction of the other
        axis that was right (development), and refused it.
    """
    known, out = standing.known, bare(standing, own, simulate).known
    does = {k: known.residual[k] - out.residual[k] for k in known.experiment.held_out}
    return frozenset(k for k, change in does.items() if float(change @ change) < LEAST_RHO**2)
