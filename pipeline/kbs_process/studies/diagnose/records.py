"""What a diagnosis says, as the contents of its results.json."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import msgspec
import numpy as np

from kbs_process.campaign.config import Campaign
from kbs_process.diagnosis.acceptance.outcome import Curve, Find, Outcome
from kbs_process.diagnosis.experiments.experiment import Experiment
from kbs_process.diagnosis.experiments.floor import Floor
from kbs_process.diagnosis.nominal.known import Known
from kbs_process.diagnosis.selection.next_test import Proposal
from kbs_process.plant.effect import Port
from kbs_process.plant.laws.position.measured_law import Measured, unit_of
from kbs_process.plant.structure import other_joint
from kbs_process.results import provenance
from kbs_process.results.records import Check, Conclusion
from kbs_process.rig.model import Joint, Rig
from kbs_process.studies.diagnose import results as records
from kbs_process.studies.diagnose.prose import answer, notes, notices, paragraph, rms
from kbs_process.studies.diagnose.unexplained import unexplained
from kbs_process.studies.diagnose.written import Shown

COMMANDS = "next-test.csv"  # file of the next test's commands, in the results' folder
_SHOWN = 25  # suspects in the table
_PORTS = {Port.GROUND_TORQUE.tested: Port.GROUND_TORQUE.word}  # of the port test, in the words of finds


def results_of(
    campaign: Campaign,
    floor: Floor,
    outcome: Outcome,
    corrected: Shown,
    files: Sequence[str],
    proposal: Proposal | None,
    verb: str = "diagnose",
) -> records.DiagnosisResults:
    """What a diagnosis says, and what its `corrected` model shows; `verb` is the command's, none of processing."""
    known = outcome.known
    finds = tuple(_find(find, known.experiment) for find in outcome.finds)
    trials = tuple(_trials(known, corrected.known))
    before = [known.shown[trial.drive].values for trial in known.experiment.trials]
    requirements = tuple(unexplained(campaign, known.experiment, before, corrected.values))
    return records.DiagnosisResults(
        name=campaign.name,
        title=campaign.title,
        article=campaign.article,
        verdict=Conclusion(
            status="undecided" if outcome.verdict == "undecided" else "none",
            sentence=answer(outcome, trials, requirements, floor),
        ),
        provenance=provenance.made(verb, campaign.folder, campaign.files),
        answer=outcome.verdict,
        paragraph=paragraph(outcome, finds, trials, requirements, floor),
        floor=floor.statement,
        log10_p=outcome.log_p / float(np.log(10.0)),
        moved=outcome.standing.known.numbers,
        finds=finds,
        trials=trials,
        requirements=requirements,
        ports=tuple(_ports(outcome)),
        located=tuple(msgspec.structs.replace(one, port=_PORTS.get(one.port, one.port)) for one in outcome.located),
        suspects=tuple(_suspects(outcome))[:_SHOWN],
        # Without a law, the search may have gone on to a better place.
        checks=tuple(
            Check(name=c.name, ok=c.passed, detail=c.detail)
            for c in (known if outcome.finds else outcome.standing.known).checks
        ),
        files=tuple(files),
        next_test=None if proposal is None else next_test(proposal),
        warnings=tuple(notices(campaign, floor, outcome)),
        notes=notes(),
    )


def _find(find: Find, experiment: Experiment) -> records.Find:
    roles = {trial.name: trial.role for trial in experiment.trials}
    joint = _joint(find, experiment.rig)
    return records.Find(
        name=find.identity.law,
        family=find.identity.family,
        named=find.named,
        place=find.identity.place,
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
                place=other.identity.place,
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
                before=rms(fold.before),
                after=rms(fold.after),
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
    return next((joint for joint in rig.joints if joint.name == find.identity.place.site), None)


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
            nominal=rms(float(known.chi2_before[k] / rows[k])),
            known=rms(float(known.chi2[k] / rows[k])),
            corrected=rms(float(corrected.chi2[k] / rows[k])),
            channels={known.experiment.channels[c]: float(each[c]) for c in seen},
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
            place=identity.place,
            distance=distance,
            absorbed=absorbed,
            outcome=said,
        )


def next_test(proposal: Proposal) -> records.NextTest:
    """Return the record of a proposal."""
    apart = bool(proposal.rivals)
    return records.NextTest(
        law=proposal.law.words,
        rivals=tuple(one.words for one in proposal.rivals),
        trajectory=proposal.trajectory.words,
        seconds=proposal.trajectory.seconds,
        file=COMMANDS,
        distance=proposal.distance if apart else None,
        p_wrong=proposal.p_wrong if apart else None,
        recordings=proposal.recordings,
        sigma=None if math.isnan(proposal.sigma) else proposal.sigma,
        tried=proposal.tried,
    )


def seen_channels(known: Known, k: int) -> list[int]:
    """Channels of a trial that show something."""
    window = known.metric[k].whiten.window
    return [c for c in range(window.shape[1]) if window[:, c].any()]
