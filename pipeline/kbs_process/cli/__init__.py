"""The command line. Thin: it parses, calls, prints, and turns errors into messages and exit statuses.

Nothing that computes is imported at the top of any of its files, so that `--help` answers at once.
"""

from __future__ import annotations

import errno
import io
import os
import sys
from collections.abc import Sequence
from pathlib import Path

import click

from kbs_process import interruption
from kbs_process.cli.group import cli
from kbs_process.cli.shared import BAD_INPUT, INTERNAL, INTERRUPTED, NOT_MET, complain
from kbs_process.errors import KbsError
from kbs_process.terminal import printable

__all__ = ["BAD_INPUT", "INTERNAL", "INTERRUPTED", "NOT_MET", "cli", "main"]


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and exit."""
    # One thread, whatever the user's shell says: sums in one order give the same bits, and small matrices are no faster
    # with two.
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    if arguments is None and sys.getfilesystemencoding() != "utf-8":  # some libraries would know no name with an umlaut
        again = [sys.executable, "-P", "-X", "utf8", "-m", "kbs_process", *sys.argv[1:]]
        os.execv(sys.executable, again)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # a terminal that lacks a letter gets its number
            stream.reconfigure(errors="backslashreplace")
    words = list(sys.argv[1:] if arguments is None else arguments)
    debug = "--debug" in words
    for word in (*words, os.environ.get("PWD", "")):
        if any("\ud800" <= letter <= "\udfff" for letter in word):  # bytes that are no UTF-8
            complain(f"error: '{word}' is no name in UTF-8", "  -> rename the file or folder")
            sys.exit(BAD_INPUT)
    try:
        Path.cwd()
    except FileNotFoundError:
        complain("error: the folder that this terminal is in was removed", "  -> change to another one: cd")
        sys.exit(BAD_INPUT)
    try:
        with interruption.heeded():
            cli.main([word for word in words if word != "--debug"], prog_name="kbs-process", standalone_mode=False)
    except click.ClickException as error:
        error.message = printable(error.message)  # type: ignore[misc]
        error.show()
        sys.exit(error.exit_code)
    except click.Abort:
        complain("interrupted: nothing was written, and earlier results are untouched")
        sys.exit(INTERRUPTED)
    except KbsError as error:
        if debug:
            raise
        complain(*f"error: {error}".split("\n"))
        sys.exit(error.exit_status)
    except Exception as error:  # the last one to speak: a user gets words, not a traceback
        if debug:
            raise
        if isinstance(error, OSError) and error.errno == errno.ENOSPC:  # of standard output
            complain("error: what is printed cannot be written: no space is left", "  -> make room where it goes")
            sys.exit(BAD_INPUT)
        complain(
            f"error: {type(error).__name__}: {error}",
            "  -> this is a fault of kbs-process: please report it with what the same command prints with --debug",
        )
        sys.exit(INTERNAL)
