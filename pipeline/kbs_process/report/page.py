"""One self-contained page: no file, font or host beside it, and no script but its own."""

from __future__ import annotations

import base64
import hashlib
import json
import re
import textwrap
from importlib import resources
from typing import Literal

import msgspec
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from kbs_process.report.panel import Block, Fold, Head, Panel

Medium = Literal["screen", "paper"]
_PIECE = 32  # characters of a long word between two places where a line may end
_LONG_WORD = re.compile(r"\S{65,}")  # a checksum stays whole, to be copied


def render(head: Head, sections: tuple[Panel, ...], medium: Medium) -> str:
    """Return the page; on paper without scripts and interactive data."""
    styles = _asset("style.css") + (_asset("uPlot.min.css") if medium == "screen" else "")
    script = _script() if medium == "screen" else ""
    environment = Environment(
        loader=PackageLoader("kbs_process.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters.update(embedded=_embedded, identity=id, divisible=_divisible)
    return environment.get_template("page.html.j2").render(
        head=head,
        panels=sections,
        medium=medium,
        numbers=_numbers(sections),
        policy=_policy(styles, script),
        styles=Markup(styles),
        script=Markup(script),
    )


def _script() -> str:
    """Return uPlot with its licence, and what draws with it."""
    return f"/*\n{_asset('uPlot.LICENSE')}*/\n{_asset('uPlot.iife.min.js')}\n{_asset('plots.js')}"


def _numbers(sections: tuple[Panel, ...]) -> dict[int, int]:
    """Number figures and tables, each kind on its own, by the block's identity."""
    numbers: dict[int, int] = {}
    counts = {"figure": 0, "grid": 0}

    def visit(block: Block) -> None:
        if isinstance(block, Fold):
            for inner in block.blocks:
                visit(inner)
        elif block.kind in counts:
            counts[block.kind] += 1
            numbers[id(block)] = counts[block.kind]

    for section in sections:
        for block in section.blocks:
            visit(block)
    return numbers


def _policy(styles: str, script: str) -> str:
    """Return a content security policy that allows the page's own style, script and images alone."""
    rules = ["default-src 'none'", f"style-src '{_digest(styles)}'", "img-src data:"]
    if script:
        rules.append(f"script-src '{_digest(script)}'")
    return "; ".join([*rules, "base-uri 'none'", "form-action 'none'"])


def _digest(content: str) -> str:
    return f"sha256-{base64.b64encode(hashlib.sha256(content.encode()).digest()).decode('ascii')}"


def _embedded(value: object) -> Markup:
    """Return a value as JSON that cannot end the script element it stands in."""
    text = json.dumps(msgspec.to_builtins(value), separators=(",", ":"), ensure_ascii=True)
    return Markup(text.replace("<", "\\u003c"))


def _divisible(text: str, medium: Medium) -> str:
    """Return `text` such that it can be broken into lines on paper, even if it is one long word."""
    if medium == "screen":  # a browser breaks words by itself
        return text
    return _LONG_WORD.sub(lambda word: "\u200b".join(textwrap.wrap(word[0], _PIECE)), text)


def _asset(name: str) -> str:
    return resources.files("kbs_process.report").joinpath("assets", name).read_text(encoding="utf-8")
