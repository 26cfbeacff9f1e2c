"""What a study says in words: the passages of its templates, filled with facts."""

from __future__ import annotations

import re
from functools import cache

from jinja2 import Environment, PackageLoader, StrictUndefined

from kbs_process.report import text
from kbs_process.report.panel import Caption

_FORMATS = (
    text.band_hz, text.count, text.element, text.exact, text.frame_label, text.measure, text.number, text.percent,
    text.unit,
)  # fmt: skip
_BLANKS = re.compile(r"[ \n]+")  # a space that does not break stays


class Prose:
    """The passages of STUDY/prose/NAME.j2, one a block of the template.

    Lines end where they may in the template; a passage is one line of text. Every fact that it names has to be given.
    The functions of `report.text` are its filters: {{ share | percent(2) }}.
    """

    def __init__(self, study: str, name: str) -> None:
        self._study, self._name = study, name

    def __call__(self, passage: str, **facts: object) -> str:
        """Return a passage with the facts that it names."""
        template = _environment(self._study).get_template(f"{self._name}.j2")
        words = "".join(template.blocks[passage](template.new_context(facts)))
        return _BLANKS.sub(" ", words).strip()

    def caption(self, figure: str, **facts: object) -> Caption:
        """Return a figure's caption: its passages FIGURE_shown, FIGURE_good, FIGURE_bad and FIGURE_do."""
        shown, good, bad, do = (self(f"{figure}_{part}", **facts) for part in ("shown", "good", "bad", "do"))
        return Caption(shown, good, bad, do)


@cache
def _environment(study: str) -> Environment:
    """The templates in a study's folder `prose`."""
    environment = Environment(loader=PackageLoader(study, "prose"), undefined=StrictUndefined, autoescape=False)
    environment.filters.update({function.__name__: function for function in _FORMATS})
    return environment
