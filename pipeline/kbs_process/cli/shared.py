"""What the verbs share: how they load, run, print and end, their arguments and options, and how they speak."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from kbs_process.terminal import printable

if TYPE_CHECKING:
    from kbs_process.progress import Progress
    from kbs_process.results.outcome import Outcome

_Verb = TypeVar("_Verb", bound=Callable[..., Any])
_Option = Callable[[Callable[..., Any]], Callable[..., Any]]

NOT_MET, BAD_INPUT, INTERNAL, INTERRUPTED = 1, 2, 70, 130

EXISTING_FILE = click.Path(path_type=Path, exists=True, dir_okay=False)
FOLDER = click.Path(path_type=Path, file_okay=False)

campaign_argument = click.argument("campaign")
quiet_option = click.option("--quiet", "-q", is_flag=True, help="No progress.")
json_option = click.option("--json", "as_json", is_flag=True, help="Print JSON, for programs.")
pdf_option = click.option(
    "--pdf/--no-pdf", default=None, help="A report.pdf beside the page [default: if WeasyPrint is installed]."
)
scheduler_option = click.option(
    "--scheduler",
    metavar="ADDRESS",
    help="Run on a Dask cluster that is there: its scheduler, tcp://HOST:PORT [default: the cores of this machine].",
)


def output_option(default: str) -> Callable[[_Verb], _Verb]:
    """Return the option that says where results go instead of `default`."""
    return click.option(
        "--output",
        "-o",
        type=FOLDER,
        metavar="FOLDER",
        help=f"Where results go: a folder that is replaced whole [default: {default}].",
    )


def check_option(when: str) -> Callable[[_Verb], _Verb]:
    """Return the option that makes an exit status of what was found."""
    return click.option("--check", is_flag=True, help=f"Exit with 1 when {when}.")


def commanded_by(table: str) -> tuple[_Option, _Option]:
    """Return the options of a verb that is driven by commands, those of a recording or those of a `table`."""

    def alone(context: click.Context, parameter: click.Parameter, value: Any) -> Any:
        (other,) = {"trajectory", "command"} - {parameter.name}
        if value is not None and context.params.get(other) is not None:
            raise click.UsageError("Give --trajectory or --command, not both.", context)
        return value

    return (
        click.option(
            "--trajectory",
            metavar="NAME",
            callback=alone,
            help="Commands of the first recording of this trajectory [default, without --command: the last one "
            "listed].",
        ),
        click.option("--command", type=EXISTING_FILE, callback=alone, help=table),
    )


def examples(*lines: str) -> str:
    """Return an epilog that click prints as it is."""
    return "\b\nExamples:\n" + "\n".join(f"  kbs-process {line}" for line in lines)


def progress(quiet: bool) -> Progress:
    """Return what tells a terminal how far a verb has come, or nothing."""
    from kbs_process.progress import SilentProgress, progress_for_terminal

    return SilentProgress() if quiet else progress_for_terminal()


def say(*lines: str) -> None:
    """Print lines."""
    for line in lines:
        click.echo(printable(line))


def say_json(found: object) -> None:
    """Print what was found for a program: one JSON document, in which what is no number is null."""
    import msgspec

    click.echo(
        msgspec.json.format(
            msgspec.json.encode(found, enc_hook=lambda one: one.item() if hasattr(one, "item") else str(one))
        )
    )


def complain(*lines: str) -> None:
    """Say what went wrong, beside the output."""
    for line in lines:
        click.echo(printable(line), err=True)


def verb(
    *options: _Option,
    example: Iterable[str],
    campaign: str | None = None,
    output: str | None = None,
    pdf: bool = False,
    check: str | None = None,
    **loading: bool,
) -> Callable[[Callable[..., Outcome | Iterable[str]]], click.Command]:
    """Return what makes a command of a study: it finds and loads the campaign, runs, prints, and sets the exit status.

    The function is given the campaign, and by name `progress`, the folder of its results (`target`) where there is an
    `output` (its default, results/NAME...), and every option; it returns an outcome, or lines to be printed. Its
    docstring is the help. `campaign` is that argument's default, `pdf` offers a report.pdf, `check` says when --check
    makes a status of the outcome, `loading` is handed to `load_campaign`. The function imports what computes: bad input
    is told before that.
    """
    given = campaign_argument if campaign is None else click.argument("campaign", default=campaign)
    shared: list[_Option] = [
        given,
        *options,
        *([] if output is None else [output_option(output)]),
        *([pdf_option] if pdf else []),
        *([] if check is None else [check_option(check)]),
        quiet_option,
    ]

    def decorate(study: Callable[..., Outcome | Iterable[str]]) -> click.Command:
        @wraps(study)
        def run(campaign: str, quiet: bool, check: bool = False, **given: Any) -> None:
            from kbs_process.campaign.load import load_campaign
            from kbs_process.campaign.locate import find_campaign, results_folder

            folder = find_campaign(campaign)
            if output is not None:
                suffix = output.removeprefix("results/NAME")
                given["target"] = results_folder(folder, given.pop("output"), suffix=suffix)
            # Where commands come from a table, no recording need be there.
            loaded = load_campaign(folder, **{"recordings": given.get("command") is None, **loading})
            conclude(study(loaded, progress=progress(quiet), **given), check=check)

        command: Callable[..., Any] = run
        for option in reversed(shared):
            command = option(command)
        return click.command(study.__name__.replace("_", "-"), epilog=examples(*example))(command)

    return decorate


def conclude(outcome: Outcome | Iterable[str], *, check: bool = False) -> None:
    """Print what a study tells, and end with the status of what failed if `check` asks for it."""
    from kbs_process.results.outcome import Outcome

    say(*(outcome.lines if isinstance(outcome, Outcome) else outcome))
    if check and isinstance(outcome, Outcome) and outcome.failed:
        sys.exit(NOT_MET)
