"""What an identification leaves on disk: results.json, tables, corrected parameter files, and the report."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np

from kbs_process.campaign.config import Campaign
from kbs_process.campaign.parameter_files import corrected, write_parameters
from kbs_process.estimation.whittle import periodogram
from kbs_process.identification.output_error import Measured
from kbs_process.identification.screening import Phase, phases
from kbs_process.identification.unknowns import CRITICAL
from kbs_process.report.build import build
from kbs_process.results import provenance
from kbs_process.results.outcome import Outcome
from kbs_process.results.records import Check, Conclusion, Notice, encode
from kbs_process.results.store import writing
from kbs_process.results.tables import write_table
from kbs_process.rig.model import Quantity
from kbs_process.signals.records import WRENCH_CHANNELS, WRENCH_UNITS, Array, Mask
from kbs_process.studies.identify import results as records

if TYPE_CHECKING:
    from kbs_process.studies.identify.run import Outcomes, Prediction

PARAMETERS = "identified/parameters"
_CONFUSED = 0.95  # correlation from which two numbers are said to be confused
_WEAK = 0.9  # posterior over prior sigma from which the recordings say little
_WHITE = 1.05  # rms of the whitened residual from which something is left unexplained
_NOTES = (
    "Output error in the frequency domain: wrench and joint angles, measured less simulated, whitened by the noise "
    "spectrum of each channel. The plant follows the recorded field positions.",
    "Gravity is not taken off beforehand: it is in the plant, with masses, CoGs, inertias and tilt fitted within their "
    "priors beside the gearbox. Taring bias, drift, cross-coupling and clock delays are projected out of each channel.",
    "Slopes are differences over several sigmas, and events of sticking that come and go within what is known of the "
    "numbers count as noise (posterior linearisation): which of them happen in a run is not to be predicted that well.",
    "Intervals hold 95 %: +-1.96 sigma of the posterior, and where given those of the profile likelihood. They presume "
    "that the model's equations are right; the check of the residual says whether the recordings deny it.",
)


def write_identification(campaign: Campaign, outcomes: Outcomes, target: Path, pdf: bool | None) -> Outcome:
    """Write results, tables, parameter files and report to `target`."""
    with writing(target) as folder:
        source = "identified from " + ", ".join(r.name for r in outcomes.found.experiment.recordings)
        written = write_parameters(folder / PARAMETERS, corrected(campaign, _quantities(outcomes, source), source))
        for prediction in outcomes.predictions:
            _tables(folder, outcomes, prediction)
        files = tuple(path.relative_to(folder).as_posix() for path in written)
        results = _results(campaign, outcomes, files)
        (folder / "results.json").write_bytes(encode(results))
        from kbs_process.studies.identify.report import DOCUMENT  # draws: takes its time to import

        page = build(folder, DOCUMENT, pdf)
    lines = (results.verdict.sentence, f"Parameter files: {target / PARAMETERS}")
    return Outcome(lines, {"pass": True, "fail": False}.get(results.verdict.status), target / page.name)


def _quantities(outcomes: Outcomes, source: str) -> dict[str, Quantity]:
    """Every quantity with a number that was free, phases brought to within half a turn."""
    found = outcomes.found
    free = found.experiment.free
    turns = {free[phase.phase].name for phase in _phases(outcomes)}
    known = found.experiment.rig.quantities()
    changed: dict[str, Quantity] = {}
    for index, scalar in enumerate(free):
        quantity = changed.get(scalar.quantity, known[scalar.quantity])
        value, sigma = quantity.value.copy(), quantity.sigma.copy()
        estimate = float(found.values[index])
        value[scalar.element] = _wrapped(estimate) if scalar.name in turns else estimate
        sigma[scalar.element] = found.fit.sigma[index]
        changed[scalar.quantity] = replace(quantity, value=value, sigma=sigma, source=source)
    return changed


def _phases(outcomes: Outcomes) -> tuple[Phase, ...]:
    experiment = outcomes.found.experiment
    return phases(experiment.rig, experiment.effects, experiment.free)


def _wrapped(angle: float) -> float:
    return float((angle + np.pi) % (2.0 * np.pi) - np.pi)


def _results(campaign: Campaign, outcomes: Outcomes, files: tuple[str, ...]) -> records.IdentifyResults:
    found = outcomes.found
    parameters = tuple(_identified(outcomes))
    checks = tuple(_checks(outcomes, parameters))
    misfits = tuple(misfit for prediction in outcomes.predictions for misfit in _misfits(outcomes, prediction))
    return records.IdentifyResults(
        name=campaign.name,
        title=campaign.title,
        article=campaign.article,
        verdict=_verdict(checks, misfits, parameters),
        provenance=provenance.made(
            "identify",
            campaign.folder,
            campaign.files,
            options=f"--starts {outcomes.settings.starts} --run-to-run {outcomes.settings.run_to_run:g}",
        ),
        band_Hz=found.experiment.bands(found.experiment.recordings[0])[0],
        samples=len(found.jacobian),
        misfit_rms=found.fit.residual_rms,
        run_to_run=outcomes.settings.run_to_run,
        parameters=parameters,
        starts=tuple(
            records.Followed(
                start_cost=mode.start.cost,
                cost=mode.cost,
                phases={
                    found.experiment.free[phase.phase].name: _wrapped(float(mode.values[phase.phase]))
                    for phase in _phases(outcomes)
                },
            )
            for mode in found.modes
        ),
        checks=checks,
        misfits=misfits,
        correlations=_correlations(outcomes, parameters),
        files=files,
        warnings=tuple(
            Notice(severity="warning", what=f"{check.name}: {check.detail}") for check in checks if not check.ok
        ),
        notes=_NOTES,
    )


def _identified(outcomes: Outcomes) -> Iterator[records.Identified]:
    found, fit = outcomes.found, outcomes.found.fit
    profiled = {profile.name: profile for profile in outcomes.profiles}
    units = found.experiment.rig.quantities()
    turns = {found.experiment.free[phase.phase].name for phase in _phases(outcomes)}
    correlation = fit.covariance / np.outer(fit.sigma, fit.sigma) - np.eye(len(fit.sigma))
    for index, scalar in enumerate(found.experiment.free):
        partner = int(np.argmax(np.abs(correlation[index])))
        value = float(fit.value[index])
        shift = _wrapped(value) - value if scalar.name in turns else 0.0
        profile = profiled.get(scalar.name)
        prior_sigma = float(found.parameters.sigma[index])
        yield records.Identified(
            name=scalar.name,
            unit=units[scalar.quantity].unit,
            group=_group(scalar.name),
            prior=float(found.parameters.value[index]),
            prior_sigma=prior_sigma if np.isfinite(prior_sigma) else None,
            value=value + shift,
            sigma=float(fit.sigma[index]),
            interval=None
            if profile is None
            else records.Interval(
                low=profile.low + shift,
                high=profile.high + shift,
                x=tuple((profile.x + shift).tolist()),
                D=tuple(profile.D.tolist()),
            ),
            partner=fit.names[partner],
            correlation=float(correlation[index, partner]),
            at_bound=not found.parameters.lower[index] < value < found.parameters.upper[index],
        )


def _group(name: str) -> Literal["critical", "gearbox", "rig"]:
    if ".drive." in name and name.rpartition(".")[2] in CRITICAL:
        return "critical"
    if (".drive." in name and not name.endswith("rotor_inertia")) or name.startswith(
        ("transducer.stiffness", "transducer.damping")
    ):
        return "gearbox"
    return "rig"


def _checks(outcomes: Outcomes, parameters: Sequence[records.Identified]) -> Iterator[Check]:
    """Converged; bounds; what is known no better than before; what is confused; what the residual says."""
    gears = [one for one in parameters if one.group != "rig"]
    converged = outcomes.found.fit.checks[0]
    yield Check(name="converged", ok=converged.passed, detail=converged.detail)
    stuck = [one.name for one in parameters if one.at_bound]
    yield Check(name="within bounds", ok=not stuck, detail=", ".join(stuck) or "none at a bound")
    weak = [
        f"{one.name} (with {one.partner})"
        for one in gears
        if one.sigma > _WEAK * (np.pi / np.sqrt(3.0) if one.prior_sigma is None else one.prior_sigma)
    ]
    yield Check(name="identifiable", ok=not weak, detail="weak: " + ", ".join(weak) if weak else "every gearbox number")
    confused = [
        f"{one.name} with {one.partner} ({one.correlation:+.3f})" for one in gears if abs(one.correlation) > _CONFUSED
    ]
    yield Check(name="told apart", ok=not confused, detail=", ".join(confused) or "no pair above 0.95")
    lost = [profile.name for profile in outcomes.profiles if float(np.min(profile.D)) < -outcomes.settings.gain - 3.0]
    yield Check(
        name="least cost", ok=not lost, detail="lower on the profile of " + ", ".join(lost) if lost else "on no profile"
    )
    unsettled = [str(number) for number, mode in enumerate(outcomes.found.modes, 1) if not mode.settled]
    best = min(outcomes.found.modes, key=lambda mode: mode.cost, default=None)
    yield Check(
        name="no better phase or contact edge",
        ok=best is None or best.settled,
        detail=f"search not ended from start {', '.join(unsettled)}"
        if unsettled
        else "looked for around the whole turn",
    )
    contact = outcomes.found.fit.checks[-1]
    yield Check(name=contact.name, ok=contact.passed, detail=contact.detail)
    rough = [
        f"{misfit.channel} of {misfit.recording} ({misfit.after:.2f})"
        for prediction in outcomes.predictions
        if prediction.role == "fit"
        for misfit in _misfits(outcomes, prediction)
        if misfit.after > _WHITE
    ]
    yield Check(
        name="residual is noise",
        ok=not rough,
        detail="rms over noise: " + ", ".join(rough) if rough else "in every channel, within 5 %",
    )


def _misfits(outcomes: Outcomes, prediction: Prediction) -> Iterator[records.Misfit]:
    """Root of the mean ratio of the residual's periodogram to the sensor's noise, over the channel's band."""
    experiment = outcomes.found.experiment
    recording = prediction.recording
    for column, (channel, band) in enumerate(zip(experiment.channels, experiment.bands(recording), strict=True)):
        ratios = []
        for left in (prediction.before, prediction.after):
            f, power = periodogram(left[:, column], recording.valid, recording.dt)
            inside = (f >= band[0]) & (f <= band[1])
            ratios.append(float(np.sqrt(np.mean(power[inside] / prediction.spectra[column].at(f[inside])))))
        role: Literal["fit", "held-out"] = "fit" if prediction.role == "fit" else "held-out"
        yield records.Misfit(recording=recording.name, role=role, channel=channel, before=ratios[0], after=ratios[1])


