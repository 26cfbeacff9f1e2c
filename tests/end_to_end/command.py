"""The command line as a user calls it: what it prints, and its exit status."""

from __future__ import annotations

import sys
from dataclasses import dataclass

import pytest

from kbs_process import cli


@dataclass(frozen=True, slots=True)
class Ended:
    """How a command ended."""

    status: int
    out: str
    err: str


def kbs_process(capsys: pytest.CaptureFixture[str], *arguments: object) -> Ended:
    """Run the command line in this process."""
    capsys.readouterr()
    with pytest.raises(SystemExit) as caught:
        cli.main([str(argument) for argument in arguments])
        sys.exit(0)
    printed = capsys.readouterr()
    return Ended(int(caught.value.code or 0), printed.out, printed.err)
