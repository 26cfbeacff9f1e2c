"""Known parameters alone, refitted: what a classical correlation does. It never names physics that was left out."""

from __future__ import annotations

import numpy as np

from proof.answer import Answer
from proof.rivals.case import Case, held_out

_LEVEL = -3.0  # log10 of the p-value from which a mismatch is said


def solve(case: Case) -> Answer:
    """Return what the refit says; effort: maximum a posteriori over all known parameters, as the diagnosis begins."""
    detected = case.log10_p < _LEVEL
    return Answer(
        method="parameters",
        trial=case.trial,
        detected=detected,
        log10_p=case.log10_p,
        verdict="undecided" if detected else "parameters off" if case.moved else "none",
        moved=case.moved,
        held_out=held_out(case, lambda recording: np.zeros_like(recording.residual)),
        seconds=case.seconds,
    )