def _verdict(
    checks: Sequence[Check], misfits: Sequence[records.Misfit], parameters: Sequence[records.Identified]
) -> Conclusion:
    tested = [misfit for misfit in misfits if misfit.role == "held-out"] or list(misfits)
    before = max(misfit.before for misfit in tested)
    worst = max(tested, key=lambda misfit: misfit.after)
    failed = [check.name for check in checks if not check.ok]
    critical = [one for one in parameters if one.group == "critical"]
    sentence = (
        f"{len(critical)} critical parameters identified. Residual over noise on {tested[0].role} recordings: at most "
        f"{before:.2f} before, {worst.after:.2f} after ({worst.channel} of {worst.recording})."
    )
    if failed:
        sentence += f" Checks not passed: {', '.join(failed)}."
    return Conclusion(status="undecided" if failed else "pass", sentence=sentence)


def _correlations(outcomes: Outcomes, parameters: Sequence[records.Identified]) -> records.Correlations:
    fit = outcomes.found.fit
    shown = [index for index, one in enumerate(parameters) if one.group != "rig"]
    matrix = (fit.covariance / np.outer(fit.sigma, fit.sigma))[np.ix_(shown, shown)]
    return records.Correlations(
        names=tuple(parameters[index].name for index in shown),
        matrix=tuple(tuple(row) for row in np.round(matrix, 4).tolist()),
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
