"""A black box: gradient boosting of the residual on the plant's signals.

Effort: scikit-learn's histogram gradient boosting, 200 trees with early stopping, for each of the four channels that
stand highest above the floor; judged on trajectories left out of the fit, relevance by permutation there.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from time import monotonic

import numpy as np

from proof.answer import Answer
from proof.rivals.case import Array, Case, Recording, detrended
from proof.rivals.inputs import Input, Learnt, answer, channels_worth_learning, explained, folds, inputs, matrix

_TREES = 200


def solve(case: Case) -> Answer:
    """Return the answer of the black box."""
    begin = monotonic()
    chosen = inputs(case)
    learnt = {channel: _learn(case, chosen, channel) for channel in channels_worth_learning(case)}
    return answer("boosting", case, chosen, learnt, monotonic() - begin)


def _learn(case: Case, chosen: Sequence[Input], channel: int) -> Learnt:
    scores, relevance = [], np.zeros(len(chosen))
    generator = np.random.default_rng(0)
    for inside, outside in folds(case):
        predict = _fit(chosen, inside, channel)
        whole = explained(outside, channel, lambda r, p=predict: p(matrix(chosen, r)[0]))
        scores.append(whole)
        for place in range(len(chosen)):

            def shuffled(recording: Recording, place: int = place, predict: Predict = predict) -> Array:
                X, of = matrix(chosen, recording)
                X[:, of == place] = X[generator.permutation(len(X))][:, of == place]
                return predict(X)

            relevance[place] += max(0.0, whole - explained(outside, channel, shuffled))
    final = _fit(chosen, case.fitted, channel)
    return Learnt(lambda r: final(matrix(chosen, r)[0]), relevance, float(np.mean(scores)))


Predict = Callable[[Array], Array]


def _fit(chosen: Sequence[Input], recordings: Sequence[Recording], channel: int) -> Predict:
    from sklearn.ensemble import HistGradientBoostingRegressor

    X = np.concatenate([matrix(chosen, r)[0][r.valid] for r in recordings])
    y = np.concatenate([detrended(r, r.residual[:, [channel]])[:, 0] for r in recordings])
    model = HistGradientBoostingRegressor(
        max_iter=_TREES, early_stopping=True, l2_regularization=1.0, random_state=0
    ).fit(X, y)
    return lambda at: np.asarray(model.predict(at), dtype=float)
