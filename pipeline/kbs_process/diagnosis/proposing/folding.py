"""Periods of an encoder's error, found by folding: as stars that pulsate are, when what comes again is no sine."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from kbs_process.diagnosis.nominal.known import Known
from kbs_process.diagnosis.screening.scene import Scene
from kbs_process.signals.records import Array

_PHASES = 16  # of a period, into which an error is folded
_PERIODS = 3  # that are tried, with the next orders on either side
_HIGHEST = 1000.0  # to a turn: beyond it a code's interpolation is looked for
_FASTEST = 0.999  # share of the steps between samples, beyond which a gap lies


def periods(known: Known, scene: Scene) -> dict[str, tuple[float, ...]]:
    """Periods of each encoder's error, rad: whole parts of a turn into which what is left of it folds best.

    Of power that the mean at each of some phases takes; orders closer than half a line's width are one.
    Source: R. F. Stellingwerf, Period determination using phase dispersion minimization, ApJ 224 (1978) 953.
    """
    experiment, found = known.experiment, dict[str, tuple[float, ...]]()
    for channel in range(experiment.loads, len(experiment.channels)):
        angle, error = (np.concatenate(parts) for parts in zip(*_errors(known, scene, channel), strict=True))
        turns, step = np.ptp(angle) / (2.0 * np.pi), np.quantile(np.abs(np.diff(angle)), _FASTEST)
        if not (turns > 0.0 and step > 0.0 and np.any(error)):
            continue
        # Fewer than two periods in the range are any curve; at each phase of one there are to be readings.
        orders = np.arange(np.ceil(2.0 / turns), min(_HIGHEST, 2.0 * np.pi / (_PHASES * step)))
        taken = np.array([_folded(angle * (order / (2.0 * np.pi)), error) for order in orders])
        best: list[float] = []
        for k in np.argsort(-taken, kind="stable"):
            if all(abs(orders[k] - other) >= 0.5 / turns for other in best):
                best.append(float(orders[k]))
        near = {order + aside for order in best[:_PERIODS] for aside in (-1.0, 0.0, 1.0)}
        found[experiment.channels[channel]] = tuple(2.0 * np.pi / order for order in orders.tolist() if order in near)
    return found


def _errors(known: Known, scene: Scene, channel: int) -> Iterator[tuple[Array, Array]]:
    """Angle (n,) at an encoder, and what is left of its reading, mean aside, in every trial that is fitted."""
    experiment = known.experiment
    for k in experiment.fit:
        trial = experiment.trials[k]
        reference = experiment.reference(trial.trajectory)
        angle = scene.predicted[reference].values[: len(trial.valid), channel]
        # With laws of the readings that were found, which the plant's own angle is without.
        shown = known.shown.get(reference, scene.predicted[reference]).values[: len(trial.valid), channel]
        off = (trial.measured[:, channel] - shown)[trial.valid]
        yield angle[trial.valid], off - off.mean()


def _folded(phase: Array, error: Array) -> float:
    """Power of errors (n,) that their means take at each phase, of which one is 1."""
    cell = np.floor(phase % 1.0 * _PHASES).astype(np.intp) % _PHASES
    count = np.bincount(cell, minlength=_PHASES)
    return float(np.sum(np.bincount(cell, error, _PHASES) ** 2 / np.maximum(count, 1)))
