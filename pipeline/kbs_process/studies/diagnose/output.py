"""What a diagnosis leaves on disk: results.json, tables of what is unexplained, the corrected model, and the report."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from kbs_process.campaign.config import Campaign
from kbs_process.diagnosis.acceptance.outcome import Location, Outcome
from kbs_process.diagnosis.experiments.floor import Floor
from kbs_process.diagnosis.experiments.nuisance import unknown_terms
from kbs_process.diagnosis.nominal.known import Known
from kbs_process.diagnosis.selection.next_test import Proposal
from kbs_process.report.build import build
from kbs_process.results.outcome import Outcome as Told
from kbs_process.results.records import encode
from kbs_process.results.store import writing
from kbs_process.results.tables import write_table
from kbs_process.rig.model import Rig
from kbs_process.signals.records import Array
from kbs_process.studies.diagnose.corrected import CORRECTED, write_corrected
from kbs_process.studies.diagnose.records import COMMANDS, results_of, seen_channels
from kbs_process.studies.diagnose.written import Shown, shown_by

MAPS = "residual_map"


def write_diagnosis(
    campaign: Campaign,
    floor: Floor,
    outcome: Outcome,
    target: Path,
    pdf: bool | None,
    proposal: Proposal | None = None,
    verb: str = "diagnose",
) -> Told:
    """Write results, tables, corrected model and report to `target`, and the commands of the next test.

    `verb` is that of the command that was given, none of processing.
    """
    known = outcome.known
    with writing(target) as folder:
        files = write_corrected(campaign, outcome, folder / CORRECTED)
        corrected = shown_by(folder / CORRECTED, outcome.standing.known)
        if proposal is not None:
            (folder / COMMANDS).write_text(commands_of(proposal, campaign.rig), encoding="utf-8")
        _maps(folder, outcome)
        for k in range(len(known.experiment.trials)):
            _spectra(folder, known, corrected.known, k)
            _histories(folder, known, corrected, k)
        names = [path.relative_to(folder).as_posix() for path in files]
        results = results_of(campaign, floor, outcome, corrected, names, proposal, verb)
        (folder / "results.json").write_bytes(encode(results))
        from kbs_process.studies.diagnose.report import DOCUMENT  # draws: takes its time to import

        page = build(folder, DOCUMENT, pdf)
    lines = [results.verdict.sentence, f"{results.model}: {target / CORRECTED}"]
    if proposal is not None:
        lines.append(f"Next test: {target / COMMANDS}")
    return Told(tuple(lines), None, target / page.name)


def _spectra(folder: Path, before: Known, after: Known, k: int) -> None:
    """Power over the floor, before and after."""
    experiment, name = before.experiment, before.experiment.trials[k].name
    f = after.metric[k].whiten.f
    seen = seen_channels(after, k)
    columns: dict[str, Array] = {"f": f}
    for side, known in (("before", before), ("after", after)):
        power = np.mean(known.metric[k].layout(known.residual[k]) ** 2, axis=0)
        columns |= {f"{experiment.channels[c]}.{side}": power[:, c] for c in seen}
    columns |= {f"{experiment.channels[c]}.noise": np.ones(len(f)) for c in seen}
    units = {column: "Hz" if column == "f" else "1" for column in columns}
    path = folder / "tables" / "residual_spectrum" / f"{name}.parquet"
    write_table(path, columns, units, frame="T", recording=name)


def _histories(folder: Path, known: Known, corrected: Shown, k: int) -> None:
    """Measured less predicted in the channels' units, before and after, without what no recording knows.

    As where they are judged (`diagnosis/experiments/nuisance.py`), that is a constant and a slope of each load
    channel with a bias, and a constant of each angle, whose slope would be a mismatch.
    """
    experiment = known.experiment
    trial = experiment.trials[k]
    t: Array = experiment.dt * np.flatnonzero(trial.valid).astype(np.float64)
    columns: dict[str, Array] = {"t": t}
    units = {"t": "s"}
    A, own = np.stack([np.ones(len(t)), t], axis=1), unknown_terms(experiment)
    for side, model in (("before", known.shown[trial.drive].values), ("after", corrected.values[k])):
        left = (trial.measured - model)[trial.valid]
        for c in seen_channels(known, k):
            x, terms = left[:, c], A[:, : own[c]]
            columns[f"{experiment.channels[c]}.{side}"] = x - terms @ np.linalg.lstsq(terms, x, rcond=None)[0]
            units[f"{experiment.channels[c]}.{side}"] = experiment.units[c]
    path = folder / "tables" / "residual" / f"{trial.name}.parquet"
    write_table(path, columns, units, frame="T", recording=trial.name)


def _maps(folder: Path, outcome: Outcome) -> None:
    """Write a table for each trajectory that was fitted: rms over the floor before any find, and after all."""
    before, after = outcome.place, outcome.left
    if before is None or after is None or len(before.cells.t) != len(after.cells.t):
        return
    cells = before.cells
    sizes = {"before": _size(before), "after": _size(after)}
    found = before.test.significant.astype(np.float64)
    trials = outcome.standing.known.experiment.trials
    for number in np.unique(cells.trajectory):
        own = cells.trajectory == number
        recording = next(trial.name for trial in trials if trial.trajectory == number)
        columns = {"t": cells.t[own], "f": cells.f[own]} | {name: size[own] for name, size in sizes.items()}
        columns["significant"] = found[own]
        units = dict.fromkeys(columns, "1") | {"t": "s", "f": "Hz"}
        path = folder / "tables" / MAPS / f"{number}.parquet"
        write_table(path, columns, units, frame="T", recording=recording)


def _size(place: Location) -> Array:
    """(cells,) rms of the whitened mean residual over all channels that are seen; 1 at the floor."""
    power = np.sum(np.abs(place.cells.z) ** 2, axis=1)
    return np.asarray(np.sqrt(power / np.maximum(place.cells.seen, 1)), dtype=np.float64)


def commands_of(proposal: Proposal, rig: Rig) -> str:
    """CSV as `simulate --command` reads it: t (s), angles (rad) and rates (rad/s) of all joints."""
    schedule, names = proposal.trajectory.schedule, rig.joint_names
    head = ["t", *names, *(f"{name}.rate" for name in names)]
    rows = np.column_stack([schedule.t, schedule.position, schedule.rate])
    lines = [",".join([f"{row[0]:.6g}", *(f"{value:.9f}" for value in row[1:])]) for row in rows]
    return "\n".join([",".join(head), *lines]) + "\n"
