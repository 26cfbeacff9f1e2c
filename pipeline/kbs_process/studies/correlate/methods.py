"""A methods paragraph for a test report, generated from what was done and with the constants that were used."""

from __future__ import annotations

from collections.abc import Sequence

from kbs_process.campaign.config import Campaign
from kbs_process.reduction.analysis import Analysis
from kbs_process.reduction.relief import forces_in
from kbs_process.report.prose import Prose
from kbs_process.studies.correlate.results import Results

_SAYS = Prose("kbs_process.studies.correlate", "methods")


def methods(campaign: Campaign, analyses: Sequence[Analysis], found: Results) -> str:
    """Return paragraphs separated by empty lines."""
    rig, inertia = campaign.rig, campaign.drive == "motion"
    driven = [joint.name for joint in rig.joints if joint.effort is not None]
    transducer = ["the transducer's wrench"] if rig.transducer.channels else []
    reduction = _SAYS(
        "reduction",
        recordings=len(analyses),
        loads=[*transducer, *([f"the effort of {', '.join(driven)}"] if driven else [])],
        rates=sorted({f"{rate:.6g}" for analysis in analyses for rate in analysis.run.load_rates}),
        working_rate=campaign.bands.working_rate,
        transducer=bool(transducer),
    )
    gravity = _SAYS(
        "gravity",
        inertia=inertia,
        fitted=[analysis.entry.name for analysis in analyses if analysis.entry.role != "held-out"],
        efforts=bool(driven),
        g=float(rig.gravity),
        angles=[line for line in analyses[-1].motion.history if ": " in line],
    )
    bands = [f"{band.label}: {band.method}" for band in found.bands if band.low_pass_Hz is not None]
    plant = _SAYS("plant_of_motion") if inertia else _plant(campaign)
    return "\n\n".join([reduction, gravity, _SAYS("bands", bands=bands), plant])


def _plant(campaign: Campaign) -> str:
    acting = {entry.name: [force.name for force in forces_in(campaign, entry)] for entry in campaign.recordings}
    return _SAYS(
        "plant_of_commands",
        effects=campaign.effects,
        forces=sorted({force for forces in acting.values() for force in forces}),
        pulled=[name for name, forces in acting.items() if forces],
    )
