"""Correct the model by what was recorded, and score the diagnosis that does so."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from kbs_process.cli.shared import FOLDER, examples, scheduler_option, verb

if TYPE_CHECKING:
    from kbs_process.campaign.config import Campaign
    from kbs_process.results.outcome import Outcome


@verb(
    click.option(
        "--starts", type=click.IntRange(min=1), default=2, show_default=True, help="Starting points that are followed."
    ),
    click.option(
        "--run-to-run",
        type=click.FloatRange(min=0.0, min_open=True),
        default=0.02,
        show_default=True,
        metavar="SHARE",
        help="By how much a friction torque differs from run to run, one sigma, of itself.",
    ),
    scheduler_option,
    example=("identify campaign/DUMMY1", "identify campaign/DUMMY1 --starts 3 --run-to-run 0.01"),
    output="results/NAME-identify",
    pdf=True,
)
def identify(campaign: Campaign, starts: int, run_to_run: float, **options: Any) -> Outcome:
    """Identify the motor-gears of CAMPAIGN from its recordings with the role "fit".

    Writes corrected parameter files (identified/parameters), and a report with intervals, checks, correlations and the
    prediction of held-out recordings before and after. Takes ten minutes or more.
    """
    from kbs_process.identification.estimate import Settings
    from kbs_process.studies.identify.run import identify as run

    return run(campaign, settings=Settings(starts=starts, run_to_run=run_to_run), **options)


@verb(
    example=("diagnose campaign/EL089", "diagnose campaign/EL089 -o /data/why --no-pdf"),
    output="results/NAME-diagnosis",
    pdf=True,
)
def diagnose(campaign: Campaign, **options: Any) -> Outcome:
    """Find out why recordings of CAMPAIGN differ from their prediction.

    Detects what exceeds the repeatability floor, refits the known parameters within their uncertainties, locates what
    they leave, names its physics or measures its law, and tries it on recordings that were held out. Writes a
    corrected model (corrected/) beside the report. Experimental: docs/validations.md says how often it is right.
    """
    from kbs_process.studies.diagnose.run import diagnose as run

    return run(campaign, **options)


@click.command(
    epilog=examples("prove", "prove --full --jobs 8", "prove --full --scheduler tcp://10.0.0.5:8786")
    + "\n\nFrom a checkout; an interrupted bench goes on where it stopped. Exit status 1: a find in a trial without "
    "a concealed effect, or a trial without an answer."
)
@click.option(
    "--full", is_flag=True, help="A set of validation trials and all rivals: two hours, to results/proof/full."
)
@click.option("--trials", type=click.IntRange(1), metavar="N", help="How many [default: 6; 20 with --full].")
@click.option(
    "--work", type=FOLDER, metavar="FOLDER", help="Where trials and answers are kept [default: .proof/SPLIT-N]."
)
@click.option(
    "--output", "-o", type=FOLDER, metavar="FOLDER", help="Where the score goes [default: results/proof/small or full]."
)
@click.option("--jobs", type=click.IntRange(1), metavar="N", help="Processes [default: one a core].")
@scheduler_option
def prove(
    full: bool, trials: int | None, work: Path | None, output: Path | None, jobs: int | None, scheduler: str | None
) -> None:
    """Prove the diagnosis on campaigns with concealed effects.

    Makes campaigns, conceals in each nothing or up to three effects, seals what is concealed, has each diagnosed by a
    process that cannot read the seals, then breaks them and scores: found, placed, named, measured, beside rivals.
    """
    from kbs_process.studies.prove import run_bench

    given = {"trials": trials, "work": work, "output": output, "jobs": jobs, "scheduler": scheduler}
    options = [f"--{name}={value}" for name, value in given.items() if value is not None]
    sys.exit(run_bench([*(["--full"] if full else []), *options]))
