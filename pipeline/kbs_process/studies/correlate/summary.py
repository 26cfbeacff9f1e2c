"""results.json: what was found, what a reader must be told, and where every number comes from."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace

import msgspec
import numpy as np

from kbs_process.campaign.config import Campaign, RecordingEntry
from kbs_process.errors import KbsError
from kbs_process.reduction.analysis import Analysis, bands_of, select
from kbs_process.reduction.judging import judged
from kbs_process.reduction.pointing import judged_pointing, recorded_pointing
from kbs_process.reduction.soundness.checking import Checked
from kbs_process.results import provenance
from kbs_process.results.judged import WRONG, Requirement, Way
from kbs_process.results.pointing import JudgedPointing
from kbs_process.results.records import Check, Conclusion, InputFile
from kbs_process.signals.records import Signal
from kbs_process.stages.decouple import Decoupling
from kbs_process.stages.gravity.equation import RESPONSE
from kbs_process.stages.gravity.ladder import Rung
from kbs_process.stages.gravity.model import GravityModel, taring_error
from kbs_process.stages.gravity.quality import feasibility
from kbs_process.stages.to_cog import ASSUMPTION
from kbs_process.stages.verdict import SEVERITY
from kbs_process.studies.correlate import results
from kbs_process.studies.correlate.findings import band, merits, repeatabilities, resonances, rig_forces, statements
from kbs_process.studies.correlate.methods import methods
from kbs_process.studies.correlate.notices import model_verdict, notices
from kbs_process.studies.correlate.uncertainty import all_together, budgets, six_channels

DATED_NS = 315_532_800 * 10**9  # 1980-01-01: no recording is older, but those whose clock counts from its own start
RESPONSE_UNITS = dict(zip(RESPONSE, ("s", "s^2"), strict=True))


def summarise(
    campaign: Campaign,
    analyses: Sequence[Analysis],
    model: GravityModel,
    decoupling: Decoupling,
    checked: Checked,
    rungs: Sequence[Rung],
) -> results.Results:
    """Return the contents of results.json; calibrations serve the fit and are judged by its residual alone."""
    runs = [analysis for analysis in analyses if analysis.entry.role != "calibration"]
    stated = statements(bands_of(campaign.bands), runs)
    repeated = tuple(repeatabilities(runs))
    modes = resonances(campaign, runs, model)
    budget = tuple(budgets(campaign, runs, model, decoupling, stated, repeated, modes, checked.noise, checked.late))
    together = all_together(campaign, runs, budget, model.rig)
    told = checked.rounding, checked.mute, checked.unconfirmed, together
    requirements = tuple(
        judged(campaign, requirement, runs, budget, checked.doubts(requirement), *told)
        for requirement in campaign.requirements
    )
    cut = any(one.start is not None or one.end is not None for one in campaign.recordings)
    doubt = "" if checked.soundness.sound and all(one.ok for one in checked.conventions) else WRONG
    pointed = tuple(
        judged_pointing(campaign, analyses, doubt or ("a part that is cut off is not judged" if cut else ""))
    )
    found = results.Results(
        campaign=results.CampaignSummary(
            name=campaign.name,
            title=campaign.title,
            article=campaign.article,
            configuration=campaign.configuration,
            drive=campaign.drive,
            frame="joint" if campaign.rig.frame == "joint" else "T",
            sources=tuple(InputFile(file=name, sha256=digest) for name, digest in campaign.sources.items()),
        ),
        document=results.DocumentHead(**({"date": date_of(analyses)} | campaign.document)),
        verdict=conclusion(requirements, pointed),
        provenance=provenance.made("", campaign.folder, campaign.files),
        requirements=requirements,
        judged_pointing=pointed,
        recordings=tuple(_recording(analysis) for analysis in analyses),
        conventions=checked.conventions,
        soundness=checked.soundness,
        gravity=_gravity(campaign, analyses, model, rungs),
        cross_coupling=_cross_coupling(analyses, decoupling) if decoupling.channels else None,
        bands=tuple(map(band, stated.values())),
        repeatability=repeated,
        merit=tuple(merits(campaign, runs, budget)),
        resonances=modes,
        budget=budget,
        six_channels=tuple(six_channels(together)),
        rig_forces=tuple(rig_forces(campaign, runs)),
        pointing=tuple(recorded_pointing(analyses)),
        parameters=tuple(provenance.constants(campaign.rig)),
        notes=(ASSUMPTION,) if campaign.rig.spacecraft is not None else (),
    )
    found = msgspec.structs.replace(found, model=model_verdict(found))
    warnings = (*checked.notices(), *notices(campaign, analyses, model, found))
    return msgspec.structs.replace(found, warnings=warnings, methods=methods(campaign, analyses, found))


def date_of(analyses: Sequence[Analysis]) -> str:
    """Return from which day to which recordings were made, UTC; empty where a clock counts from its own start."""
    stamps = [analysis.run.epoch_ns for analysis in analyses]
    if not stamps or min(stamps) < DATED_NS:
        return ""
    days = sorted({str(np.datetime64(stamp, "ns").astype("datetime64[D]")) for stamp in stamps})
    return days[0] if len(days) == 1 else f"{days[0]} to {days[-1]}"


def conclusion(requirements: Sequence[Requirement], pointed: Sequence[JudgedPointing] = ()) -> Conclusion:
    """Return what the worst verdict says, in a sentence; on the disturbance, unless one on pointing is worse."""
    worst = max(requirements, key=lambda one: (SEVERITY[one.verdict], one.only_without), default=None)
    pointing = max(pointed, key=lambda one: SEVERITY[one.verdict], default=None)
    if pointing and (worst is None or SEVERITY[pointing.verdict] > SEVERITY[worst.verdict]):
        return Conclusion(status=pointing.verdict, sentence=_of_pointing(pointing))
    if worst is None:
        return Conclusion(status="none", sentence="The campaign states no requirement.")
    word = _word(worst)
    value, low, high = (figure or 0.0 for figure in (worst.value, worst.low, worst.high))
    other = next((one for one in worst.ways if (one.recording, one.channel) == (worst.recording, worst.channel)), None)
    beside = "" if other is None else _other_way(worst, other)
    unshown = f" Nothing shows a response of {', '.join(worst.mute)}, only noise." if worst.mute else ""
    if worst.untested:
        unshown += " No sign and no axis was tested: the loads change too little for what the files leave open."
    axes = ", ".join(worst.axes)
    sentence = (
        f"{worst.name}: {word}. {worst.statistic.capitalize()} {value:.4f} {worst.unit} "
        f"({_span(low, high)} at 95 %) on {worst.channel} in {worst.recording}, "
        f"{worst.band_Hz[0] or 0:g} to {worst.band_Hz[1] or 0:g} Hz; limit {worst.limit:g} {worst.unit}"
        f"{'' if worst.lever_m is None else f', {worst.lever_m:.3g} m from the transducer'}."
        f"{beside}{unshown if worst.verdict == 'pass' else ''}"
        f"{f' Judged on {axes} alone, as the requirement says.' if len(worst.axes) < 3 else ''}"
        f"{f' {worst.left_out}' if worst.only_without else ''}"
    )
    return Conclusion(status=worst.verdict, sentence=sentence)


def _other_way(worst: Requirement, way: Way) -> str:
    """What the other way to the spacecraft gives, and whether it agrees."""
    if worst.together:
        figure, ours, others = way.moved, "all six channels at once", "moved by the measured forces"
    else:
        figure, ours, others = way.together, "the measured forces", "by all six channels at once"
    agree = "" if way.agree else " They disagree, so the worse counts."
    value, low, high = figure
    return f" By {ours}; {others}, it is {value:.4f} ({_span(low, high)}).{agree}"


def _span(low: float, high: float) -> str:
    return f"{f'{low:.4f}' if low > 0.0 else '0'} to {high:.4f}"


def _word(one: Requirement | JudgedPointing) -> str:
    if one.verdict == "undecided":
        return f"undecided: {one.doubt}" if one.doubt else "neither met nor broken within the uncertainty"
    return "met" if one.verdict == "pass" else "not met"


def _of_pointing(one: JudgedPointing) -> str:
    value, sigma, limit = (float(np.degrees(angle or 0.0)) for angle in (one.value, one.sigma, one.limit))
    return f"{one.name}: {_word(one)}. {one.where}: {value:.4f} +- {sigma:.2g} deg; limit {limit:.4g} deg."


def with_left_out(
    campaign: Campaign,
    found: results.Results,
    analyses: Sequence[Analysis],
    model: GravityModel,
    decoupling: Decoupling,
    read: Callable[[RecordingEntry], Analysis],
) -> results.Results:
    """Return results whose requirements tell what the campaign leaves out, calibrations and what is cut off.

    They tell what is judged of these recordings by themselves; `read` analyses one that was cut, as a whole.
    """
    left = [one for one in analyses if _named(one.entry)]
    if not left:
        return found
    words = f"The campaign leaves out {', '.join(_named(one.entry) for one in left)}."
    try:
        every = [replace(one.entry, role="calibration", start=None, end=None) for one in left]
        whole = [one if one.entry == entry else read(entry) for one, entry in zip(left, every, strict=True)]
        stated = statements(bands_of(campaign.bands), whole)
        rows = tuple(budgets(campaign, whole, model, decoupling, stated, found.repeatability, found.resonances, {}, {}))
        together = all_together(campaign, whole, rows, model.rig)
        others = [_words(judged(campaign, asked, whole, rows, together=together)) for asked in campaign.requirements]
    except KbsError as error:
        others = [("undecided", f"By itself that cannot be judged: {error.what}.")] * len(found.requirements)
    told = []
    for one, (verdict, what) in zip(found.requirements, others, strict=True):
        only_without = one.verdict == "pass" != verdict
        one = msgspec.structs.replace(one, left_out=f"{words} {what}", only_without=only_without)
        if only_without and verdict == "fail":
            one = msgspec.structs.replace(
                one, verdict="undecided", doubt="what the campaign leaves out does not meet it"
            )
        told.append(one)
    return msgspec.structs.replace(found, requirements=tuple(told), verdict=conclusion(told, found.judged_pointing))


def _words(one: Requirement) -> tuple[str, str]:
    """A verdict on what is left out, and the figure."""
    words = {"pass": "met", "fail": "not met", "undecided": "undecided"}[one.verdict]
    figure = f"{one.value or 0.0:.4f} {one.unit} ({one.low or 0.0:.4f} to {one.high or 0.0:.4f} at 95 %)"
    return one.verdict, f"By itself that is {words}: {one.statistic} {figure} on {one.channel} in {one.recording}."


def _named(entry: RecordingEntry) -> str:
    """What the campaign leaves out of a recording; empty where it is judged from beginning to end."""
    parts = ["(calibration)"] if entry.role == "calibration" else []
    parts += [f"{which} {at:g} s" for which, at in (("before", entry.start), ("after", entry.end)) if at is not None]
    return " ".join([entry.name, *parts]) if parts else ""


def _recording(analysis: Analysis) -> results.Recording:
    entry, run = analysis.entry, analysis.run
    return results.Recording(
        name=entry.name,
        file=entry.path.name,
        trajectory=entry.trajectory,
        role=entry.role,
        repeat=entry.repeat,
        sha256=provenance.sha256(entry.path),
        duration_s=len(analysis.residual) * analysis.residual.dt,
        rates=run.rates,
        losses=run.losses,
        clocks=tuple(
            results.Clock(
                stream=stream,
                offset_s=clock.offset_s,
                skew=clock.skew,
                sigma_s=clock.sigma_offset_s if np.isfinite(clock.sigma_offset_s) else None,
            )
            for stream, clock in run.clocks.items()
        ),
    )


def _gravity(
    campaign: Campaign, analyses: Sequence[Analysis], model: GravityModel, rungs: Sequence[Rung]
) -> results.Gravity:
    fit = model.fit
    prior = model.equation.start()
    quantities = campaign.rig.quantities()
    parameters = []
    for index, name in enumerate(model.equation.names):
        quantity = quantities.get(name.split("[")[0])
        parameters.append(
            results.FittedParameter(
                name=name,
                unit=RESPONSE_UNITS.get(name, "") if quantity is None else quantity.unit,
                prior=float(prior[index]),
                prior_sigma=float(fit.prior_sigma[index]),
                value=float(fit.value[index]),
                sigma=float(fit.sigma[index]),
            )
        )
    return results.Gravity(
        parameters=tuple(parameters),
        channels=tuple(_gravity_channel(analyses, index) for index in range(len(model.channels))),
        checks=tuple(Check(name=c.name, ok=c.passed, detail=c.detail) for c in fit.checks),
        samples=fit.dof + len(fit.value),
        reduced_chi_square=fit.residual_rms**2,
        feasible=_feasible(campaign, model),
        recordings=tuple(_static_recording(analysis, model) for analysis in analyses),
        low_pass_Hz=model.settings.low_pass_Hz,
        ladder=tuple(
            results.Rung(
                name=rung.name,
                rms=dict(zip(model.channels, rung.rms.tolist(), strict=True)),
                peak=dict(zip(model.channels, rung.peak.tolist(), strict=True)),
            )
            for rung in rungs
        ),
    )


def _static_recording(analysis: Analysis, model: GravityModel) -> results.StaticRecording:
    taring = analysis.static.taring
    channels = tuple(
        results.StaticChannel(
            channel=misfit.channel,
            unit=misfit.unit,
            constant=float(constant),
            sigma=float(sigma),
            left=misfit.left,
            explained=misfit.explained,
            ok=misfit.ok,
        )
        for misfit, constant, sigma in zip(analysis.misfits, taring.bias, taring_error(model, taring), strict=True)
    )
    return results.StaticRecording(recording=analysis.entry.name, fitted=taring.fitted, channels=channels)


def _gravity_channel(analyses: Sequence[Analysis], index: int) -> results.GravityChannel:
    """Over all recordings: the largest static wrench, the rms of what is left, the rms of the model's errors."""

    def over(signals: Iterable[Signal]) -> float:
        parts = [signal.values[signal.valid, index] for signal in signals]
        return float(np.sqrt(np.mean(np.concatenate(parts) ** 2)))

    statics = [analysis.static for analysis in analyses]
    first = statics[0].wrench
    return results.GravityChannel(
        channel=first.channels[index],
        unit=first.units[index],
        static_peak=max(float(np.max(np.abs(static.wrench.values[:, index]))) for static in statics),
        residual_rms=over(analysis.residual for analysis in analyses),
        encoder_sigma=over(static.wrench.derive(static.sigma_encoder, "sigma") for static in statics),
        model_sigma=over(static.wrench.derive(static.sigma_parameters, "sigma") for static in statics),
    )


