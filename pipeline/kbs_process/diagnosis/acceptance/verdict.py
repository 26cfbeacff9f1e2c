"""The gate's verdict on a law in the plant: by recordings that were not used, and by what such a law may do at all."""

from __future__ import annotations

from functools import partial

import numpy as np

from kbs_process.diagnosis.acceptance.finding import explained_share
from kbs_process.diagnosis.acceptance.gate import Gate, foretold, gate
from kbs_process.diagnosis.acceptance.plausible import drives, oversized, pushes, undone
from kbs_process.diagnosis.acceptance.remains import blind
from kbs_process.diagnosis.experiments.hypothesis import Simulate
from kbs_process.diagnosis.experiments.thresholds import GATE_SIGMA, LAW_VARIANCE, TOLERATED
from kbs_process.diagnosis.nominal.joint import Own, Standing
from kbs_process.diagnosis.proposing.curves import CurveSuspect
from kbs_process.diagnosis.proposing.tryout import identity, in_plant
from kbs_process.diagnosis.screening.screen import Catalogued, Found
from kbs_process.diagnosis.screening.shapes import bends, fitted, standing_still
from kbs_process.plant.effect import UNNAMED
from kbs_process.signals.records import Array


def gated(
    found: Found, before: Standing, after: Standing, own: Own, simulate: Simulate, *, least: float = GATE_SIGMA
) -> Gate:
    """The gate's verdict on a law that `after` has and `before` is without; sizes have to be such as it may have."""
    known = after.known
    places = [known.names.index(name) for name in own.amplitudes]
    shapes = [known.names.index(name) for name in own.names if name not in own.amplitudes]
    nothing = partial(blind, after, own, simulate)
    verdict = gate(before.known, known, places, shapes, least=least, blind=nothing)
    # What minima of the known parameters leave differs, and is no law's.
    share = explained_share(before.known, known, beyond=TOLERATED)
    index = np.array(places)
    a, C = known.value[index], known.covariance[np.ix_(index, index)]
    if identity(found.suspect).family == UNNAMED:
        if share is None and known.experiment.held_out and not foretold(before.known, known, nothing()):
            verdict = verdict.but("recordings that were held out leave nothing that would show a curve")
        if share is not None and not share >= LAW_VARIANCE:
            verdict = verdict.but(f"a curve that explains {100.0 * share:.0f} % of the held-out excess is no law")
    if isinstance(found.suspect, CurveSuspect):
        return verdict.but(*pushes(found.suspect, a, C))
    if not isinstance(found.suspect, Catalogued):
        return verdict
    free = _undone(found.suspect, a, known.value[shapes])
    return verdict.but(
        *oversized(found.suspect, a, np.sqrt(np.diag(C)), free),
        *drives(found.suspect, a, C),
        *(standing_still(found.suspect, known.value[shapes].tolist()) if in_plant(found.suspect) else ()),
    )


def _undone(suspect: Catalogued, values: Array, shapes: Array) -> frozenset[str]:
    """Amplitudes of a law of some shape in the plant that others of it undo.

    Of finds that are one law together, the first one's come first.
    """
    if not in_plant(suspect):
        return frozenset()
    amplitudes = dict(zip(suspect.amplitudes, map(float, values), strict=False))
    own = len(bends(suspect.candidate, suspect.scene.hypothesis.rig))
    return undone(fitted(suspect, shapes[:own].tolist()), amplitudes)
