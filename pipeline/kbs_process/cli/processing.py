"""Process a campaign, check it beforehand, and show its report again afterwards."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

import click

from kbs_process.cli.shared import (
    BAD_INPUT,
    INTERRUPTED,
    NOT_MET,
    campaign_argument,
    check_option,
    complain,
    conclude,
    examples,
    json_option,
    output_option,
    pdf_option,
    progress,
    quiet_option,
    say,
    say_json,
    scheduler_option,
)
from kbs_process.errors import ConfigError, FitError, RecordingError, SimulationError

if TYPE_CHECKING:
    from kbs_process.campaign.config import Campaign
    from kbs_process.progress import Progress


@click.command(
    epilog=examples(
        "campaign/EL089",
        "process campaign/EL089 --check --output /data/EL089",
        "campaign/EL089 campaign/EL089_FM --no-diagnose",
    )
)
@click.argument("campaigns", metavar="CAMPAIGN...", nargs=-1, required=True)
@output_option("results/NAME")
@pdf_option
@check_option("a requirement is not met, or undecided, or a recording has losses")
@click.option(
    "--diagnose/--no-diagnose",
    "why",
    default=None,
    help="Find out why, where recordings differ from the prediction by more than repeats do: takes minutes, after the "
    "report is written [default: if the recordings allow it].",
)
@scheduler_option
@quiet_option
def process(
    campaigns: tuple[str, ...],
    output: Path | None,
    pdf: bool | None,
    check: bool,
    why: bool | None,
    scheduler: str | None,
    quiet: bool,
) -> None:
    """Process each CAMPAIGN: fit, compare with the prediction, and write the report.

    Where the two differ by more than repeats of one trajectory do, a diagnosis follows. One of the same inputs that
    is in the results already stays until a new one replaces it.

    Several campaigns are processed side by side, by the cores of this machine or by a cluster that sees the same files.
    With --output, the results of each are in a folder of its name below that. The exit status is the highest of all.
    """
    if len(campaigns) > 1 or scheduler is not None:
        switches = {"--pdf": pdf, "--no-pdf": pdf is False, "--check": check, "--diagnose": why}
        given = [name for name, wanted in {**switches, "--no-diagnose": why is False}.items() if wanted]
        sys.exit(_each_of(campaigns, output, given, scheduler))
    (campaign,) = campaigns
    from kbs_process.campaign.load import load_campaign
    from kbs_process.campaign.locate import find_campaign, results_folder
    from kbs_process.studies.correlate.earlier_diagnosis import earlier_diagnosis

    folder = find_campaign(campaign)
    target = results_folder(folder, output)
    loaded = load_campaign(folder)
    before = earlier_diagnosis(loaded, target)
    if before is not None and before.outdated:
        complain(*before.warning)  # now, as long as it is there
    # Bad input is told before all that computes is imported.
    from kbs_process.studies.correlate.run import process as run

    outcome = run(loaded, target, progress=progress(quiet), pdf=pdf)
    try:
        conclude(outcome)
        if why is False and before is not None and not before.outdated:
            say(f"Diagnosis, of the same inputs, kept from before: {before.folder}")
        if why is not False:
            _diagnose(loaded, target, progress=progress(quiet), pdf=pdf, wanted=why is True)
    except KeyboardInterrupt:
        complain("interrupted: the report is written, a new diagnosis is not")
        sys.exit(INTERRUPTED)
    if check and outcome.failed:
        sys.exit(NOT_MET)


def _each_of(campaigns: tuple[str, ...], output: Path | None, given: list[str], scheduler: str | None) -> int:
    """Process campaigns by workers; tell what each says when it is done, and return the highest status."""
    from kbs_process.campaign.locate import find_campaign, results_folder
    from kbs_process.results.parallel import each, run, workers

    folders = {find_campaign(name).absolute(): name for name in campaigns}
    if len({folder.name for folder in folders}) < len(campaigns):
        raise click.UsageError("Two campaigns have the same name, so that one's results would replace the other's.")
    commands = {}
    for folder, name in folders.items():
        target = results_folder(folder, None if output is None else output / folder.name).absolute()
        commands["process", str(folder), "--quiet", *given, "--output", str(target)] = name
    worst = 0
    with workers(scheduler=scheduler) as pool:
        for command, (status, said, complaint) in each(pool, run, commands):
            say(f"{commands[command]}:", *said.splitlines())
            complain(*complaint.splitlines())
            worst = max(worst, status)
    return worst


def _diagnose(campaign: Campaign, results: Path, *, progress: Progress, pdf: bool | None, wanted: bool) -> None:
    """Diagnose what was processed; recordings that allow no diagnosis are an error only if one is wanted."""
    from kbs_process.studies.diagnose.diagnosing import diagnose_results
    from kbs_process.studies.documents import render

    try:
        for line in diagnose_results(campaign, results, render=render, progress=progress, pdf=pdf):
            say(line)
    except (ConfigError, RecordingError, FitError, SimulationError) as error:
        if wanted:
            raise
        say(*f"Not diagnosed: {error}".split("\n"))
    except Exception:
        complain("the report is written, but the diagnosis failed")
        raise


@click.command(epilog=examples("validate campaign/EL089", "validate campaign/EL089 --check"))
@campaign_argument
@check_option("a recording has losses, or the model of the rig is wrong")
@json_option
@quiet_option
def validate(campaign: str, check: bool, as_json: bool, quiet: bool) -> None:
    """Check CAMPAIGN's description, read all its recordings through, and fit gravity to them. Plan its mission, if any.

    Of what `init` began, list what is still to be put in.
    Exits with 0 if all is well or can be processed, with 2 if something cannot be read, or processing would refuse it.
    """
    from kbs_process.campaign.load import load_campaign
    from kbs_process.campaign.locate import find_campaign
    from kbs_process.studies.convert.begin import MAPPING_FILE, check_description
    from kbs_process.studies.validate.run import describe
    from kbs_process.studies.validate.run import validate as run

    folder = find_campaign(campaign)
    if (folder / MAPPING_FILE).is_file():
        say_json([*check_description(folder)]) if as_json else say(*check_description(folder))
        return
    loaded = load_campaign(folder, mission_alone=True)
    found = run(loaded, progress(quiet))
    if as_json:
        say_json(found)
    else:
        say(*describe(loaded, found))
    if found.refused:
        sys.exit(BAD_INPUT)
    if check and (
        any(one.severity != "info" for one in found.notices) or any(finding.lossy for finding in found.findings)
    ):
        sys.exit(NOT_MET)


@click.command(epilog=examples("report results/EL089", "report results/EL089 --no-pdf"))
@click.argument("results", type=click.Path(path_type=Path))
@pdf_option
def report(results: Path, pdf: bool | None) -> None:
    """Render the report again from stored RESULTS, computing nothing."""
    from kbs_process.results.store import revising
    from kbs_process.studies.documents import render

    with revising(results, without=("index.html", "report.pdf")) as folder:
        page = render(folder, pdf)
        stale = (results / "report.pdf").is_file() and not (folder / "report.pdf").is_file()
    if stale:
        say(f"{results / 'report.pdf'} showed the report of before, and is gone: --pdf makes it again")
    say(f"Report: {results / page.name}")


@click.command(epilog=examples("compare results/EL089 results/EL089_FM", "compare results", "compare archive/2026-*"))
@click.argument("results", nargs=-1, required=True, type=click.Path(path_type=Path))
@output_option("results/comparison")
@pdf_option
def compare(results: tuple[Path, ...], output: Path | None, pdf: bool | None) -> None:
    """Compare RESULTS of several campaigns, tests or versions of a model: requirements, fitted numbers, spectra.

    Of a folder without results, all results of processing below it are taken: an index of an archive. They are shown in
    the order of their tests' dates, as trends. tables/requirements.parquet and tables/numbers.parquet hold them, too.
    """
    from kbs_process.studies.compare.run import compare as run
    from kbs_process.studies.compare.run import find

    folders = find(results)
    if len(folders) < 2:
        raise click.UsageError("Give at least two folders of results, or one that holds them.")
    conclude(run(folders, output or Path("results/comparison"), pdf))
