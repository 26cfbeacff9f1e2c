"""A methods paragraph for a test report, generated from what was done and with the constants that were used."""

from __future__ import annotations

from collections.abc import Sequence

from kbs_process.campaign.config import Campaign
from kbs_process.reduction.analysis import Analysis
from kbs_process.reduction.relief import forces_in
from kbs_process.studies.correlate.findings import Findings


def methods(campaign: Campaign, analyses: Sequence[Analysis], findings: Findings) -> str:
    """Return paragraphs separated by empty lines."""
    return "\n\n".join(
        [_reduction(campaign, analyses), _gravity(campaign, analyses), _bands(findings), _plant(campaign)]
    )


def _reduction(campaign: Campaign, analyses: Sequence[Analysis]) -> str:
    rates = sorted({f"{rate:.6g}" for analysis in analyses for rate in analysis.run.load_rates})
    driven = [joint.name for joint in campaign.rig.joints if joint.effort is not None]
    loads = [
        *(["the transducer's wrench"] if campaign.rig.transducer.channels else []),
        *([f"the effort of {', '.join(driven)}"] if driven else []),
    ]
    reduced = (
        f"{len(analyses)} recordings of {' and '.join(loads)} at {', '.join(rates)} Hz were brought "
        f"to one clock each and to {campaign.bands.working_rate:g} Hz by linear-phase Kaiser filters (gain error at "
        "most 1e-5, aliases at most -120 dB)."
    )
    undone = " Cross-coupling was undone by the calibrated matrix: w = (I + X)^-1 (raw - bias)."
    return reduced + (undone if campaign.rig.transducer.channels else "")


def _gravity(campaign: Campaign, analyses: Sequence[Analysis]) -> str:
    used = [analysis.entry.name for analysis in analyses if analysis.entry.role != "held-out"]
    angles = [line for line in analyses[-1].motion.history if ": " in line]
    what = "Gravity and inertia were" if campaign.drive == "motion" else "Gravity was"
    efforts = any(joint.effort is not None for joint in campaign.rig.joints)
    return (
        f"{what} fitted to {', '.join(used)} by maximum a posteriori least squares over masses, centres of gravity, "
        f"{'inertia, viscous friction and gains of the efforts, ' if efforts else ''}tilt, misalignments and residual "
        "cross-coupling, with the one-sigma values of the parameter files as priors and a taring bias for each "
        f"recording; g = {float(campaign.rig.gravity):g} m/s^2. The static part was "
        "subtracted from all recordings. Held-out ones were not fitted; of each one constant a channel was estimated "
        "(location under Student's t with 4 degrees of freedom about the spread of the fitted residuals) and "
        f"subtracted as well. Angles: {'; '.join(angles)}."
    )


def _bands(findings: Findings) -> str:
    cut = [f"{band.label}: {band.method}" for band in findings.bands if band.low_pass_Hz is not None]
    return "Measurement and prediction went through the same band filters. " + "; ".join(cut) + "."


def _plant(campaign: Campaign) -> str:
    if campaign.drive == "motion":
        return (
            "The prediction is the rigid-body inverse dynamics of the measured motion, with the fitted parameters; "
            "the rig has no model of a drive."
        )
    return (
        "The prediction is the plant's, driven by the recorded field where there is one, else by the recorded "
        "commands through the controller, with the masses and centres of gravity that the fit found and the nominal "
        f"drives of the parameter files. Effects in the plant: {', '.join(campaign.effects)}. Its static wrench was "
        f"removed at its own angles.{_relief(campaign)}"
    )


def _relief(campaign: Campaign) -> str:
    acting = {entry.name: [force.name for force in forces_in(campaign, entry)] for entry in campaign.recordings}
    names = sorted({force for forces in acting.values() for force in forces})
    if not names:
        return ""
    recordings = ", ".join(name for name, forces in acting.items() if forces)
    return (
        f" The static wrench of the rig's own {', '.join(names)} in {recordings}, at the angles of each and with the "
        "numbers of the parameter files, was taken from measurement and prediction alike: it is no disturbance of the "
        "article. "
        "Gravity was fitted without these recordings, where there are others."
    )
