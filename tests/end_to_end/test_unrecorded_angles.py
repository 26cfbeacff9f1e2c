"""Where the encoders stopped, gravity is not known: nothing there is judged, and the report says so."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from end_to_end.short_campaign import JOINTS, short_campaign
from kbs_process.campaign.load import load_campaign
from kbs_process.progress import SilentProgress
from kbs_process.recordings.mcap.messages.encoding import OutStream
from kbs_process.recordings.mcap.writer import write_mcap
from kbs_process.studies.correlate.run import process

pytestmark = pytest.mark.slow

STOPPED = 12.0  # s, of twenty


def test_a_disturbance_is_not_judged_where_the_angles_are_missing(tmp_path: Path):
    folder = short_campaign(tmp_path / "EL089")
    stamp = np.arange(2000) * 10_000_000
    angle = np.stack([np.zeros(2000), 1.3 + 0.1 * np.sin(0.5 * stamp * 1e-9)], axis=1)
    command = np.concatenate([angle[::10], np.gradient(angle[::10], 0.1, axis=0)], axis=1)
    wrench = np.tile([0.0, 0.0, -274.0, -6.0, 5.0, 0.0], (2000, 1))
    seen = stamp * 1e-9 < STOPPED
    write_mcap(
        folder.path / "recordings" / "EL089P00_2.mcap",
        [
            OutStream("/transducer/wrench", "wrench", stamp, stamp, wrench),
            OutStream("/encoder", "joints", stamp[seen], stamp[seen], angle[seen], JOINTS),
            OutStream("/command", "joints", stamp[::10], stamp[::10], command, JOINTS),
        ],
    )
    out = tmp_path / "out"
    process(load_campaign(folder.path, checksums=False), out, progress=SilentProgress(), page=False)

    for band in ("unfiltered", "lt1Hz", "lt2Hz"):
        table = pq.read_table(out / "tables" / "bands" / f"EL089P00_2.{band}.parquet")
        t, valid = table["t"].to_numpy(), table["valid"].to_numpy()
        assert not valid[t > STOPPED].any()
        assert valid[(t > 5.0) & (t < STOPPED - 4.0)].all()
    warnings = json.loads((out / "results.json").read_text())["warnings"]
    (said,) = [w["what"] for w in warnings if "in no figure" in w["what"]]
    assert said.startswith(("8.", "9.")) and "of 20 s" in said
