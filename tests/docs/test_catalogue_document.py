"""The document of the catalogue names every law, at its port, and no other."""

from __future__ import annotations

import re
from pathlib import Path

from kbs_process.plant.effect import Port
from kbs_process.plant.laws import CATALOGUE, MEASURED, SENSING
from kbs_process.plant.sensing import SensingPort

TEXT = (Path(__file__).parents[2] / "docs" / "catalogue.md").read_text(encoding="utf-8")
WORDS: dict[Port | SensingPort, str] = {
    **{port: port.name.lower().replace("_", " ") for port in (*Port, *SensingPort)},
    Port.EXTERNAL_FORCE: "force on a link",
}


def test_every_law_is_listed_at_its_port() -> None:
    rows = [line.split("|")[1:3] for line in TEXT.splitlines() if line.startswith("| `")]
    listed = {name: port.strip() for names, port in rows for name in re.findall(r"`(\w+)`", names)}
    assert listed == {law.name: WORDS[law.port] for law in (*CATALOGUE, *MEASURED, *SENSING)}
