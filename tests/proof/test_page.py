"""The score's page shows what the table holds, and says where a rival is better."""

from __future__ import annotations

import re
from pathlib import Path

from proof.answer import Answer, Claim, HeldOut
from proof.page import write_page
from proof.score import Bench, score
from proof.truth import Concealed, Truth
from proof.words import OURS


def bench() -> Bench:
    """A bench of six trials with two methods: ours misses the weak ones, the rival claims a find in a null."""
    truths, answers = [], []
    for index, level in enumerate((0.0, 40.0, 100.0, 300.0, 1000.0, 1000.0)):
        name = f"T{index}"
        law = Concealed(
            port="motor torque", axis="el", family="cogging", name="second harmonic", rho=level, rho_eff=level
        )
        effects = (law,) if level else ()
        truths.append(
            Truth(
                trial=name,
                kind="concealed" if level else "nothing",
                split="development",
                level=level,
                effects=effects,
                rho_eff=level,
            )
        )
        right = Claim(port="motor torque", axis="el", family="cogging", probability=0.97)
        for method, found in ((OURS, level >= 100.0), ("sparse", True)):
            answers.append(
                Answer(
                    method=method,
                    trial=name,
                    detected=found,
                    log10_p=-0.01 * level**2 if found else -0.3,
                    verdict="physics" if found else "none",
                    finds=(right,) if found else (),
                    held_out=HeldOut(before=5.0, after=1.02),
                    seconds=12.0 if method == OURS else 3.0,
                )
            )
    rows = score(truths, answers)
    return Bench(
        split="development", seed="1", command="kbs-process prove", isolation="namespaces", rows=rows,
        truths=tuple(truths), answers=tuple(answers),
    )  # fmt: skip


def test_page_holds_the_table_and_stands_alone(tmp_path: Path) -> None:
    page = tmp_path / "index.html"
    write_page(bench(), page)
    text = re.sub(r"\s+", " ", page.read_text(encoding="utf-8"))
    assert not re.search(r'(src|href)="(?!#|data:)', text)
    for words in (
        "Where a rival is better",
        "second harmonic",
        "80 % [28, 99] 4/5",
        "1 of 1",
        "Made by: kbs-process prove",
    ):
        assert words in text.replace("\u00a0", " "), words
    rivals = text[text.index('<section id="rivals"') : text.index('<section id="trials"')]
    assert "seconds" in rivals and "false find" not in rivals
