"""A campaign folder to damage: EL089's description with empty recordings, which loading does not open."""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path

import pytest

from kbs_process.campaign.load import load_campaign
from kbs_process.errors import ConfigError

EXAMPLE = Path(__file__).parents[2] / "campaigns" / "EL089"
RECORDINGS = ("AZPS_ATA", "EL089P00_1", "EL089P00_2", "EL089P00_3")


@dataclass(frozen=True, slots=True)
class CampaignFolder:
    """A copy of the example that a test may edit."""

    path: Path

    def replace(self, file: str, old: str, new: str) -> int:
        """Replace the first `old` in a file, and return the number of the line where it was."""
        text = (self.path / file).read_text(encoding="utf-8")
        assert old in text, f"{old!r} is not in {file}"
        (self.path / file).write_text(text.replace(old, new, 1), encoding="utf-8")
        return text[: text.index(old)].count("\n") + 1

    def append(self, file: str, text: str) -> None:
        """Add text at the end of a file."""
        with (self.path / file).open("a", encoding="utf-8") as stream:
            stream.write(text)

    def refusal(self) -> ConfigError:
        """Return the error that loading ends with."""
        with pytest.raises(ConfigError) as caught:
            load_campaign(self.path)
        return caught.value


def make_folder(target: Path) -> CampaignFolder:
    """Copy the example to `target`, with empty files for recordings."""
    shutil.copytree(EXAMPLE / "parameters", target / "parameters")
    text = (EXAMPLE / "campaign.toml").read_text(encoding="utf-8")
    lines = [line for line in text.splitlines() if not line.startswith("sha256")]
    (target / "campaign.toml").write_text("\n".join(lines) + "\n", encoding="utf-8")
    (target / "recordings").mkdir()
    for name in RECORDINGS:
        (target / "recordings" / f"{name}.mcap").touch()
    return CampaignFolder(target)
