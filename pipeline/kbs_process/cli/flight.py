"""Run the flight model in orbit: its spread, and its day."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from kbs_process.cli.shared import commanded_by, scheduler_option, verb

if TYPE_CHECKING:
    from kbs_process.campaign.config import Campaign
    from kbs_process.results.outcome import Outcome

_SEED = click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help="Of the draw.")


@verb(
    *commanded_by("Commands from a table, as for simulate."),
    click.option("--samples", type=click.IntRange(2), default=200, show_default=True, help="Units to fly."),
    _SEED,
    scheduler_option,
    example=("flight campaign/EL089", "flight campaign/EL089 --command slew.csv --samples 500 --seed 3"),
    output="results/NAME-flight",
    pdf=True,
    checksums=False,
    flight=True,
)
def flight(campaign: Campaign, trajectory: str | None, command: Path | None, **options: Any) -> Outcome:
    """Predict CAMPAIGN's flight model in orbit, with the uncertainty of its parameters.

    Units are drawn from the parameters' uncertainties, those of [flight] in campaign.toml in the place of the test's,
    and each is flown along the same commands. Gives the probability of meeting each requirement, the range in which
    90 % of the units stay, and the numbers that decide.
    """
    from kbs_process.studies.flight.run import predict_flight

    return predict_flight(campaign, trajectory, command, **options)


@verb(
    click.option(
        "--samples",
        type=click.IntRange(0),
        default=8,
        show_default=True,
        help="Units that fly the day beside the nominal one; fewer than two: none.",
    ),
    _SEED,
    campaign="campaign/REFDAY",
    example=("reference-day", "reference-day campaign/REFDAY --samples 0 --output /data/day --check"),
    output="results/NAME-reference-day",
    pdf=True,
    check="a requirement is not met, or undecided",
    recordings=False,
)
def reference_day(campaign: Campaign, **options: Any) -> Outcome:
    """Simulate the reference day of CAMPAIGN [default: campaign/REFDAY] in flight.

    Plans the antenna's trajectory from the orbit and the relay satellites of the campaign's mission file, flies it
    through controller and plant, and judges pointing and disturbance torque in each section of the day. Units drawn
    from the parameters' uncertainties fly the same day, and say how far the figures can be trusted.
    """
    from kbs_process.studies.reference_day.run import simulate_day

    return simulate_day(campaign, **options)
