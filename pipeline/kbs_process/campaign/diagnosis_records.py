"""What a diagnosis says, as the contents of its results.json."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from kbs_process.campaign import provenance
from kbs_process.campaign.config import Campaign, RecordingEntry
from kbs_process.campaign.corrected_diagnosis import left_out
from kbs_process.campaign.next_test import next_test
from kbs_process.campaign.notices import lost
from kbs_process.campaign.stretch import PASSED_OVER
from kbs_process.diagnosis.experiment import Experiment
from kbs_process.diagnosis.floor import Floor
from kbs_process.diagnosis.known import Known
from kbs_process.diagnosis.next_test import Proposal
from kbs_process.diagnosis.outcome import Curve, Find, Identity, Outcome
from kbs_process.diagnosis.thresholds import RIVALS, told_apart
from kbs_process.plant.effects.measured_law import Measured, unit_of
from kbs_process.plant.structure import other_joint
from kbs_process.report.records import diagnosis as records
from kbs_process.report.records.common import Check, Conclusion, Notice
from kbs_process.rig.model import Joint, Rig
from kbs_process.signals.records import Loss

CORRECTED = "corrected"  # folder of the corrected model, and
COMMANDS = "next-test.csv"  # file of the next test's commands, in that of the results
_SHOWN = 25  # suspects in the table
_EACH_TIME = "it is each recording's own: the corrected model is without it"
_NOTES = (
    "The floor is what repeats of one trajectory differ by. Constants and slopes of the transducer's channels and "
    "errors of the clocks, each recording's own, are taken out of every comparison.",
    "Known parameters are refitted within their priors before anything is looked for, and again beside each suspect.",
    "A find has passed the gate: inside the non-linear plant, with all known parameters refitted, it improves the "
    "prediction of recordings that it was not fitted to, all together, and makes none of them markedly worse.",
    "Channels are whitened in their order: each is judged given those before it.",
)
_FLOOR = {
    "repeats": "what repeats of one trajectory differ by",
    "declared": "what their sensors' stated noise explains",
}
_PORTS = {"ground torque": "external wrench"}  # of the port test, in the words of finds
_WORDS = {
    "none": "Nothing exceeds {floor}.",
    "parameters off": "Known parameters are off: moved, they leave nothing that exceeds {floor}. Physics that does "
    "what they do would look the same; one that is farther off than its file can be wrong stands for such physics.",
    "undecided": "There is a mismatch, and no law passed the gate.",
}


def results_of(
    campaign: Campaign,
    floor: Floor,
    outcome: Outcome,
    files: Sequence[str],
    proposal: Proposal | None,
    verb: str = "diagnose",
) -> records.DiagnosisResults:
    """What a diagnosis says; `verb` is that of the command that was given, none of processing."""
    known = outcome.known
    finds = tuple(_find(find, known.experiment) for find in outcome.finds)
    trials = tuple(_trials(known, outcome.standing.known))
    return records.DiagnosisResults(
        name=campaign.name,
        title=campaign.title,
        article=campaign.article,
        verdict=Conclusion(
            status="undecided" if outcome.verdict == "undecided" else "none",
            sentence=_sentence(outcome, trials, floor),
        ),
        provenance=provenance.made(verb, campaign),
        answer=outcome.verdict,
        paragraph=_paragraph(outcome, finds, trials, floor),
        floor=floor.statement,
        log10_p=outcome.log_p / float(np.log(10.0)),
        moved=tuple(_moved(outcome.standing.known)),
        finds=finds,
        trials=trials,
        ports=tuple(_ports(outcome)),
        located=tuple(
            records.Place(port=_PORTS.get(one.port, one.port), site=one.axis, channels=one.channels)
            for one in outcome.located
        ),
        suspects=tuple(_suspects(outcome))[:_SHOWN],
        checks=tuple(Check(name=c.name, ok=c.passed, detail=c.detail) for c in known.checks),
        files=tuple(files),
        next_test=None if proposal is None else next_test(proposal, COMMANDS),
        warnings=tuple(_warnings(campaign, floor, outcome)),
        notes=_NOTES,
    )


def place_of(identity: Identity) -> records.Place:
    """A port and its site, in a record."""
    return records.Place(port=identity.port, site=identity.axis, channels=identity.channels)


def _words(name: str) -> str:
    return name.replace("_", " ")


def _where(place: records.Place) -> str:
    return ", ".join(part for part in (place.port, place.site or "/".join(place.channels)) if part)


def _law_in_words(find: Find) -> str:
    """A law with those that were simulated beside it and cannot be told from it, at the same place."""
    alike = [one.identity for one in find.alternatives if one.refitted and one.indistinguishable]
    here = [one.law for one in alike if place_of(one) == place_of(find.identity)]
    return " or ".join(_words(law) for law in (find.identity.law, *here))


def _sentence(outcome: Outcome, trials: Sequence[records.Trial], floor: Floor) -> str:
    if not outcome.finds:
        return _unnamed(outcome, trials, floor) + _located(outcome)
    told = [f"{_law_in_words(find)} ({_where(place_of(find.identity))})" for find in outcome.finds]
    return f"The model lacks: {'; '.join(told)}.{_reserve(outcome)}"


def _reserve(outcome: Outcome) -> str:
    """What is to be said of finds with which something is left: among known laws they are the nearest ones."""
    if not outcome.after.left:
        return ""
    level = f"{_rms(outcome.after.ratio):.3g} times the floor (rms)"
    return (
        f" With that in the plant {level} is left: more is missing, or a law found stands in for one like it."
    )


def _unnamed(outcome: Outcome, trials: Sequence[records.Trial], floor: Floor) -> str:
    """The answer where there is no find."""
    if not outcome.unforeseen:
        return _WORDS[outcome.verdict].format(floor=_FLOOR[floor.source])
    worst = max((trial for trial in trials if trial.role == "held-out"), key=lambda trial: trial.corrected)
    channel = max(worst.channels, key=lambda name: worst.channels[name])
    return (
        f"Recordings that were fitted are predicted, {worst.recording}, which was held out, is not: "
        f"{channel} differs by {worst.channels[channel]:.3g} times the floor (rms)."
    )


def _located(outcome: Outcome) -> str:
    """Which ports can explain what no law did, where some cannot."""
    if outcome.verdict != "undecided" or outcome.unforeseen or outcome.left is None:
        return ""
    if outcome.located:
        names = [port.label for port in outcome.located]
        apart = ", which these recordings cannot tell apart" * (len(names) > 1)
        return f" It enters at {' or '.join(names)}{apart}."
    able = [port.name for port in outcome.left.test.ports if port.sufficient]
    if not able or len(able) == len(outcome.left.test.ports):
        return ""
    return f" An input free to be anything could explain it at {', '.join(able[:4])}{' and others' * (len(able) > 4)}."


def _paragraph(
    outcome: Outcome, finds: Sequence[records.Find], trials: Sequence[records.Trial], floor: Floor
) -> str:
    """Plain words, to be pasted into a test report."""
    held_out = [trial for trial in trials if trial.role == "held-out"]
    judged = held_out or list(trials)
    which = "recordings that were not used to find it" if held_out else "recordings (none was held out)"
    known, corrected = (max(getattr(trial, step) for trial in judged) for step in ("known", "corrected"))
    parts = [
        f"With all known parameters refitted within their uncertainties, prediction and measurement differ by up to "
        f"{known:.3g} times (rms) {_FLOOR[floor.source]}, among {which}."
    ]
    for find in finds:
        numbers = _curve_in_words(find.curve) if find.curve else _numbers_in_words(find.parameters)
        near = told_apart(find.distance)
        apart = [
            _words(one.name) for one in find.rivals if one.distance < (near if one.simulated else RIVALS)
        ]
        begin = "Left out was" if find.named else "No law of the catalogue passes; measured was a"
        parts.append(
            f"{begin} {_words(find.name)} ({_where(find.place)}): {numbers}; probability {find.probability:.2f} among "
            f"the laws simulated"
            + (f", not to be told from {', '.join(apart)} by these recordings." if apart else ".")
        )
    if finds:
        parts.append(
            f"With it in the plant the difference is {corrected:.3g} times the floor.{_reserve(outcome)}"
        )
    else:
        parts.append(_unnamed(outcome, trials, floor) + _located(outcome))
    if outcome.otherwise:
        farthest = sorted(outcome.otherwise, key=lambda moved: -abs(moved.sigmas))[:3]
        numbers = ", ".join(f"{moved.name} by {moved.sigmas:+.1f} sigma" for moved in farthest)
        parts.append(f"Without a law known parameters would have to be off, beyond belief: {numbers}.")
    for moved in outcome.moved[:5]:
        parts.append(f"{moved.name} is off by {moved.sigmas:+.1f} sigma.")
    return " ".join(parts)


def _numbers_in_words(numbers: Sequence[records.Fitted]) -> str:
    return ", ".join(
        f"{one.name} = {one.value:.4g} ({one.low:.4g} to {one.high:.4g}) {one.unit}" for one in numbers[:4]
    )


def _curve_in_words(curve: records.Curve) -> str:
    """Between what a measured law varies, where, and how well that is known."""
    least, *_, most = sorted(range(len(curve.y)), key=lambda k: curve.y[k])
    ends = " to ".join(
        f"{curve.y[k]:.4g} {curve.y_unit} (sigma {curve.sigma[k]:.2g}) at {curve.x[k]:.4g} {curve.x_unit}"
        for k in (least, most)
    )
    return f"from {ends} of the {curve.regressor}"


def _find(find: Find, experiment: Experiment) -> records.Find:
    roles = {trial.name: trial.role for trial in experiment.trials}
    joint = _joint(find, experiment.rig)
    return records.Find(
        name=find.identity.law,
        family=find.identity.family,
        named=find.named,
        place=place_of(find.identity),
        equation=find.equation,
        reference=find.reference,
        parameters=tuple(
            records.Fitted(
                name=one.name,
                unit=_unit(one.unit or _unit_of_nodes(find.curve), joint),
                value=one.value,
                sigma=one.sigma,
                low=one.low,
                high=one.high,
            )
            for one in find.estimates
        ),
        probability=find.probability,
        distance=find.rho_eff,
        absorbed=find.kappa,
        rivals=tuple(
            records.Rival(
                name=other.identity.law,
                family=other.identity.family,
                place=place_of(other.identity),
                distance=other.rho_delta,
                probability=other.probability,
                simulated=other.refitted,
            )
            for other in find.alternatives
        ),
        gate=tuple(
            records.Gated(
                recording=fold.trial,
                role=roles[fold.trial],
                before=_rms(fold.before),
                after=_rms(fold.after),
                gain=fold.gain,
            )
            for fold in find.gate.folds
        ),
        same_ports=find.ports_alike,
        curve=None if find.curve is None else _curve(find.curve, experiment.rig, joint),
        held_out_variance=find.held_out_variance,
    )


def _unit_of_nodes(curve: Curve | None) -> str:
    """Unit of a measured torque's coefficients, whose names no law declares."""
    return "N m" if curve is not None and isinstance(curve.law, Measured) else ""


