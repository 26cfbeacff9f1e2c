"""Which recordings count as predicted worse."""

from __future__ import annotations

import pytest

from kbs_process.diagnosis.gate import Fold, worsened


def folds(*gains: float) -> list[Fold]:
    return [Fold(f"r{k}", 1.0, 1.0, gain) for k, gain in enumerate(gains)]


@pytest.mark.parametrize(
    ("gains", "worse"),
    [
        ((200.0, -5.0), []),  # a chi-square of the law's few numbers
        ((200.0, -30.0), ["r1"]),
        ((5000.0, -30.0), []),  # its formula is not nature's
        ((5000.0, -130.0), ["r1"]),
        ((5.0, -30.0, -40.0), ["r1", "r2"]),
        ((200.0, float("nan")), ["r0", "r1"]),  # a plant that diverged
    ],
)
def test_worse_is_what_chance_and_the_formula_do_not_explain(
    gains: tuple[float, ...], worse: list[str]
) -> None:
    assert worsened(folds(*gains)) == worse
