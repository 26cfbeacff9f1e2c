"""Tails of the chi-square law so far out that their probability is no number of a computer any more, in logarithms."""

from __future__ import annotations

import numpy as np
from scipy.special import gammaln
from scipy.stats import chi2


def log_tail(x: float, dof: float) -> float:
    r"""Natural logarithm of $P(\chi^2_{dof} > x)$.

    Beyond what floats hold $\Gamma(a, y) \approx y^{a-1} e^{-y} / (1 - (a - 1)/y)$, $a = dof/2$, $y = x/2$: right to
    1/y in the logarithm there.
    """
    found = float(chi2.logsf(x, dof)) if dof > 0 else 0.0
    if np.isfinite(found):
        return found
    a, y = 0.5 * dof, 0.5 * x
    return float((a - 1.0) * np.log(y) - y - gammaln(a) - np.log1p(-(a - 1.0) / y))