def _joint(find: Find, rig: Rig) -> Joint | None:
    """The joint whose numbers a find has: units are those of one that turns, or slides."""
    return next((joint for joint in rig.joints if joint.name == find.identity.axis), None)


def _unit(turning: str, joint: Joint | None) -> str:
    return turning if joint is None else joint.unit_of(turning)


def _curve(curve: Curve, rig: Rig, joint: Joint | None) -> records.Curve:
    over, regressor, own = joint, "joint_angle", "rad"
    if isinstance(curve.law, Measured):
        regressor, own = curve.law.regressor, "N m"
        if joint is not None and curve.law.effect.crossed:
            over = rig.joint(other_joint(rig, joint.name))
    return records.Curve(
        regressor=regressor.replace("_", " "),
        x_unit=_unit(unit_of(regressor), over),
        y_unit=_unit(own, joint),
        x=tuple(curve.x.tolist()),
        y=tuple(curve.value.tolist()),
        sigma=tuple(curve.sigma.tolist()),
    )


def _rms(ratio: float) -> float:
    return float(np.sqrt(max(ratio, 0.0)))


def _trials(known: Known, corrected: Known) -> Iterator[records.Trial]:
    rows = known.rows
    for k, trial in enumerate(known.experiment.trials):
        z = corrected.metric[k].layout(corrected.residual[k])
        seen = seen_channels(corrected, k)
        each = np.sqrt(np.mean(z**2, axis=(0, 1)))
        yield records.Trial(
            recording=trial.name,
            trajectory=str(trial.trajectory),
            role=trial.role,
            nominal=_rms(float(known.chi2_before[k] / rows[k])),
            known=_rms(float(known.chi2[k] / rows[k])),
            corrected=_rms(float(corrected.chi2[k] / rows[k])),
            channels={known.experiment.channels[c]: float(each[c]) for c in seen},
        )


