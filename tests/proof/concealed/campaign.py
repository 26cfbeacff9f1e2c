"""A trial's campaign.toml: the same words in every trial, but for its name and its recordings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from proof.concealed.articles import FILES

_TEXT = """#:schema ../../schemas/campaign.schema.json
schema = 1
name = "{name}"
title = "Two-axis pointing mechanism on its transducer"
drive = "command"

[bands]
high_pass_Hz = 0.01
low_pass_Hz = [1.0, 2.0]
working_rate_Hz = 20.0

[topics]
wrench = "/transducer/wrench"
encoder = "/encoder"
command = "/command"
field = "/motor/field"

[parameters]
files = [{files}]

[model]
effects = [
    "synchronous_motor",
    "cogging",
    "motor_viscous",
    "dynamic_friction",
    "tooth_stiction",
    "flexspline",
]
"""


def describe(folder: Path, recordings: Sequence[Mapping[str, Any]]) -> None:
    """Write the description of a campaign with these recordings."""
    text = _TEXT.format(name=folder.name, files=", ".join(f'"{file}"' for file in FILES))
    for entry in recordings:
        text += "\n[[recording]]\n"
        text += "".join(f"{k} = {v}\n" if isinstance(v, int) else f'{k} = "{v}"\n' for k, v in entry.items())
    (folder / "campaign.toml").write_text(text)
