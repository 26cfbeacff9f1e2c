"""What a sample of outcomes says of the outcome's distribution, and of what drives it."""

from __future__ import annotations

import numpy as np
from scipy.stats import beta, binom, rankdata

from kbs_process.signals.records import Array, Mask
from kbs_process.studies.flight.results import Likelihood


def probability(successes: int, trials: int) -> Likelihood:
    """Return successes / trials with its Jeffreys interval, which covers 95 % on average over probabilities.

    At 0 and at `trials` the interval is one-sided: it begins at 0, or ends at 1. Source: Brown, Cai, DasGupta,
    Statistical Science 16 (2001).
    """
    inside = beta(successes + 0.5, trials - successes + 0.5)
    return Likelihood(
        value=successes / trials,
        low=0.0 if successes == 0 else float(inside.ppf(0.025)),
        high=1.0 if successes == trials else float(inside.ppf(0.975)),
    )


def upper_bound(outcomes: Array, content: float, confidence: float) -> float | None:
    """Return what a share `content` of all outcomes stays below, with `confidence`; None for too few outcomes.

    Distribution-free, by order statistics (Wilks, Ann. Math. Stat. 12, 1941): the k-th smallest of n is such a bound
    where P(Binomial(n, content) < k) >= confidence. For 95 % and 95 % it takes 59 outcomes. A Latin hypercube's
    outcomes are at least as evenly spread as the independent ones that the theorem asks for.
    """
    n = len(outcomes)
    rank = int(binom.ppf(confidence, n, content)) + 1
    return None if rank > n else float(np.sort(outcomes)[rank - 1])


def importance(parameters: Array, cyclic: Mask, outcomes: Array) -> Array:
    """Return for each column of `parameters` (n, p) the share of the variance of the outcomes' ranks that it explains.

    Squared rank correlation (Spearman) of an ordered number; of a phase, the squared multiple correlation with its
    sine and cosine. By chance alone a share is about 1/n (2/n for a phase): see `by_chance`.
    """
    y = rankdata(outcomes)
    y = (y - y.mean()) / np.linalg.norm(y - y.mean())
    shares = np.empty(parameters.shape[1])
    for index, column in enumerate(parameters.T):
        terms = np.stack([np.sin(column), np.cos(column)], axis=1) if cyclic[index] else rankdata(column)[:, None]
        basis, _ = np.linalg.qr(terms - terms.mean(axis=0))
        shares[index] = float(np.sum((basis.T @ y) ** 2))
    return shares


def by_chance(samples: int, numbers: int) -> float:
    """Return the share that one of `numbers` parameters without effect exceeds with 5 % probability.

    A squared correlation of a phase with noise is Beta(1, (n - 3) / 2), of an ordered number less; the greatest of p is
    bounded by Bonferroni's inequality. Three samples or fewer lie on some phase's curve, whatever they are.
    """
    if samples <= 3:
        return 1.0
    return float(beta.isf(0.05 / numbers, 1.0, 0.5 * (samples - 3)))