def _feasible(campaign: Campaign, model: GravityModel) -> str:
    """Is gravity compensation by computation feasible? Its error on each torque channel against the tightest limit."""
    limits = [requirement.limit for requirement in campaign.requirements if requirement.quantity == "torque"]
    if not campaign.rig.transducer.channels:
        return ""
    if not limits:
        return "There is no limit on a torque to measure the compensation's error against."
    found = feasibility(model, {channel: min(limits) for channel in ("Tx", "Ty", "Tz")})
    if not found:
        return "No torque channel is recorded."
    worst = max(found, key=lambda one: one.ratio)
    answer = "feasible" if worst.ratio < 1.0 else "feasible only within a band that leaves slow errors out"
    return (
        f"Computed compensation is {answer}: its error before filtering is at most {worst.error:.3g} N m rms "
        f"({worst.channel}), {100 * worst.ratio:.0f} % of the limit of {worst.limit:g} N m."
    )


def _cross_coupling(analyses: Sequence[Analysis], decoupling: Decoupling) -> results.CrossCoupling:
    channels = decoupling.channels
    X = np.linalg.inv(decoupling.matrix) - np.eye(len(channels))
    wrenches = [select(analysis.raw, channels) for analysis in analyses]
    raw = np.concatenate([wrench.values[wrench.valid] for wrench in wrenches])
    decoupled = (raw - decoupling.bias) @ decoupling.matrix.T
    removed = raw - decoupling.bias - decoupled
    varies = np.std(decoupled, axis=0)
    share = np.abs(X) * varies
    relative = np.divide(share, varies[:, None], out=np.zeros_like(share), where=varies[:, None] > 0.0)
    row, column = np.unravel_index(int(np.argmax(relative)), share.shape)
    units = wrenches[0].units
    largest = (
        f"Relative to what varies on the channel itself, {channels[column]} leaks most into {channels[row]}: "
        f"{share[row, column]:.3g} {units[row]} rms."
    )
    return results.CrossCoupling(
        channels=channels,
        matrix=tuple(tuple(float(x) for x in line) for line in X),
        sigma=tuple(tuple(float(x) for x in line) for line in decoupling.sigma),
        largest=largest if np.any(X) else "The parameter files state no cross-coupling: none was undone.",
        contributions=tuple(
            results.Contribution(channel=channel, unit=units[index], value=float(np.std(removed[:, index])))
            for index, channel in enumerate(channels)
        ),
    )
