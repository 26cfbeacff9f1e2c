"""Correct the model by what was recorded, and score the diagnosis that does so."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from kbs_process.cli.shared import (
    FOLDER,
    campaign_argument,
    examples,
    output_option,
    pdf_option,
    progress,
    quiet_option,
)


@click.command(epilog=examples("identify campaign/DUMMY1", "identify campaign/DUMMY1 --starts 3 --run-to-run 0.01"))
@campaign_argument
@click.option(
    "--starts", type=click.IntRange(min=1), default=2, show_default=True, help="Starting points that are followed."
)
@click.option(
    "--run-to-run",
    type=click.FloatRange(min=0.0, min_open=True),
    default=0.02,
    show_default=True,
    metavar="SHARE",
    help="By how much a friction torque differs from run to run, one sigma, of itself.",
)
@output_option("results/NAME-identify")
@pdf_option
@quiet_option
def identify(campaign: str, starts: int, run_to_run: float, output: Path | None, pdf: bool | None, quiet: bool) -> None:
    """Identify the motor-gears of CAMPAIGN from its recordings with the role "fit".

    Writes corrected parameter files (identified/parameters), and a report with intervals, checks, correlations and the
    prediction of held-out recordings before and after. Takes ten minutes or more.
    """
    from kbs_process.campaign.load import load_campaign
    from kbs_process.campaign.locate import find_campaign, results_folder

    folder = find_campaign(campaign)
    target = results_folder(folder, output, suffix="-identify")
    loaded = load_campaign(folder)
    from kbs_process.identification.estimate import Settings
    from kbs_process.studies.identify.run import identify as run

    settings = Settings(starts=starts, run_to_run=run_to_run)
    outcome = run(loaded, target, settings=settings, progress=progress(quiet), pdf=pdf)
    for line in outcome.verdict_lines:
        click.echo(line)
    click.echo(f"Report: {outcome.report}")


@click.command(epilog=examples("diagnose campaign/EL089", "diagnose campaign/EL089 -o /data/why --no-pdf"))
@campaign_argument
@output_option("results/NAME-diagnosis")
@pdf_option
@quiet_option
def diagnose(campaign: str, output: Path | None, pdf: bool | None, quiet: bool) -> None:
    """Find out why recordings of CAMPAIGN differ from their prediction.

    Detects what exceeds the repeatability floor, refits the known parameters within their uncertainties, locates what
    they leave, names its physics or measures its law, and tries it on recordings that were held out. Writes a
    corrected model (corrected/) beside the report. Experimental: docs/validations.md says how often it is right.
    """
    from kbs_process.campaign.load import load_campaign
    from kbs_process.campaign.locate import find_campaign, results_folder

    folder = find_campaign(campaign)
    target = results_folder(folder, output, suffix="-diagnosis")
    loaded = load_campaign(folder)
    from kbs_process.studies.diagnose.run import diagnose as run

    outcome = run(loaded, target, progress=progress(quiet), pdf=pdf)
    for line in outcome.verdict_lines:
        click.echo(line)
    click.echo(f"Report: {outcome.report}")


@click.command(
    epilog=examples("prove", "prove --full --jobs 8", "prove --full --dask tcp://10.0.0.5:8786")
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
@click.option("--dask", metavar="ADDRESS", help="Scheduler of a Dask cluster to run on: tcp://HOST:PORT.")
def prove(
    full: bool, trials: int | None, work: Path | None, output: Path | None, jobs: int | None, dask: str | None
) -> None:
    """Prove the diagnosis on campaigns with concealed effects.

    Makes campaigns, conceals in each nothing or up to three effects, seals what is concealed, has each diagnosed by a
    process that cannot read the seals, then breaks them and scores: found, placed, named, measured, beside rivals.
    """
    from kbs_process.studies.prove import run_bench

    given = {"trials": trials, "work": work, "output": output, "jobs": jobs, "dask": dask}
    options = [f"--{name}={value}" for name, value in given.items() if value is not None]
    sys.exit(run_bench([*(["--full"] if full else []), *options]))
