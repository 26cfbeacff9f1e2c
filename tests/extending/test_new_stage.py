"""A stage is one file in stages/, and one line where the pipeline calls it: studies/correlate/run."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from extending.scratch import copy_package, run_copy
from importers.importer_files import write_csv, write_mapping
from kbs_process.results.tables import read_table
from kbs_process.studies.convert.run import import_recordings

CLIPPED = '''"""Clipping: what exceeds the transducer's range is brought back to it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from kbs_process.signals.records import Run


def apply(run: Run, limit: float) -> Run:
    """Return the run with no force or moment above `limit`, N or N m."""
    assert run.wrench is not None
    clipped = run.wrench.derive(np.clip(run.wrench.values, -limit, limit), f"clipped at {limit}")
    return replace(run, wrench=clipped)
'''

BODY = """
[body.load]
on = "T"
mass = { value = 2.0, unit = "kg", sigma = 0.1, source = "test" }
cog = { value = [0.0, 0.0, 0.0], unit = "m", sigma = 0.01, source = "test" }
inertia = { value = [0.1, 0.1, 0.1, 0.0, 0.0, 0.0], unit = "kg m^2", sigma = 0.0, source = "test" }
"""


def _campaign(folder: Path) -> Path:
    """A weight on a wheel that turns twice in a minute."""
    t = np.arange(0.0, 60.0, 0.05)
    angle, weight = 0.2 * t, 20.0
    noise = 0.1 * np.random.default_rng(1).standard_normal((3, len(t)))
    forces = dict(
        zip(("Fx", "Fy", "Fz"), noise + weight * np.array([np.sin(angle), 0.0 * t, -np.cos(angle)]), strict=True)
    )
    write_csv(folder / "run.csv", {"t": t, **forces, "angle": angle})
    mapping = write_mapping(folder, "run.csv")
    rig = folder / "description" / "parameters" / "rig.toml"
    rig.write_text(rig.read_text() + BODY)
    return import_recordings(mapping, folder, folder / "campaign")


@pytest.mark.slow
def test_a_stage_is_one_file_and_one_line(tmp_path: Path) -> None:
    package = copy_package(tmp_path)
    (package / "stages" / "clipped.py").write_text(CLIPPED)
    pipeline = package / "studies" / "correlate" / "run.py"
    text = pipeline.read_text()
    text, imported = re.subn(r"(from kbs_process\.stages import) ", r"\1 clipped, ", text)
    text, called = re.subn(r"\n( +)(run = relieved\(.*)\n", r"\n\1\2\n\1run = clipped.apply(run, 15.0)\n", text)
    assert (imported, called) == (1, 1)
    pipeline.write_text(text)

    _campaign(tmp_path)
    run_copy(tmp_path, "process", "campaign", "--no-diagnose", "--no-pdf", "--output", "out")
    table = read_table(tmp_path / "out" / "tables" / "gravity" / "turn_1.parquet")
    assert "clipped at 15.0" in table.attrs["history"]
    assert table["Fx.measured"].max() == 15.0
