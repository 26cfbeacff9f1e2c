"""A diagnosis in the results that processing is about to replace: it took minutes, and is kept where it still holds."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from kbs_process.campaign.config import Campaign
from kbs_process.errors import OutputError
from kbs_process.results.diagnosed import FOLDER, DiagnosisAnswer
from kbs_process.results.provenance import checksums
from kbs_process.results.records import FILE, load
from kbs_process.results.store import link_tree


@dataclass(frozen=True, slots=True)
class EarlierDiagnosis:
    """A diagnosis of before, and why it does not hold any more."""

    folder: Path
    outdated: str  # empty: it is of the same description, parameters and recordings, and is kept

    @property
    def warning(self) -> tuple[str, str]:
        """What a user has to know before it is gone."""
        return (
            f"warning: the diagnosis in {self.folder} {self.outdated}: it will be removed with the results of before",
            "  -> to keep it, interrupt now, and name another folder with --output",
        )


def earlier_diagnosis(campaign: Campaign, results: Path) -> EarlierDiagnosis | None:
    """Return the diagnosis in `results`, if there is one, and whether it is of what the campaign consists of now.

    Files count by name and SHA-256. The software does not: a diagnosis says itself what made it.
    """
    folder = results / FOLDER
    if not os.path.isfile(folder / FILE):  # noqa: PTH113 (a name that is too long is no file)
        return None
    try:
        before = {entry.file: entry.sha256 for entry in load(folder, DiagnosisAnswer).provenance.inputs}
    except OutputError:
        return EarlierDiagnosis(folder, "is in a format of another version")
    now = checksums(campaign.folder, campaign.files)
    changed = sorted(name for name in before.keys() | now.keys() if before.get(name) != now.get(name))
    if not changed:
        return EarlierDiagnosis(folder, "")
    others = f" and {len(changed) - 3} more" if len(changed) > 3 else ""
    return EarlierDiagnosis(folder, f"is of other inputs ({', '.join(changed[:3])}{others} changed, came or went)")


def keep_diagnosis(campaign: Campaign, before: Path, after: Path) -> None:
    """Let the results `after` have the diagnosis of those `before`, if it still holds."""
    found = earlier_diagnosis(campaign, before)
    if found is not None and not found.outdated:
        link_tree(found.folder, after / FOLDER)
