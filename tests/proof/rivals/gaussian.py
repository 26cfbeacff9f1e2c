"""A Gaussian process for the discrepancy, after Kennedy & O'Hagan (J. R. Stat. Soc. B 63:425, 2001).

Effort: scikit-learn's regressor with a squared exponential of a length scale an input (automatic relevance
determination) and white noise, fitted by marginal likelihood to 300 samples spread over the fit recordings,
for each of the four channels that stand highest above the floor. Relevance is the inverse length scale.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from time import monotonic
from typing import TYPE_CHECKING

import numpy as np

from proof.answer import Answer
from proof.rivals.case import Array, Case, Recording, detrended
from proof.rivals.inputs import Input, Learnt, answer, channels_worth_learning, explained, folds, inputs, matrix

if TYPE_CHECKING:
    from sklearn.gaussian_process import GaussianProcessRegressor

_SAMPLES = 300


def solve(case: Case) -> Answer:
    """Return the answer of the Gaussian process."""
    begin = monotonic()
    chosen = inputs(case)
    learnt = {channel: _learn(case, chosen, channel) for channel in channels_worth_learning(case)}
    return answer("gaussian process", case, chosen, learnt, monotonic() - begin)


def _learn(case: Case, chosen: Sequence[Input], channel: int) -> Learnt:
    model, predict = _fit(chosen, case.fitted, channel, None)
    kernel = model.kernel_
    scores = []
    for inside, outside in folds(case):
        _, left = _fit(chosen, inside, channel, kernel)
        scores.append(explained(outside, channel, left))
    lengths = np.atleast_1d(kernel.get_params()["k1__k2__length_scale"])
    _, of = matrix(chosen, case.fitted[0])
    relevance = np.zeros(len(chosen))
    np.maximum.at(relevance, of, 1.0 / lengths)
    return Learnt(predict, relevance, float(np.mean(scores)))


def _fit(
    chosen: Sequence[Input], recordings: Sequence[Recording], channel: int, kernel: object | None
) -> tuple[GaussianProcessRegressor, Callable[[Recording], Array]]:
    """Fit to samples spread over recordings; with `kernel`, its numbers are kept."""
    from sklearn.exceptions import ConvergenceWarning
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel

    X = np.concatenate([matrix(chosen, r)[0][r.valid] for r in recordings])
    y = np.concatenate([detrended(r, r.residual[:, [channel]])[:, 0] for r in recordings])
    middle, spread = X.mean(axis=0), X.std(axis=0) + 1e-12
    some = np.linspace(0, len(X) - 1, min(_SAMPLES, len(X))).astype(int)
    start = ConstantKernel(1.0, (1e-3, 1e4)) * RBF(np.ones(X.shape[1]), (0.1, 1e3)) + WhiteKernel(1.0, (1e-3, 1e4))
    model = GaussianProcessRegressor(
        start if kernel is None else kernel, optimizer="fmin_l_bfgs_b" if kernel is None else None, random_state=0
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)  # a length scale at its bound: an irrelevant input
        model.fit((X[some] - middle) / spread, y[some])

    def predict(recording: Recording) -> Array:
        at = (matrix(chosen, recording)[0] - middle) / spread
        return np.asarray(model.predict(at), dtype=float)

    return model, predict
