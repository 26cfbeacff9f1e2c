"""The numbers that are known with an uncertainty, and how a prediction answers to them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from kbs_process.diagnosis.experiments.experiment import Experiment
from kbs_process.diagnosis.experiments.hypothesis import Hypothesis, Prediction, Simulate, Task, decoupling
from kbs_process.estimation.fit import Parameters
from kbs_process.identification import output_error, unknowns
from kbs_process.identification.output_error import Scalar
from kbs_process.rig.model import Rig, substitute
from kbs_process.signals.records import WRENCH_CHANNELS, Array, Mask

COUPLING = "transducer.cross_coupling"


def known_parameters(rig: Rig, effects: Sequence[str]) -> tuple[Scalar, ...]:
    """Every number with an uncertainty: of drives, transducer, bodies, then the cross-coupling's rows that are read."""
    gears = unknowns.gearbox(rig, effects) if any(joint.drive for joint in rig.joints) else ()
    others = unknowns.others(rig, gears)
    quantity = rig.transducer.cross_coupling
    rows = [WRENCH_CHANNELS.index(channel) for channel in rig.transducer.channels]
    coupling = [Scalar(COUPLING, (i, j)) for i in rows for j in range(6) if quantity.sigma[i, j] > 0.0]
    return (*gears, *others, *coupling)


def prior(rig: Rig, nominal: Rig, effects: Sequence[str], free: Sequence[Scalar]) -> Parameters:
    """Means, sigmas and bounds; phases have neither sigma nor bounds.

    Numbers that the files' rig has are known as these say, wherever a search has taken them; others as `rig` says.
    """
    known = nominal.quantities()
    own = {name: quantity for name, quantity in rig.quantities().items() if name in known}
    mixed = substitute(rig, {name: known[name].value for name in own}, {name: known[name].sigma for name in own})
    return unknowns.prior(output_error.Experiment(mixed, tuple(effects), tuple(free), (), 0.0))


def within(parameters: Parameters, reach: float, among: Mask | None = None) -> Parameters:
    """Bounds no farther than `reach` sigmas from the means, of all that have a sigma or of those `among` them."""
    chosen = np.isfinite(parameters.sigma) & (True if among is None else among)
    apart = np.where(chosen, reach * parameters.sigma, np.inf)
    return replace(
        parameters,
        lower=np.maximum(parameters.lower, parameters.value - apart),
        upper=np.minimum(parameters.upper, parameters.value + apart),
    )


@dataclass(frozen=True, slots=True, eq=False)
class Slopes:
    """Derivatives of what a drive shows by the free numbers, at some values of these."""

    base: Prediction
    columns: Array  # (p, n, c)
    taken: Array  # (p, n, c) as differences had them, before steps of a search corrected them


def slopes(
    experiment: Experiment,
    hypothesis: Hypothesis,
    free: Sequence[Scalar],
    differences: Array,
    drives: Sequence[int],
    simulate: Simulate,
    *,
    keep: Mapping[int, tuple[Sequence[int], Array]] | None = None,
) -> dict[int, Slopes]:
    """Difference the plant in each free number by `differences` (p,); the cross-coupling's columns are exact.

    `keep` holds, for some drives, which numbers' columns (indices) need not be taken again, and all columns as they
    were taken.
    """
    tasks: list[Task] = [(drive, hypothesis) for drive in drives]
    places: list[tuple[int, int]] = []
    kept = keep or {}
    for drive in drives:
        known = set(kept[drive][0]) if drive in kept else set()
        for index, scalar in enumerate(free):
            if scalar.quantity == COUPLING or index in known:
                continue
            places.append((drive, index))
            moved = hypothesis.at([scalar], hypothesis.values([scalar]) + differences[index])
            tasks.append((drive, moved))
    found = simulate(tasks)
    bases = dict(zip(drives, found, strict=False))
    columns = {
        drive: kept[drive][1].copy() if drive in kept else np.zeros((len(free), *bases[drive].values.shape))
        for drive in drives
    }
    for (drive, index), moved_prediction in zip(places, found[len(drives) :], strict=True):
        columns[drive][index] = (moved_prediction.values - bases[drive].values) / differences[index]
    for drive, index in places:
        if not np.isfinite(columns[drive][index]).all():
            columns[drive][index] = _inward(hypothesis, free[index], -differences[index], bases[drive], simulate, drive)
    M, wrench = decoupling(experiment), experiment.wrench_channels
    rows = [WRENCH_CHANNELS.index(channel) for channel in experiment.rig.transducer.channels]
    for index, scalar in enumerate(free):
        if scalar.quantity == COUPLING:
            i, j = scalar.element
            for drive in drives:
                acting = bases[drive].wrench[:, j]
                columns[drive][index][:, :wrench] = acting[:, None] * M[:, rows.index(i)]
    return {drive: Slopes(bases[drive], columns[drive], columns[drive]) for drive in drives}


def _inward(
    hypothesis: Hypothesis, scalar: Scalar, difference: float, base: Prediction, simulate: Simulate, drive: int
) -> Array:
    """A slope to the other side, where the plant cannot run on the first; none, where it cannot run on either."""
    value = hypothesis.values([scalar]) + difference
    moved = simulate([(drive, hypothesis.at([scalar], value))])[0].values
    slope: Array = (moved - base.values) / difference
    return slope if np.isfinite(slope).all() else np.zeros_like(slope)
