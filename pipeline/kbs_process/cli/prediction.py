"""Run a campaign's plant: on commands alone, or along a recording."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

import click

from kbs_process.cli.shared import commanded_by, conclude, examples, output_option, progress, quiet_option, verb

if TYPE_CHECKING:
    from kbs_process.campaign.config import Campaign
    from kbs_process.progress import Progress


@verb(
    *commanded_by(
        "CSV or Parquet file with columns t (s), and for each joint its angle JOINT (rad) and, if known, its rate "
        "JOINT.rate (rad/s)."
    ),
    click.option(
        "--rate",
        type=click.FloatRange(min=0, min_open=True),
        metavar="HZ",
        help="Sampling rate of the wrench [default: the recording's; 100 with --command].",
    ),
    click.option("--stop", type=float, default=math.inf, metavar="S", help="Request a stop then."),
    example=("simulate campaign/EL089 --trajectory EL089P00", "simulate campaign/EL089 --command slew.csv --rate 200"),
    output="results/NAME-simulated",
    checksums=False,
)
def simulate(
    campaign: Campaign,
    trajectory: str | None,
    command: Path | None,
    rate: float | None,
    stop: float,
    target: Path,
    progress: Progress,
) -> tuple[str, ...]:
    """Run CAMPAIGN's plant on commands alone, through its controller.

    Writes wrench, angles and field as Parquet and as simulated.mcap. With --command no recording need be there.
    """
    from kbs_process.studies.predict.run import simulate_commands, simulate_trajectory

    if command is not None:
        written = simulate_commands(campaign, command, target, rate_Hz=rate or 100.0, progress=progress, stop=stop)
    else:
        written = simulate_trajectory(campaign, trajectory, target, rate_Hz=rate, progress=progress, stop=stop)
    return (f"Simulated: {written}",)


@click.command(
    epilog=examples(
        "predict campaign/EL089 EL089P00_1",
        "predict campaign/EL089 other.mcap -o /tmp/other",
        "predict --model results/EL089-diagnosis/corrected other.mcap",
    )
)
@click.argument("words", nargs=-1, required=True, metavar="[CAMPAIGN] RECORDING")
@click.option(
    "--model",
    type=click.Path(path_type=Path, exists=True),
    metavar="FOLDER",
    help="A corrected model that 'diagnose' wrote, in the place of CAMPAIGN.",
)
@output_option("results/NAME-predicted; with --model, results/NAME-corrected-predicted")
@quiet_option
def predict(words: tuple[str, ...], model: Path | None, output: Path | None, quiet: bool) -> None:
    """Predict one RECORDING: a name from CAMPAIGN, or any MCAP file with the same topics.

    The plant follows what was recorded: field positions, encoders and commands, or, for a campaign that is
    driven by motion, the measured angles. The rig is the one of the parameter files, nothing is fitted.
    With --model, RECORDING may also be a table of commands as 'simulate' takes it, CSV or Parquet.
    Writes the prediction as Parquet and as predicted.mcap.
    """
    if len(words) != (2 if model is None else 1):
        raise click.UsageError("Give CAMPAIGN and RECORDING, or --model FOLDER and RECORDING.")
    from kbs_process.campaign.load import load_campaign
    from kbs_process.campaign.locate import find_campaign, results_folder
    from kbs_process.studies.predict.run import predict_recording, predict_with

    folder = find_campaign(words[0] if model is None else str(model))
    # The recordings that a model came from may be elsewhere by now.
    loaded = load_campaign(folder, checksums=False, recordings=model is None)
    if model is not None:
        output = output or Path("results") / f"{loaded.name}-corrected-predicted"
    target = results_folder(folder, output, suffix="-predicted")
    run = predict_recording if model is None else predict_with
    conclude((f"Predicted: {run(loaded, words[-1], target, progress=progress(quiet))}",))
