r"""What fitted numbers are known to: by the noise, by what recordings ask for apart, and by how a search ends.

Noise alone says too little. Hardware is not the same in every run (friction differs by a percent), the plant is not
exact, and both pull a number one way all through a recording: what repeats differ by has their power, but not that they
pull together. With J_k the slopes of recording k of R, z_k what is left of it, whitened, g_k = J_k^T z_k and C the
covariance by the noise, about which a fit would scatter if it were made of other recordings, their covariance is

    C + C G C,   G = R / (R - 1) sum_k (g_k - g) (g_k - g)^T,   g their mean.

A search ends in one of many minima of phases and tooth contact, and slopes beside an edge say nothing of the next: all
deviations count ENDED times. In six states of the searches on four development trials, 37 to 68 % of intervals by the
noise held the truth, of numbers that recordings tell, and 78 to 100 % of these. All had a part in setting ENDED; on two
trials that had none it is 90 % (`tests/proof/coverage.py`).
G holds the noise as well, which so counts twice: where nothing else is, sigmas are 2.8 times the noise's. Its rank is
R - 1 at most, and what all recordings ask for alike is not in it.
Source: K.-Y. Liang, S. L. Zeger, Longitudinal data analysis using generalized linear models, Biometrika 73 (1986) 13.
Validity: numbers that are about right; of a minimum that is wrong by far nothing here knows. Of one recording alone
    its scatter is not known, and the noise's counts.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from kbs_process.diagnosis.nominal.known import Known
from kbs_process.signals.records import Array

ENDED: Final = 2.0


def scattered(known: Known) -> Array:
    """(p, p) covariance of the fitted numbers, in their units; none is known to less than its prior says."""
    fit, C = known.experiment.fit, known.covariance
    if len(fit) > 1:
        pull = np.stack([known.jacobian(k).T @ known.residual[k] for k in fit], axis=1)
        apart = C @ (pull - pull.mean(axis=1, keepdims=True))
        C = C + len(fit) / (len(fit) - 1) * apart @ apart.T
    most = np.minimum(1.0, known.parameters.sigma / (ENDED * np.sqrt(np.diag(C))))
    return np.asarray(ENDED**2 * C * np.outer(most, most), dtype=np.float64)
