"""What an identification leaves on disk: results.json, tables, corrected parameter files, and the report."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from kbs_process.campaign.config import Campaign
from kbs_process.campaign.writing.parameter_files import corrected, write_parameters
from kbs_process.estimation.whittle import periodogram
from kbs_process.identification.output_error import Measured
from kbs_process.report.build import publish
from kbs_process.report.prose import Prose
from kbs_process.results import provenance
from kbs_process.results.outcome import Outcome
from kbs_process.results.records import Notice
from kbs_process.results.store import writing
from kbs_process.results.tables import write_table
from kbs_process.signals.records import WRENCH_CHANNELS, WRENCH_UNITS, Array, Mask
from kbs_process.studies.identify import findings
from kbs_process.studies.identify.findings import Outcomes, Prediction
from kbs_process.studies.identify.report import DOCUMENT
from kbs_process.studies.identify.results import Followed, IdentifyResults

PARAMETERS = "identified/parameters"
_SAYS = Prose("kbs_process.studies.identify", "notes")


def write_identification(campaign: Campaign, outcomes: Outcomes, target: Path, pdf: bool | None) -> Outcome:
    """Write results, tables, parameter files and report to `target`."""
    with writing(target) as folder:
        source = "identified from " + ", ".join(r.name for r in outcomes.found.experiment.recordings)
        changed = corrected(campaign, findings.quantities(outcomes, source), source)
        written = write_parameters(folder / PARAMETERS, changed)
        for prediction in outcomes.predictions:
            _tables(folder, outcomes, prediction)
        files = tuple(path.relative_to(folder).as_posix() for path in written)
        results = _results(campaign, outcomes, files)
        return publish(folder, target, results, DOCUMENT, pdf, f"Parameter files: {target / PARAMETERS}")


def _results(campaign: Campaign, outcomes: Outcomes, files: tuple[str, ...]) -> IdentifyResults:
    found = outcomes.found
    experiment = found.experiment
    parameters = tuple(findings.identified(outcomes))
    misfits = tuple(one for prediction in outcomes.predictions for one in findings.misfits(experiment, prediction))
    checks = tuple(findings.checks(outcomes, parameters, misfits))
    phases = findings.phases_of(experiment)
    return IdentifyResults(
        name=campaign.name,
        title=campaign.title,
        article=campaign.article,
        verdict=findings.verdict(checks, misfits, parameters),
        provenance=provenance.made(
            "identify",
            campaign.folder,
            campaign.files,
            options=f"--starts {outcomes.settings.starts} --run-to-run {outcomes.settings.run_to_run:g}",
        ),
        band_Hz=experiment.bands(experiment.recordings[0])[0],
        samples=len(found.jacobian),
        misfit_rms=found.fit.residual_rms,
        run_to_run=outcomes.settings.run_to_run,
        parameters=parameters,
        starts=tuple(
            Followed(
                start_cost=mode.start.cost,
                cost=mode.cost,
                phases={
                    experiment.free[one.phase].name: findings.wrapped(float(mode.values[one.phase])) for one in phases
                },
            )
            for mode in found.modes
        ),
        checks=checks,
        misfits=misfits,
        correlations=findings.correlations(outcomes, parameters),
        files=files,
        warnings=tuple(
            Notice(severity="warning", what=f"{check.name}: {check.detail}") for check in checks if not check.ok
        ),
        notes=tuple(map(_SAYS, ("method", "gravity", "slopes", "intervals"))),
    )


def _tables(folder: Path, outcomes: Outcomes, prediction: Prediction) -> None:
    """Residual histories before and after, and their spectra beside the sensor's noise."""
    experiment, recording = outcomes.found.experiment, prediction.recording
    units = [WRENCH_UNITS[WRENCH_CHANNELS.index(c)] for c in experiment.rig.transducer.channels]
    units += ["rad"] * len(experiment.rig.joints)
    n, lowest = len(recording.valid), experiment.lowest_Hz
    history: dict[str, Array | Mask] = {"t": recording.dt * np.arange(n, dtype=np.float64), "valid": recording.valid}
    spectrum: dict[str, Array | Mask] = {}
    named, powers = {"t": "s"}, {"f": "Hz"}
    for column, (channel, unit) in enumerate(zip(experiment.channels, units, strict=True)):
        for side, left in (("before", prediction.before), ("after", prediction.after)):
            history[f"{channel}.{side}"], named[f"{channel}.{side}"] = (
                _above(lowest, left[:, column], recording),
                unit,
            )
            f, power = periodogram(left[:, column], recording.valid, recording.dt)
            shown = f >= lowest
            spectrum["f"], spectrum[f"{channel}.{side}"] = f[shown], power[shown]
            powers[f"{channel}.{side}"] = f"({unit})^2/Hz"
        spectrum[f"{channel}.noise"] = prediction.spectra[column].at(f[shown])
        powers[f"{channel}.noise"] = f"({unit})^2/Hz"
    about = (
        "measured less simulated",
        f"drift, cross-coupling and clock delay projected out; nothing below {lowest:g} Hz",
    )
    for kind, columns, names in (("residual", history, named), ("residual_spectrum", spectrum, powers)):
        path = folder / "tables" / kind / f"{recording.name}.parquet"
        write_table(path, columns, names, frame="T", history=about, recording=recording.name)


def _above(lowest: float, left: Array, recording: Measured) -> Array:
    """What lies above the lowest frequency (Hz) that is compared: below it, drift is not told from gravity."""
    n = len(left)
    spectrum = np.fft.rfft(left)
    spectrum[np.fft.rfftfreq(n, recording.dt) < lowest] = 0.0
    return np.asarray(np.fft.irfft(spectrum, n), dtype=np.float64)
