"""The command line. Thin: it parses, calls, prints, and turns errors into messages and exit statuses.

Nothing that computes is imported at the top, so that `--help` answers at once.
"""

from __future__ import annotations

import functools
import math
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from kbs_process import __version__, interruption
from kbs_process.errors import KbsError, OutputError, did_you_mean

if TYPE_CHECKING:
    from kbs_process.campaign.progress import Progress

NOT_MET, BAD_INPUT, INTERNAL, INTERRUPTED = 1, 2, 70, 130

EXISTING_FILE = click.Path(path_type=Path, exists=True, dir_okay=False)
FOLDER = click.Path(path_type=Path, file_okay=False)


class CampaignGroup(click.Group):
    """A group of verbs; where the first word is none of them, it is a campaign to be processed."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        if args and args[0] not in self.commands and args[0] not in ("--help", "-h", "--version"):
            self._refuse_misspelt_verb(args[0], ctx)
            args = ["process", *args]
        return super().parse_args(ctx, args)

    def _refuse_misspelt_verb(self, word: str, ctx: click.Context) -> None:
        hint = did_you_mean(word, self.commands)
        if hint.startswith("did") and not Path(word).exists():
            raise click.UsageError(f"There is no verb '{word}': {hint}", ctx)


def examples(*lines: str) -> str:
    """Return an epilog that click prints as it is."""
    return "\b\nExamples:\n" + "\n".join(f"  kbs-process {line}" for line in lines)


@click.group(
    cls=CampaignGroup,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    epilog=examples("campaign/EL089", "campaign/EL089 --check", "validate campaign/EL089", "VERB --help")
    + "\n\nExit status: 0 done; 1 a requirement is not met, or a recording has losses (only with --check); "
    "2 bad input. With --debug, any error shows its traceback.",
    subcommand_metavar="CAMPAIGN | VERB ...",
)
@click.version_option(__version__, prog_name="kbs-process")
def cli() -> None:
    """Disturbance torque of a pointing mechanism: from raw force/torque recordings to a correlation report.

    Without a verb, CAMPAIGN is processed. campaign/NAME is the folder campaigns/NAME, here or above; any other
    folder that holds a campaign.toml goes as well.
    """


campaign_argument = click.argument("campaign")
output_option = click.option(
    "--output", "-o", type=FOLDER, metavar="FOLDER", help="Where results go [default: reports/NAME]."
)
quiet_option = click.option("--quiet", "-q", is_flag=True, help="No progress.")
pdf_option = click.option(
    "--pdf/--no-pdf", default=None, help="A report.pdf beside the page [default: if WeasyPrint is installed]."
)


@cli.command(epilog=examples("campaign/EL089", "process campaign/EL089 --check --output /data/EL089"))
@campaign_argument
@output_option
@pdf_option
@click.option("--check", is_flag=True, help="Exit with 1 when a requirement is not met.")
@click.option(
    "--diagnose/--no-diagnose",
    "why",
    default=None,
    help="Find out why, where recordings differ from the prediction by more than repeats do: takes minutes, after the "
    "report is written [default: if the recordings allow it].",
)
@quiet_option
def process(
    campaign: str, output: Path | None, pdf: bool | None, check: bool, why: bool | None, quiet: bool
) -> None:
    """Process CAMPAIGN: fit, compare with the prediction, and write the report.

    Where the two differ by more than repeats of one trajectory do, a diagnosis follows.
    """
    from kbs_process.campaign.load import load_campaign
    from kbs_process.campaign.locate import find_campaign, results_folder

    folder = find_campaign(campaign)
    target = results_folder(folder, output)
    loaded = load_campaign(folder)
    # Bad input is told before all that computes is imported.
    from kbs_process.campaign.run import process as run

    outcome = run(loaded, target, progress=_progress(quiet), pdf=pdf)
    for line in outcome.verdict_lines:
        click.echo(line)
    click.echo(f"Report: {outcome.report}")
    if why is not False:
        from kbs_process.campaign.diagnosing import diagnose_results

        try:
            for line in diagnose_results(loaded, target, progress=_progress(quiet), pdf=pdf):
                click.echo(line)
        except OutputError:
            raise
        except KbsError as error:
            if why:
                raise
            click.echo(f"Not diagnosed: {error}")
        except KeyboardInterrupt:
            _complain("interrupted: the report is written, a diagnosis is not")
            sys.exit(INTERRUPTED)
    if check and outcome.requirement_met is False:
        sys.exit(NOT_MET)


@cli.command(epilog=examples("validate campaign/EL089", "validate campaign/EL089 --check"))
@campaign_argument
@click.option("--check", is_flag=True, help="Exit with 1 when a recording has losses.")
@quiet_option
def validate(campaign: str, check: bool, quiet: bool) -> None:
    """Check CAMPAIGN's description, and read all its recordings through.

    Exits with 0 if all is well or can be processed, with 2 if something cannot be read.
    """
    from kbs_process.campaign.load import load_campaign
    from kbs_process.campaign.locate import find_campaign
    from kbs_process.campaign.validate import describe, read_through

    loaded = load_campaign(find_campaign(campaign))
    findings = read_through(loaded, _progress(quiet))
    click.echo("\n".join(describe(loaded, findings)))
    if any(finding.error for finding in findings):
        sys.exit(BAD_INPUT)
    if check and any(finding.losses for finding in findings):
        sys.exit(NOT_MET)


@cli.command(epilog=examples("inspect recording.mcap", "inspect --check campaigns/EL089/recordings/*.mcap"))
@click.argument("files", nargs=-1, required=True, type=EXISTING_FILE, metavar="FILE...")
@click.option("--check", is_flag=True, help="Exit with 1 when a recording has losses.")
def inspect(files: tuple[Path, ...], check: bool) -> None:
    """Show what is in recordings: topics, rates, gaps, ranges, damage.

    Exits with 2 if one of them cannot be read at all.
    """
    from kbs_process.campaign.listing import describe_inspection
    from kbs_process.ingest.inspection import inspect_recording

    states = set()
    for path in files:
        inspection = inspect_recording(path)
        states.add(inspection.state)
        click.echo("\n".join(describe_inspection(inspection)))
    if "unreadable" in states:
        sys.exit(BAD_INPUT)
    if check and "lossy" in states:
        sys.exit(NOT_MET)


@cli.command(
    epilog=examples(
        "simulate campaign/EL089 --trajectory EL089P00",
        "simulate campaign/EL089 --command slew.csv --rate 200",
    )
)
@campaign_argument
@click.option("--trajectory", metavar="NAME", help="Commands of the first recording of this trajectory.")
@click.option(
    "--command",
    type=EXISTING_FILE,
    help="CSV or Parquet file with columns t (s), and for each joint its angle JOINT (rad) and, if known, "
    "its rate JOINT.rate (rad/s).",
)
@click.option(
    "--rate",
    type=click.FloatRange(min=0, min_open=True),
    metavar="HZ",
    help="Sampling rate of the wrench [default: the recording's; 100 with --command].",
)
@output_option
@quiet_option
def simulate(
    campaign: str,
    trajectory: str | None,
    command: Path | None,
    rate: float | None,
    output: Path | None,
    quiet: bool,
) -> None:
    """Run CAMPAIGN's plant on commands alone, through its controller.

    Writes wrench, angles and field as Parquet and as simulated.mcap.
    """
    if trajectory is not None and command is not None:
        raise click.UsageError("Give --trajectory or --command, not both.")
    from kbs_process.campaign.load import load_campaign
    from kbs_process.campaign.locate import find_campaign, results_folder
    from kbs_process.campaign.simulate import simulate_commands, simulate_trajectory

    folder = find_campaign(campaign)
    target = results_folder(folder, output, suffix="-simulated")
    loaded = load_campaign(folder, checksums=False)
    if command is not None:
        written = simulate_commands(loaded, command, target, rate_Hz=rate or 100.0, progress=_progress(quiet))
    else:
        written = simulate_trajectory(loaded, trajectory, target, rate_Hz=rate, progress=_progress(quiet))
    click.echo(f"Simulated: {written}")


@cli.command(
    epilog=examples(
        "predict campaign/EL089 EL089P00_1",
        "predict campaign/EL089 other.mcap -o /tmp/other",
        "predict --model reports/EL089-diagnosis/corrected other.mcap",
    )
)
@click.argument("words", nargs=-1, required=True, metavar="[CAMPAIGN] RECORDING")
@click.option(
    "--model",
    type=click.Path(path_type=Path, exists=True),
    metavar="FOLDER",
    help="A corrected model that 'diagnose' wrote, in the place of CAMPAIGN.",
)
@output_option
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
    from kbs_process.campaign.simulate import predict_recording, predict_with

    folder = find_campaign(words[0] if model is None else str(model))
    # The recordings that a model came from may be elsewhere by now.
    loaded = load_campaign(folder, checksums=False, recordings=model is None)
    if model is None:
        target = results_folder(folder, output, suffix="-predicted")
        written = predict_recording(loaded, words[1], target, progress=_progress(quiet))
    else:
        named = output or Path("reports") / f"{loaded.name}-corrected-predicted"
        written = predict_with(loaded, words[0], results_folder(folder, named), progress=_progress(quiet))
    click.echo(f"Predicted: {written}")


@cli.command(
    epilog=examples(
        "flight campaign/EL089", "flight campaign/EL089 --command slew.csv --samples 500 --seed 3"
    )
)
@campaign_argument
@click.option("--trajectory", metavar="NAME", help="Commands of the first recording of this trajectory.")
@click.option("--command", type=EXISTING_FILE, help="Commands from a table, as for simulate.")
@click.option("--samples", type=click.IntRange(2), default=200, show_default=True, help="Units to fly.")
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help="Of the draw.")
@output_option
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
    loaded = load_campaign(folder, checksums=False, flight=True)
    from kbs_process.campaign.flight import predict_flight

    outcome = predict_flight(
        loaded, trajectory, command, target, samples=samples, seed=seed, progress=_progress(quiet), pdf=pdf
    )
    for line in outcome.verdict_lines:
        click.echo(line)
    click.echo(f"Report: {outcome.report}")


@cli.command(
    "reference-day",
    epilog=examples("reference-day", "reference-day campaign/REFDAY --output /data/day --check"),
)
@click.argument("campaign", default="campaign/REFDAY")
@output_option
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
    from kbs_process.campaign.reference_day import simulate_day

    outcome = simulate_day(loaded, target, progress=_progress(quiet), pdf=pdf)
    for line in outcome.verdict_lines:
        click.echo(line)
    click.echo(f"Report: {outcome.report}")
    if check and outcome.requirement_met is False:
        sys.exit(NOT_MET)


@cli.command(
    epilog=examples(
        "stability campaign/EL089", "stability campaign/EL089 --joint el --from 0 --to 87 --points 30"
    )
)
@campaign_argument
@click.option("--joint", metavar="NAME", help="Joint to sweep [default: the last one].")
@click.option(
    "--from", "low", type=float, default=-30.0, show_default=True, metavar="DEG", help="Its first angle."
)
@click.option(
    "--to", "high", type=float, default=90.0, show_default=True, metavar="DEG", help="Its last angle."
)
@click.option("--points", type=click.IntRange(2), default=25, show_default=True, help="Poses.")
@output_option
@pdf_option
@click.option("--check", is_flag=True, help="Exit with 1 when the margins are not kept.")
@quiet_option
def stability(
    campaign: str,
    joint: str | None,
    low: float,
    high: float,
    points: int,
    output: Path | None,
    pdf: bool | None,
    check: bool,
    quiet: bool,
) -> None:
    """Analyse the stability of CAMPAIGN's pointing loop over a joint's range.

    Margins, poles and sensitivity of the linearised, exactly discretised loop on the elastic transducer, and the gains
    at which simulations of the whole plant begin to oscillate.
    """
    from kbs_process.campaign.load import load_campaign
    from kbs_process.campaign.locate import find_campaign, results_folder

    folder = find_campaign(campaign)
    target = results_folder(folder, output, suffix="-stability")
    loaded = load_campaign(folder, checksums=False)
    from kbs_process.campaign.stability import analyse_stability

    outcome = analyse_stability(
        loaded,
        target,
        joint=joint,
        low_deg=low,
        high_deg=high,
        points=points,
        progress=_progress(quiet),
        pdf=pdf,
    )
    for line in outcome.verdict_lines:
        click.echo(line)
    click.echo(f"Report: {outcome.report}")
    if check and not outcome.requirement_met:
        sys.exit(NOT_MET)


@cli.command(
    epilog=examples(
        "modal campaign/EL089 modes.toml --at 70 --at 75 --at 80 --at 87",
        "modal campaign/EL089 modes.toml --f06 70 fem70.f06 --f06 87 fem87.f06 --interface 100 --ground 101",
    )
)
@campaign_argument
@click.argument("file", type=click.Path(path_type=Path, dir_okay=False))
@click.option(
    "--joint", metavar="NAME", help="Joint over whose angle modes are tabulated [default: the last one]."
)
@click.option(
    "--at", "angles", type=float, multiple=True, metavar="DEG", help="Pose to derive modes at; repeatable."
)
@click.option(
    "--f06",
    type=(float, EXISTING_FILE),
    multiple=True,
    metavar="DEG FILE",
    help="Nastran results of a pose; repeatable.",
)
@click.option("--interface", type=int, help="Grid point of the interface, at T's origin.")
@click.option(
    "--ground", type=int, multiple=True, help="Constrained grid point at the same place; repeatable."
)
@click.option("--damping", type=click.FloatRange(0.0, 1.0, True, True), default=0.01, show_default=True)
def modal(
    campaign: str,
    file: Path,
    joint: str | None,
    angles: tuple[float, ...],
    f06: tuple[tuple[float, Path], ...],
    interface: int | None,
    ground: tuple[int, ...],
    damping: float,
) -> None:
    """Write a modal FILE for CAMPAIGN: derived from its plant, or read from Nastran's f06 files.

    [model] modal in campaign.toml names the file; the report then sends the rigid-base wrench through these modes.
    """
    if bool(angles) == bool(f06):
        raise click.UsageError("Give --at for modes of the plant, or --f06 for modes of Nastran.")
    if f06 and (interface is None or not ground):
        raise click.UsageError("With --f06, give --interface and --ground.")
    from kbs_process.campaign.load import load_campaign
    from kbs_process.campaign.locate import find_campaign

    loaded = load_campaign(find_campaign(campaign), checksums=False)
    from kbs_process.campaign.modal import derive_modes, import_modes

    if interface is not None and f06:
        table = import_modes(loaded, joint, f06, file, interface=interface, ground=ground, damping=damping)
    else:
        table = derive_modes(loaded, joint, angles, file)
    for model in table.models:
        frequencies = ", ".join(f"{frequency:.2f}" for frequency in sorted(model.frequency))
        click.echo(f"{table.joint} {math.degrees(model.angle):.1f} deg: {frequencies} Hz")
    click.echo(f"Modes: {file}")


@cli.command(
    epilog=examples("identify campaign/DUMMY1", "identify campaign/DUMMY1 --starts 3 --run-to-run 0.01")
)
@campaign_argument
@click.option(
    "--starts",
    type=click.IntRange(min=1),
    default=2,
    show_default=True,
    help="Starting points that are followed.",
)
@click.option(
    "--run-to-run",
    type=click.FloatRange(min=0.0, min_open=True),
    default=0.02,
    show_default=True,
    metavar="SHARE",
    help="By how much a friction torque differs from run to run, one sigma, of itself.",
)
@output_option
@pdf_option
@quiet_option
def identify(
    campaign: str, starts: int, run_to_run: float, output: Path | None, pdf: bool | None, quiet: bool
) -> None:
    """Identify the motor-gears of CAMPAIGN from its recordings with the role "fit".

    Writes corrected parameter files (identified/parameters), and a report with intervals, checks, correlations and the
    prediction of held-out recordings before and after.
    """
    from kbs_process.campaign.load import load_campaign
    from kbs_process.campaign.locate import find_campaign, results_folder

    folder = find_campaign(campaign)
    target = results_folder(folder, output, suffix="-identify")
    loaded = load_campaign(folder)
    from kbs_process.campaign.identify import identify as run
    from kbs_process.stages.identification import Settings

    settings = Settings(starts=starts, run_to_run=run_to_run)
    outcome = run(loaded, target, settings=settings, progress=_progress(quiet), pdf=pdf)
    for line in outcome.verdict_lines:
        click.echo(line)
    click.echo(f"Report: {outcome.report}")


@cli.command(epilog=examples("diagnose campaign/EL089", "diagnose campaign/EL089 -o /data/why --no-pdf"))
@campaign_argument
@output_option
@pdf_option
@quiet_option
def diagnose(campaign: str, output: Path | None, pdf: bool | None, quiet: bool) -> None:
    """Find out why recordings of CAMPAIGN differ from their prediction.

    Detects what exceeds the repeatability floor, refits the known parameters within their uncertainties, locates what
    they leave, names its physics or measures its law, and tries it on recordings that were held out. Writes a
    corrected model (corrected/) beside the report. Experimental: how often it is right is not measured yet.
    """
    from kbs_process.campaign.load import load_campaign
    from kbs_process.campaign.locate import find_campaign, results_folder

    folder = find_campaign(campaign)
    target = results_folder(folder, output, suffix="-diagnosis")
    loaded = load_campaign(folder)
    from kbs_process.campaign.diagnose import diagnose as run

    outcome = run(loaded, target, progress=_progress(quiet), pdf=pdf)
    for line in outcome.verdict_lines:
        click.echo(line)
    click.echo(f"Report: {outcome.report}")


@cli.command(epilog=examples("report reports/EL089", "report reports/EL089 --no-pdf"))
@click.argument("results", type=click.Path(path_type=Path))
@pdf_option
def report(results: Path, pdf: bool | None) -> None:
    """Render the report again from stored RESULTS, computing nothing."""
    from kbs_process.campaign.store import revising
    from kbs_process.report.build import build

    with revising(results, without=("index.html", "report.pdf")) as folder:
        page = build(folder, pdf)
        stale = (results / "report.pdf").is_file() and not (folder / "report.pdf").is_file()
    if stale:
        click.echo(f"{results / 'report.pdf'} showed the report of before, and is gone: --pdf makes it again")
    click.echo(f"Report: {results / page.name}")


@cli.command(
    epilog=examples("prove", "prove --full --jobs 8", "prove --full --dask tcp://10.0.0.5:8786")
    + "\n\nFrom a checkout; an interrupted bench goes on where it stopped. Exit status 1: a find in a trial without "
    "a concealed effect."
)
@click.option(
    "--full", is_flag=True, help="All validation trials and all rivals: hours, to reports/proof/full."
)
@click.option("--trials", type=click.IntRange(1), metavar="N", help="How many [default: 6; 200 with --full].")
@click.option(
    "--work", type=FOLDER, metavar="FOLDER", help="Where trials and answers are kept [default: .proof]."
)
@click.option(
    "--output", "-o", type=FOLDER, metavar="FOLDER", help="Where the score goes [default: reports/proof]."
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
    from kbs_process.campaign.prove import run_bench

    given = {"trials": trials, "work": work, "output": output, "jobs": jobs, "dask": dask}
    options = [f"--{name}={value}" for name, value in given.items() if value is not None]
    sys.exit(run_bench([*(["--full"] if full else []), *options]))


@cli.command(
    "import",
    epilog=examples(
        "import --describe bench.tdms > mapping.toml", "import mapping.toml /data/bench campaigns/BENCH"
    ),
)
@click.argument("mapping", required=False)
@click.argument("source", required=False, type=click.Path(path_type=Path, exists=True))
@click.argument("campaign", required=False, type=FOLDER)
@click.option(
    "--describe",
    "file",
    type=EXISTING_FILE,
    metavar="FILE",
    help="Print the beginning of a mapping for FILE.",
)
@quiet_option
def import_(
    mapping: str | None, source: Path | None, campaign: Path | None, file: Path | None, quiet: bool
) -> None:
    """Convert CSV, Parquet, HDF5, TDMS or MDF4 files in SOURCE into a new folder CAMPAIGN.

    MAPPING is a TOML file that says which columns are which channels, or the name of a preset.
    """
    from kbs_process.campaign import importers

    if file is not None:
        click.echo(importers.describe(file), nl=False)
        return
    if mapping is None or source is None or campaign is None:
        raise click.UsageError(
            f"Give MAPPING, SOURCE and CAMPAIGN, or --describe FILE. Presets: {', '.join(importers.preset_names())}"
        )
    notice = functools.partial(click.echo, err=True)
    made = importers.import_recordings(mapping, source, campaign, progress=_progress(quiet), notice=notice)
    click.echo(f"Campaign: {made}")


def _progress(quiet: bool) -> Progress:
    from kbs_process.campaign.progress import SilentProgress, progress_for_terminal

    return SilentProgress() if quiet else progress_for_terminal()


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and exit."""
    # One thread, whatever the user's shell says: sums in one order give the same bits, and small matrices are no faster
    # with two.
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    words = list(sys.argv[1:] if arguments is None else arguments)
    debug = "--debug" in words
    try:
        with interruption.heeded():
            cli.main(
                [word for word in words if word != "--debug"], prog_name="kbs-process", standalone_mode=False
            )
    except click.ClickException as error:
        error.show()
        sys.exit(error.exit_code)
    except click.Abort:
        _complain("interrupted: nothing was written, and earlier results are untouched")
        sys.exit(INTERRUPTED)
    except KbsError as error:
        if debug:
            raise
        _complain(f"error: {error}")
        sys.exit(error.exit_status)
    except Exception as error:  # the last one to speak: a user gets words, not a traceback
        if debug:
            raise
        _complain(
            f"error: {type(error).__name__}: {error}\n"
            "  -> this is a fault of kbs-process: please report it with what the same command prints with --debug"
        )
        sys.exit(INTERNAL)


def _complain(message: str) -> None:
    click.echo(message, err=True)
