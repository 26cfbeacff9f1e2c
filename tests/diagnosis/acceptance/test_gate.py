"""Which recordings count as predicted worse, and when all of them gain enough."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from kbs_process.diagnosis.acceptance import gate
from kbs_process.diagnosis.acceptance.gate import Fold, foretold, worsened


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
def test_worse_is_what_chance_and_the_formula_do_not_explain(gains: tuple[float, ...], worse: list[str]) -> None:
    assert worsened(folds(*gains)) == worse


@pytest.mark.parametrize(
    ("size", "noise", "enough"),
    [
        (1.0, 1.0, True),  # a law that is right, in recordings that show little of it
        (1.6, 1.0, False),  # of the right form, too strong by more than a half
        (-1.0, 1.0, False),
        (1.0, 100.0, False),  # less than a suspect has to show
    ],
)
def test_a_law_that_is_right_gains_the_square_of_what_it_changes(size: float, noise: float, enough: bool) -> None:
    rng = np.random.default_rng(5)
    law = np.full(2000, 0.4) / noise
    left = rng.standard_normal(2000)
    before, after = (
        SimpleNamespace(experiment=SimpleNamespace(held_out=(0,)), residual=(z,), chi2=[float(z @ z)])
        for z in (left + law, left + law - size * law)
    )
    assert foretold(before, after) == enough  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("gross", "left", "all_of_it"),
    [
        (True, 0.0, True),
        (True, 0.1, False),
        (False, 0.0, False),  # minima of known numbers do differ by little
        (True, 0.04, False),
        (True, 0.02, True),
    ],
)
def test_a_law_may_leave_nothing_of_much(gross: bool, left: float, all_of_it: bool) -> None:
    before, after = SimpleNamespace(gross=gross), SimpleNamespace(excess=left * 2000.0, fit_rows=2000)
    assert gate._all_of_much(before, after) == all_of_it  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("sizes", "motions", "left", "asked"),
    [
        ((1.0, 1.0), (0, 1), 0.0, True),
        ((1.0, 1.0), (0, 0), 0.0, False),  # repeats of what was fitted alone
        ((1.0, 2.5), (0, 1), 0.0, False),  # the other motion asks for less than half of it
        ((2.5, 1.0), (0, 1), 0.0, False),
        ((1.0, 0.0), (0, 1), 0.0, False),  # which shows nothing of it
        ((1.0, 1.0), (0, 1), 0.1, False),  # something is left: it may be that
    ],
)
def test_recordings_of_another_motion_ask_for_a_law_s_size(
    sizes: tuple[float, float], motions: tuple[int, int], left: float, asked: bool
) -> None:
    """Two recordings that were held out, `sizes` what the law is there over what is right."""
    rng = np.random.default_rng(7)
    law = np.full(2000, 0.4)
    noise = [rng.standard_normal(2000) for _ in sizes]
    trials = [SimpleNamespace(trajectory=one) for one in (0, *motions)]
    experiment = SimpleNamespace(fit=(0,), held_out=(1, 2), trials=trials)

    def known(there: bool) -> SimpleNamespace:
        there_is = [n + law * (size > 0.0) - there * size * law for n, size in zip(noise, sizes, strict=True)]
        residual = (law, *there_is)
        return SimpleNamespace(
            experiment=experiment, residual=residual, chi2=[float(z @ z) for z in residual], excess=left * 2000.0,
            fit_rows=2000,
        )  # fmt: skip

    before, after = known(False), known(True)
    assert gate._elsewhere(before, after, tuple) == asked  # type: ignore[arg-type]
    # What changes where the law does nothing is other numbers' doing.
    assert not gate._elsewhere(before, after, lambda: (2,))  # type: ignore[arg-type]
