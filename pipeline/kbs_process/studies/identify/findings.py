"""What an identification found: estimates, checks, misfits and correlations, as its results have them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from kbs_process.estimation.profile import Profile
from kbs_process.estimation.whittle import periodogram
from kbs_process.identification.estimate import Identification, Settings
from kbs_process.identification.output_error import Experiment, Measured, Spectra
from kbs_process.identification.screening import Phase, phases
from kbs_process.identification.unknowns import CRITICAL
from kbs_process.results.records import Check, Conclusion
from kbs_process.rig.model import Quantity
from kbs_process.signals.records import Array
from kbs_process.studies.identify.results import Correlations, Identified, Interval, Misfit

_CONFUSED = 0.95  # correlation from which two numbers are said to be confused
_WEAK = 0.9  # posterior over prior sigma from which the recordings say little
_WHITE = 1.05  # rms of the whitened residual from which something is left unexplained


@dataclass(frozen=True, slots=True, eq=False)
class Prediction:
    """A recording and what the plant leaves unexplained of it, before and after."""

    recording: Measured
    role: Literal["fit", "held-out"]
    spectra: Spectra  # of the sensors
    before: Array  # (n, channels)
    after: Array


@dataclass(frozen=True, slots=True, eq=False)
class Outcomes:
    """Everything that the report shows."""

    found: Identification
    settings: Settings
    profiles: tuple[Profile, ...]
    predictions: tuple[Prediction, ...]

    @property
    def phases(self) -> frozenset[str]:
        """The names of the free numbers that are phases."""
        return frozenset(self.found.experiment.free[one.phase].name for one in phases_of(self.found.experiment))

    def correlation(self) -> Array:
        """(p, p) of the estimates."""
        fit = self.found.fit
        matrix: Array = fit.covariance / np.outer(fit.sigma, fit.sigma)
        return matrix


def phases_of(experiment: Experiment) -> tuple[Phase, ...]:
    """Return the free numbers that are phases."""
    return phases(experiment.rig, experiment.effects, experiment.free)


def wrapped(angle: float) -> float:
    """Return an angle within half a turn."""
    return float((angle + np.pi) % (2.0 * np.pi) - np.pi)


def quantities(outcomes: Outcomes, source: str) -> dict[str, Quantity]:
    """Every quantity with a number that was free, phases brought to within half a turn."""
    found = outcomes.found
    free = found.experiment.free
    turns = outcomes.phases
    known = found.experiment.rig.quantities()
    changed: dict[str, Quantity] = {}
    for index, scalar in enumerate(free):
        quantity = changed.get(scalar.quantity, known[scalar.quantity])
        value, sigma = quantity.value.copy(), quantity.sigma.copy()
        estimate = float(found.values[index])
        value[scalar.element] = wrapped(estimate) if scalar.name in turns else estimate
        sigma[scalar.element] = found.fit.sigma[index]
        changed[scalar.quantity] = replace(quantity, value=value, sigma=sigma, source=source)
    return changed


def identified(outcomes: Outcomes) -> Iterator[Identified]:
    """Yield every free number, phases brought to within half a turn."""
    found, fit = outcomes.found, outcomes.found.fit
    profiled = {profile.name: profile for profile in outcomes.profiles}
    units = found.experiment.rig.quantities()
    turns, correlation = outcomes.phases, outcomes.correlation() - np.eye(len(fit.sigma))
    for index, scalar in enumerate(found.experiment.free):
        partner = int(np.argmax(np.abs(correlation[index])))
        value = float(fit.value[index])
        shift = wrapped(value) - value if scalar.name in turns else 0.0
        profile = profiled.get(scalar.name)
        prior_sigma = float(found.parameters.sigma[index])
        yield Identified(
            name=scalar.name,
            unit=units[scalar.quantity].unit,
            group=_group(scalar.name),
            prior=float(found.parameters.value[index]),
            prior_sigma=prior_sigma if np.isfinite(prior_sigma) else None,
            value=value + shift,
            sigma=float(fit.sigma[index]),
            interval=None
            if profile is None
            else Interval(
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


def misfits(experiment: Experiment, prediction: Prediction) -> Iterator[Misfit]:
    """Root of the mean ratio of the residual's periodogram to the sensor's noise, over the channel's band."""
    recording = prediction.recording
    for column, (channel, band) in enumerate(zip(experiment.channels, experiment.bands(recording), strict=True)):
        ratios = []
        for left in (prediction.before, prediction.after):
            f, power = periodogram(left[:, column], recording.valid, recording.dt)
            inside = (f >= band[0]) & (f <= band[1])
            ratios.append(float(np.sqrt(np.mean(power[inside] / prediction.spectra[column].at(f[inside])))))
        before, after = ratios
        yield Misfit(recording=recording.name, role=prediction.role, channel=channel, before=before, after=after)


def checks(outcomes: Outcomes, parameters: Sequence[Identified], misfits: Sequence[Misfit]) -> Iterator[Check]:
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
        for misfit in misfits
        if misfit.role == "fit" and misfit.after > _WHITE
    ]
    yield Check(
        name="residual is noise",
        ok=not rough,
        detail="rms over noise: " + ", ".join(rough) if rough else "in every channel, within 5 %",
    )


def verdict(checks: Sequence[Check], misfits: Sequence[Misfit], parameters: Sequence[Identified]) -> Conclusion:
    """Undecided where a check is not passed: the recordings that were held out say how good the model is."""
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


def correlations(outcomes: Outcomes, parameters: Sequence[Identified]) -> Correlations:
    """Return the correlations of the numbers of drives and transducer."""
    shown = [index for index, one in enumerate(parameters) if one.group != "rig"]
    matrix = outcomes.correlation()[np.ix_(shown, shown)]
    return Correlations(
        names=tuple(parameters[index].name for index in shown),
        matrix=tuple(tuple(row) for row in np.round(matrix, 4).tolist()),
    )
