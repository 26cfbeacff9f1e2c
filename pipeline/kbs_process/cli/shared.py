"""What the verbs share: exit statuses, arguments and options, examples, and how they speak."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

if TYPE_CHECKING:
    from kbs_process.progress import Progress

_Verb = TypeVar("_Verb", bound=Callable[..., Any])

NOT_MET, BAD_INPUT, INTERNAL, INTERRUPTED = 1, 2, 70, 130

EXISTING_FILE = click.Path(path_type=Path, exists=True, dir_okay=False)
FOLDER = click.Path(path_type=Path, file_okay=False)

campaign_argument = click.argument("campaign")
quiet_option = click.option("--quiet", "-q", is_flag=True, help="No progress.")
pdf_option = click.option(
    "--pdf/--no-pdf", default=None, help="A report.pdf beside the page [default: if WeasyPrint is installed]."
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


def examples(*lines: str) -> str:
    """Return an epilog that click prints as it is."""
    return "\b\nExamples:\n" + "\n".join(f"  kbs-process {line}" for line in lines)


def progress(quiet: bool) -> Progress:
    """Return what tells a terminal how far a verb has come, or nothing."""
    from kbs_process.progress import SilentProgress, progress_for_terminal

    return SilentProgress() if quiet else progress_for_terminal()


def complain(message: str) -> None:
    """Say what went wrong, beside the output."""
    click.echo(message, err=True)
