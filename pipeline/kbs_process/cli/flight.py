"""Run the flight model in orbit: its spread, and its day."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from kbs_process.cli.shared import (
    EXISTING_FILE,
    NOT_MET,
    campaign_argument,
    examples,
    output_option,
    pdf_option,
    progress,
    quiet_option,
)


@click.command(
    epilog=examples("flight campaign/EL089", "flight campaign/EL089 --command slew.csv --samples 500 --seed 3")
)
@campaign_argument
@click.option(
    "--trajectory",
    metavar="NAME",
    help="Commands of the first recording of this trajectory [default, without --command: the last one listed].",
)
@click.option("--command", type=EXISTING_FILE, help="Commands from a table, as for simulate.")
@click.option("--samples", type=click.IntRange(2), default=200, show_default=True, help="Units to fly.")
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help="Of the draw.")
@output_option("results/NAME-flight")
@pdf_option
@quiet_option
def flight(
    campaign: str,
    trajectory: str | None,
    command: Path | None,
    samples: int,
    seed: int,
    output: Path | None,
    pdf: bool | None,
    quiet: bool,
) -> None:
    """Predict CAMPAIGN's flight model in orbit, with the uncertainty of its parameters.

    Units are drawn from the parameters' uncertainties, those of [flight] in campaign.toml in the place of the test's,
    and each is flown along the same commands. Gives the probability of meeting each requirement, the range in which
    90 % of the units stay, and the numbers that decide.
    """
    if trajectory is not None and command is not None:
        raise click.UsageError("Give --trajectory or --command, not both.")
    from kbs_process.campaign.load import load_campaign
    from kbs_process.campaign.locate import find_campaign, results_folder

    folder = find_campaign(campaign)
    target = results_folder(folder, output, suffix="-flight")
    loaded = load_campaign(folder, checksums=False, flight=True, recordings=command is None)
    from kbs_process.studies.flight.run import predict_flight

    outcome = predict_flight(
        loaded, trajectory, command, target, samples=samples, seed=seed, progress=progress(quiet), pdf=pdf
    )
    for line in outcome.verdict_lines:
        click.echo(line)
    click.echo(f"Report: {outcome.report}")


@click.command(
    "reference-day", epilog=examples("reference-day", "reference-day campaign/REFDAY --output /data/day --check")
)
@click.argument("campaign", default="campaign/REFDAY")
@output_option("results/NAME-reference-day")
@pdf_option
@click.option("--check", is_flag=True, help="Exit with 1 when a requirement is not met.")
@quiet_option
def reference_day(campaign: str, output: Path | None, pdf: bool | None, check: bool, quiet: bool) -> None:
    """Simulate the reference day of CAMPAIGN [default: campaign/REFDAY] in flight.

    Plans the antenna's trajectory from the orbit and the relay satellites of the campaign's mission file, flies it
    through controller and plant, and judges pointing and disturbance torque in each section of the day.
    """
    from kbs_process.campaign.load import load_campaign
    from kbs_process.campaign.locate import find_campaign, results_folder

    folder = find_campaign(campaign)
    target = results_folder(folder, output, suffix="-reference-day")
    loaded = load_campaign(folder, recordings=False)
    from kbs_process.studies.reference_day.run import simulate_day

    outcome = simulate_day(loaded, target, progress=progress(quiet), pdf=pdf)
    for line in outcome.verdict_lines:
        click.echo(line)
    click.echo(f"Report: {outcome.report}")
    if check and outcome.requirement_met is False:
        sys.exit(NOT_MET)
