"""Equations of laws on a page: every one that can be found is drawn, where the line is."""

from __future__ import annotations

import re

import pytest

from kbs_process.plant.effect import Effect
from kbs_process.plant.laws import CATALOGUE, MEASURED, SENSING
from kbs_process.plant.sensing import Sensing
from kbs_process.report.formula import equation, formula
from kbs_process.report.panel import Formula

EVERY = (*CATALOGUE, *SENSING, *MEASURED)


def shown(law: Effect | Sensing) -> str:
    """What a find says of its law."""
    found = re.search(r"Equation:(.*?)(?=Units:|Validity:|Source:|\Z)", law.equation.__doc__ or "", re.DOTALL)
    assert found is not None, law.name
    return " ".join(found[1].split())


@pytest.mark.parametrize("law", EVERY, ids=lambda law: law.name)
def test_every_law_has_an_equation_that_can_be_drawn(law: Effect | Sensing, caplog: pytest.LogCaptureFixture) -> None:
    parts = equation(shown(law)).parts
    formulas = [part for part in parts if isinstance(part, Formula)]
    assert formulas
    assert not re.search(r"[$\\^{}]", "".join(part for part in parts if isinstance(part, str)))
    assert not caplog.records  # of letters that the font has not
    for one in formulas:
        _, top, width, height = one.box
        assert width > 20.0  # hundredths of an em
        assert 50.0 < height < 500.0
        assert top + 0.5 * height == pytest.approx(-26.0)
        # The same box from the path itself: what is drawn is whole, and upright.
        assert re.fullmatch(r"(?:[MLQC]-?[\d. -]+|Z)+", one.outline)
        numbers = [float(number) for number in re.findall(r"-?[\d.]+", one.outline)]
        assert max(numbers[0::2]) == pytest.approx(one.box[0] + width, abs=0.1)
        assert max(abs(y + 26.0) for y in numbers[1::2]) == pytest.approx(0.5 * height, rel=0.2)


def test_tex_that_cannot_be_drawn_is_an_error() -> None:
    with pytest.raises(ValueError, match="Unknown symbol"):
        equation(r"with $a \undefined b$")


def test_the_same_formula_has_the_same_outline_anywhere() -> None:
    alone, _ = equation(r"$T = K_a e$.").parts
    assert alone in equation(r"then $T = K_a e$ and more").parts
    assert alone == formula("$T = K_a e$")


def test_functions_stand_apart_from_their_factors() -> None:
    apart, together = (formula(tex).box[2] for tex in (r"$a \sin x$", r"$a{\sin} x$"))
    assert apart > together + 10.0
    assert formula("$b_+ x$").box[2] < formula("$b + x$").box[2] - 40.0