def _moved(known: Known) -> Iterator[records.Moved]:
    units = {name: quantity.unit for name, quantity in known.hypothesis.rig.quantities().items()}
    entries = zip(
        known.free, known.value, known.sigma, known.parameters.value, known.parameters.sigma, strict=True
    )
    for scalar, value, sigma, prior, spread in entries:
        if scalar.quantity not in units:
            continue
        bounded = bool(np.isfinite(spread) and spread > 0.0)
        yield records.Moved(
            name=scalar.name,
            unit=units[scalar.quantity],
            prior=float(prior),
            prior_sigma=float(spread) if bounded else None,
            value=float(value),
            sigma=float(sigma),
            sigmas=float((value - prior) / spread) if bounded else None,
        )


def _ports(outcome: Outcome) -> Iterator[records.PortTest]:
    if outcome.place is None:
        return
    for port in outcome.place.test.ports:
        yield records.PortTest(
            port=port.name,
            log10_p=port.log_p / float(np.log(10.0)),
            sufficient=port.sufficient,
            share=port.explained,
            same_as=port.alike,
        )


def _suspects(outcome: Outcome) -> Iterator[records.Suspect]:
    entries = (
        *((one.identity, one.rho_eff, one.kappa, "accepted") for one in outcome.finds),
        *((one.identity, one.rho_eff, None, f"refused: {'; '.join(one.reasons)}") for one in outcome.refused),
        *((one.identity, one.rho, one.kappa, f"absorbed by {', '.join(one.by)}") for one in outcome.absorbed),
    )
    for identity, distance, absorbed, said in entries:
        yield records.Suspect(
            name=identity.law,
            family=identity.family,
            place=place_of(identity),
            distance=distance,
            absorbed=absorbed,
            outcome=said,
        )


