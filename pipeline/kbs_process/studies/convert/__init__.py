"""Files in foreign formats into a campaign's folder; `run` is where to begin.

A mapping (a TOML file, schemas/import.schema.json) says which columns are which channels, in which units, and
which files become which recordings; presets for public recordings come with the package. The formats themselves
are below, in recordings/formats.
"""

from __future__ import annotations

from pathlib import Path

PRESETS = Path(__file__).parent / "presets"


def preset_names() -> tuple[str, ...]:
    """Return the names of the mappings that come with the package."""
    return tuple(sorted(path.stem for path in PRESETS.glob("*.toml")))
