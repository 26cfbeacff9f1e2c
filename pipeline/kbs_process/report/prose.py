"""Sentences from templates: a study computes facts, its folder prose/ holds the words."""

from __future__ import annotations

from functools import cache

from jinja2 import Environment, PackageLoader, StrictUndefined


def lines(study: str, template: str, **facts: object) -> list[str]:
    """Return the lines of a template in a study's folder prose/, filled with facts; a fact that is missing is an error.

    Blank lines are left out.
    """
    filled = _environment(study).get_template(f"{template}.j2").render(facts)
    return [line.strip() for line in filled.split("\n") if line.strip()]


def prose(study: str, template: str, **facts: object) -> str:
    """Return the same as one paragraph."""
    return " ".join(lines(study, template, **facts))


@cache
def _environment(study: str) -> Environment:
    return Environment(
        loader=PackageLoader(f"kbs_process.studies.{study}", "prose"),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
