"""Amplitude and phase of an effect as its cosine and sine amplitudes: what it does is nearly linear in these.

In amplitude and phase a search that starts half a turn off runs into amplitude zero, where the phase means nothing; in
(x, y) = A (cos phi, sin phi) it passes. A prior of A is no quadratic form there and becomes a row of the residual.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from kbs_process.estimation.fit import Parameters
from kbs_process.identification.screening import LEAST, Phase
from kbs_process.signals.records import Array


@dataclass(frozen=True, slots=True, eq=False)
class Polar:
    """The chart of some pairs; other numbers are themselves."""

    amplitude: tuple[int, ...]
    phase: tuple[int, ...]
    parameters: Parameters  # of amplitudes and phases

    @classmethod
    def of(cls, pairs: Sequence[Phase], parameters: Parameters) -> Polar:
        smooth = [pair for pair in pairs if pair.smooth]
        return cls(tuple(p.amplitude for p in smooth), tuple(p.phase for p in smooth), parameters)

    @property
    def flat_parameters(self) -> Parameters:
        """Priors and bounds in the chart: the pairs have neither."""
        places = [*self.amplitude, *self.phase]
        given = self.parameters
        value, sigma, lower, upper = (array.copy() for array in (given.value, given.sigma, given.lower, given.upper))
        value[list(self.phase)] = value[list(self.amplitude)]  # their scale
        sigma[places], lower[places], upper[places] = np.inf, -np.inf, np.inf
        return replace(given, value=value, sigma=sigma, lower=lower, upper=upper)

    def flat(self, theta: Array) -> Array:
        """(p,) chart coordinates of numbers (p,)."""
        u = theta.copy()
        for a, phi in zip(self.amplitude, self.phase, strict=True):
            u[[a, phi]] = theta[a] * np.cos(theta[phi]), theta[a] * np.sin(theta[phi])
        return u

    def back(self, u: Array) -> Array:
        """Numbers (p,) of chart coordinates (p,); no amplitude is quite zero."""
        theta = u.copy()
        for a, phi in zip(self.amplitude, self.phase, strict=True):
            least = LEAST * self.parameters.value[a]
            theta[[a, phi]] = max(float(np.hypot(u[a], u[phi])), least), np.arctan2(u[phi], u[a])
        return theta

    def excess(self, theta: Array) -> Array:
        """(k,) amplitudes over their priors, in sigmas."""
        at = list(self.amplitude)
        excess: Array = (theta[at] - self.parameters.value[at]) / self.parameters.sigma[at]
        return excess

    def jacobian(self, J: Array, theta: Array) -> Array:
        """Slopes (n + k, p) in the chart of a residual with slopes J (n, p), and of `excess`, at numbers (p,)."""
        rows = np.zeros((len(self.amplitude), J.shape[1]))
        rows[np.arange(len(self.amplitude)), list(self.amplitude)] = 1.0 / self.parameters.sigma[list(self.amplitude)]
        whole = np.vstack([J, rows])
        for a, phi in zip(self.amplitude, self.phase, strict=True):
            c, s = np.cos(theta[phi]), np.sin(theta[phi])
            along, across = whole[:, a].copy(), whole[:, phi] / theta[a]
            whole[:, a], whole[:, phi] = along * c - across * s, along * s + across * c
        return whole
