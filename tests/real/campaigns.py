"""Campaigns made of the recordings of real rigs, processed, and the figures that they are held against."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq

from kbs_process.campaign.load import load_campaign
from kbs_process.progress import SilentProgress
from kbs_process.results.records import load
from kbs_process.studies.convert import PRESETS
from kbs_process.studies.convert.run import import_recordings
from kbs_process.studies.correlate.results import Results
from kbs_process.studies.correlate.run import process

EDGE_S = 1.0  # of the scoring filter, at either end


@dataclass(frozen=True)
class Processed:
    """A processed campaign: its folder, and that of its results."""

    folder: Path
    target: Path

    @property
    def results(self):
        return load(self.target, Results)

    @property
    def campaign(self):
        return load_campaign(self.folder)

    def before_and_after(self, recording):
        """Time (n,), decoupled wrench, and the same less gravity and inertia (n, c), from the tables."""
        t, measured = self._table("gravity", recording, "measured")
        unfiltered = f"{recording}.unfiltered"
        _, residual = self._table("bands", unfiltered, "measured")
        _, inertia = self._table("bands", unfiltered, "predicted")
        return t, measured, residual - inertia

    def valid(self, recording):
        """Where unfiltered measurement and prediction know enough, (n,)."""
        return pq.read_table(self.target / "tables" / "bands" / f"{recording}.unfiltered.parquet")["valid"].to_numpy()

    def angle(self, recording, joint):
        return pq.read_table(self.target / "tables" / "aligned" / f"{recording}.parquet")[f"angle.{joint}"].to_numpy()

    def _table(self, stage, name, what):
        table = pq.read_table(self.target / "tables" / stage / f"{name}.parquet")
        columns = [column for column in table.column_names if column.endswith(f".{what}")]
        return table["t"].to_numpy(), np.column_stack([table[column].to_numpy() for column in columns])


def processed(mapping, source, folder, *, page=False):
    """Import files by a mapping into a folder, and process the campaign; pages take longest."""
    campaign = import_recordings(mapping, source, folder / "campaign")
    process(load_campaign(campaign), folder / "results", progress=SilentProgress(), pdf=False, page=page)
    return Processed(campaign, folder / "results")


def exchanged(preset, folder):
    """Copy a preset of two trials, the roles of the trials exchanged: the second is fitted."""
    text = (PRESETS / f"{preset}.toml").read_text(encoding="utf-8")
    assert text.count('role = "fit"') == text.count('role = "held-out"') == 1
    swapped = text.replace('role = "fit"', 'role = "?"').replace('"held-out"', '"fit"')
    template = (PRESETS / "treadmill").as_posix()
    mapping = folder / f"{preset}.toml"
    mapping.write_text(swapped.replace('"?"', '"held-out"').replace('"treadmill/', f'"{template}/'), encoding="utf-8")
    return mapping


def sampling_error(band_Hz, duration_s):
    """Relative standard error of the rms of noise that fills a band: it has 2 B T independent samples."""
    return 1.0 / np.sqrt(2.0 * 2.0 * band_Hz * duration_s)