def _warnings(campaign: Campaign, floor: Floor, outcome: Outcome) -> Iterator[Notice]:
    experiment = outcome.standing.known.experiment
    for find in outcome.finds:
        if not find.gate.held_out:
            yield Notice(
                severity="warning",
                what=f"{find.identity.law} was judged by leaving out fit recordings in turn: none was held out",
                remedy="give a recording the role held-out, better of another trajectory",
            )
        if left_out(find):
            yield Notice(severity="info", what=f"{find.identity.law}: {_EACH_TIME}", where=CORRECTED)
    if not experiment.held_out:
        yield Notice(
            severity="warning",
            what="no recording is held out: nothing is shown on recordings that were not used",
            remedy='set role = "held-out" for a repeat or another trajectory',
        )
    if outcome.unforeseen:
        yield Notice(
            severity="warning",
            what="what recordings that were held out show, those that were fitted do not: nothing of it was looked for",
            remedy='give one of them the role "fit", and hold out another one that shows it',
        )
    elif outcome.finds and experiment.held_out and not _other_motions(experiment):
        yield Notice(
            severity="warning",
            what="recordings that were held out repeat motions that were fitted: a law that holds for these alone, or "
            "known parameters that were not found, would pass too",
            remedy="hold out a recording of another trajectory",
        )
    if floor.source == "declared":
        yield Notice(
            severity="warning",
            what=f"{floor.statement}: other noise would be taken for a mismatch, and one below that frequency alone is "
            "not detected",
            remedy="repeat a trajectory",
        )
    for entry in campaign.recordings:
        for trial in experiment.trials:
            if trial.name == entry.name:
                yield from lost(entry, [loss for loss in trial.losses if loss.kind != PASSED_OVER])
                yield from passed_over(entry, trial.losses)


def passed_over(entry: RecordingEntry, losses: Sequence[Loss]) -> Iterator[Notice]:
    """Which part of a long recording all this is of."""
    for loss in losses:
        if loss.kind == PASSED_OVER:
            yield Notice(
                severity="warning",
                what=f"looked at is {loss.detail}",
                where=entry.name,
                remedy="give its start_s and end_s in campaign.toml to look at another part",
            )


def _other_motions(experiment: Experiment) -> bool:
    """Whether a trajectory was held out of which nothing was fitted."""
    fitted = {experiment.trials[k].trajectory for k in experiment.fit}
    return any(experiment.trials[k].trajectory not in fitted for k in experiment.held_out)


def seen_channels(known: Known, k: int) -> list[int]:
    """Channels of a trial that show something."""
    window = known.metric[k].whiten.window
    return [c for c in range(window.shape[1]) if window[:, c].any()]
