"""The whitened residual of all recordings and its slopes, by differences, for a search to go down by."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from kbs_process.estimation.fit import Parameters
from kbs_process.estimation.linearise import Unpredicted
from kbs_process.identification.output_error import Experiment, Spectra
from kbs_process.identification.screening import Evaluate, Task
from kbs_process.identification.unknowns import frictions
from kbs_process.signals.records import Array

DIFFERENCE = 0.05  # prior sigmas (phases: rad), first difference
SEEN = 5.0  # what a difference should move the whitened residual by: above its jumps where friction sticks
MOST_DIFFERENCE = 0.4  # prior sigmas
_LEAST_DIFFERENCE = 5e-3  # likewise
_FAR = 1.5  # prior sigmas, along a principal direction


class Objective:
    """Whitened residual and its Jacobian over all recordings; theta is free numbers, then run-to-run factors less 1.

    Columns of numbers from `gears` on, which hardly move from their priors, are differenced once and kept; the others
    at every point. To both sides if `central`. `correction` of each recording, constant, is added to its residual;
    with `unpredicted`, the residual is whitened by that too (slopes are not).
    """

    def __init__(
        self,
        experiment: Experiment,
        spectra: Sequence[Spectra],
        evaluate: Evaluate,
        differences: Array,
        gears: int,
        *,
        central: bool,
        columns: Mapping[int, list[Array]] | None = None,
        correction: Sequence[Array] = (),
        unpredicted: Unpredicted | None = None,
    ) -> None:
        self.experiment, self.spectra, self.gears, self.central = experiment, spectra, gears, central
        self.evaluate = evaluate
        self.differences = differences
        self.columns = dict(columns or {})
        self.correction = correction
        self.unpredicted = unpredicted
        self.scaled = frictions(experiment)
        self._last: tuple[bytes, list[Array]] = (b"", [])
        self._sloped = b""  # where the columns were taken

    def in_recordings(self, theta: Array) -> list[Array]:
        """Free numbers as each recording has them."""
        p = len(self.experiment.free)
        if len(theta) == p:  # as in all of them
            return [theta] * len(self.experiment.recordings)
        factors = 1.0 + theta[p:].reshape(len(self.experiment.recordings), len(self.scaled))
        found = []
        for row in factors:
            values = theta[:p].copy()
            values[list(self.scaled)] *= row
            found.append(values)
        return found

    def parts(self, theta: Array) -> list[Array]:
        """Residual of each recording."""
        key = theta.tobytes()
        if key != self._last[0]:
            (parts,) = self._parts([theta])
            self._last = (key, parts)
        return self._last[1]

    def _parts(self, thetas: Sequence[Array]) -> list[list[Array]]:
        """Residuals of each recording at many points, evaluated together and corrected."""
        found, count = self.evaluate(self.tasks(thetas)), len(self.experiment.recordings)
        each = [found[k : k + count] for k in range(0, len(found), count)]
        if not self.correction:
            return each
        return [[part + c for part, c in zip(parts, self.correction, strict=True)] for parts in each]

    def correct(self, correction: Sequence[Array]) -> None:
        """Take another correction from here on."""
        self.correction, self._last = correction, (b"", [])

    def tasks(self, thetas: Sequence[Array]) -> list[Task]:
        """All recordings at the first point, at the second, and so on."""
        return [(r, values, self.spectra[r]) for theta in thetas for r, values in enumerate(self.in_recordings(theta))]

    def residual(self, theta: Array) -> Array:
        """(n,) of all recordings."""
        return self._whole(self.parts(theta))

    def residuals(self, thetas: Sequence[Array]) -> list[Array]:
        """The same at many points, evaluated together."""
        return [self._whole(parts) for parts in self._parts(thetas)]

    def _whole(self, parts: Sequence[Array]) -> Array:
        whole = np.concatenate(parts)
        return whole if self.unpredicted is None else self.unpredicted.whitened(whole)

    def jacobian(self, theta: Array) -> Array:
        """(n, p + factors)."""
        self.difference(theta)
        return self.assembled(theta)

    def difference(self, theta: Array) -> None:
        """Bring the columns that are due to `theta`."""
        if theta.tobytes() == self._sloped and len(self.columns) == len(self.experiment.free):
            return
        self._sloped = theta.tobytes()
        base = self.in_recordings(theta)
        due = [i for i in range(len(self.experiment.free)) if i < self.gears or i not in self.columns]
        sides = (1.0, -1.0) if self.central else (1.0,)
        tasks = [(r, values, self.spectra[r]) for r, values in enumerate(base)]
        for i in due:
            for side in sides:
                for r, values in enumerate(base):
                    moved = values.copy()
                    moved[i] += side * self.differences[i]
                    tasks.append((r, moved, self.spectra[r]))
        found = iter(self.evaluate(tasks))
        here = [next(found) for _ in base]
        for i in due:
            forward = [next(found) for _ in base]
            back = [next(found) for _ in base] if self.central else here
            span = len(sides) * self.differences[i]
            self.columns[i] = [(a - b) / span for a, b in zip(forward, back, strict=True)]

    def along_principal(self, theta: Array, R: Array, scale: Array) -> Array:
        """(n, p + factors), by central differences along the principal directions of what earlier slopes know.

        R (p, p): triangle of those. Numbers that recordings know little of but in combination have long columns that
        nearly cancel. Differenced one by one, what events of sticking add to each does not cancel and makes information
        out of noise; moved together, such numbers hardly move the events, and the difference may be great.
        """
        p = len(self.experiment.free)
        _, length, V = np.linalg.svd(R * scale)
        h = np.clip(SEEN / np.maximum(length, 1e-30), _LEAST_DIFFERENCE, _FAR)
        base = self.in_recordings(theta)
        tasks = [
            (r, values + side * h[k] * scale * V[k], self.spectra[r])
            for k in range(p)
            for side in (1.0, -1.0)
            for r, values in enumerate(base)
        ]
        found, count = self.evaluate(tasks), len(base)
        for r in range(count):
            each = found[r::count]
            D = np.column_stack([(each[2 * k] - each[2 * k + 1]) / (2.0 * h[k]) for k in range(p)])
            slopes = D @ V / scale
            for index in range(p):
                self.columns.setdefault(index, [np.empty(0)] * count)[r] = slopes[:, index]
        return self.assembled(theta)

    def assembled(self, theta: Array) -> Array:
        """Columns of the recordings in one matrix; a factor's column is that of its torque in its recording."""
        sizes = [len(part) for part in self.columns[0]]
        p, m = len(self.experiment.free), len(self.scaled)
        J = np.zeros((sum(sizes), len(theta)))
        begin = 0
        for r, size in enumerate(sizes):
            rows = slice(begin, begin + size)
            begin += size
            for index in range(p):
                J[rows, index] = self.columns[index][r]
            for k, index in enumerate(self.scaled):
                J[rows, p + r * m + k] = self.columns[index][r] * theta[index]
                J[rows, index] *= 1.0 + theta[p + r * m + k]
        return J


def first_differences(parameters: Parameters) -> Array:
    differences: Array = np.where(np.isfinite(parameters.sigma), parameters.sigma, 1.0) * DIFFERENCE
    return differences


def settled(columns: Mapping[int, list[Array]], parameters: Parameters) -> Array:
    """Differences that move the whitened residual by about `SEEN`."""
    size = np.where(np.isfinite(parameters.sigma), parameters.sigma, 1.0)
    length = lengths(columns, range(len(size)))
    settled: Array = np.clip(SEEN / np.maximum(length, 1e-30), _LEAST_DIFFERENCE * size, MOST_DIFFERENCE * size)
    return settled


def lengths(columns: Mapping[int, list[Array]], which: range) -> Array:
    return np.array([np.sqrt(sum(float(part @ part) for part in columns[i])) for i in which])
