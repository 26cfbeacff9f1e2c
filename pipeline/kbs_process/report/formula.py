"""Formulas in running text, as outlines: a page that has no fonts beside it shows them anywhere, and alike."""

from __future__ import annotations

import re

import numpy as np
from matplotlib.font_manager import FontProperties
from matplotlib.path import Path
from matplotlib.textpath import TextToPath

from kbs_process.report import draw
from kbs_process.report.panel import Equation, Formula
from kbs_process.signals.records import Array

_SIZE = 1.12  # em of the text about it: the serif's small letters are then as high as the text's
_MIDDLE = 0.26  # em of the text, half of its x height: where CSS has the middle of a line
_LETTERS = {Path.MOVETO: "M", Path.LINETO: "L", Path.CURVE3: "Q", Path.CURVE4: "C", Path.CLOSEPOLY: "Z"}
# mathtext leaves no space between a factor and the name of a function, and one about a sign that is an index.
_FACTOR = re.compile(r"(?<=[\w})|])\s+(?=\\(?:sin|cos|tanh|exp|min|max|operatorname)\b)")
_SIGN = re.compile(r"([_^])([+-])")


def equation(text: str) -> Equation:
    """Return text with the TeX between its dollar signs as formulas; ValueError for TeX that mathtext has not."""
    pieces = re.split(r"(\$[^$]+\$)", text)
    return Equation(tuple(formula(piece) if piece.startswith("$") else piece for piece in pieces if piece))


def formula(tex: str) -> Formula:
    """Return the outline of "$...$", in hundredths of an em of the text, downwards from its baseline.

    Its box extends as far above the middle of a line as below.
    """
    spaced = _FACTOR.sub(r"\\,", _SIGN.sub(r"\1{\2}", tex))
    with draw.style():
        outlines = TextToPath()
        font = FontProperties(family="DejaVu Sans", math_fontfamily="stix")
        vertices, codes = outlines.get_text_path(font, spaced, ismath=True)
    scale = 100.0 * _SIZE / outlines.FONT_SCALE
    path = Path(scale * np.asarray(vertices) * [1.0, -1.0], codes)
    box, middle = path.get_extents(), -100.0 * _MIDDLE
    half = max(middle - box.y0, box.y1 - middle)
    return Formula(
        tex=tex.strip("$"),
        outline="".join(_step(points, code) for points, code in path.iter_segments(simplify=False)),
        box=(float(box.x0), float(middle - half), float(box.width), float(2.0 * half)),
    )


def _step(points: Array, code: np.uint8) -> str:
    """A segment of a path as SVG has it."""
    numbers = () if code == Path.CLOSEPOLY else (f"{number:.1f}".removesuffix(".0") for number in points)
    return _LETTERS[code] + " ".join(numbers)
