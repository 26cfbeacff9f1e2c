"""Make odd campaigns, from tests/: `python -m proof.odd --only 5 --out FOLDER`; all cases without --only."""

from __future__ import annotations

import argparse
import os
from collections.abc import Sequence
from pathlib import Path

from proof.odd.cases import BY_NUMBER
from proof.odd.maker import make_named


def main(arguments: Sequence[str] | None = None) -> None:
    """Make cases one after the other."""
    parser = argparse.ArgumentParser(prog="python -m proof.odd", description=__doc__)
    parser.add_argument("--only", nargs="+", choices=BY_NUMBER, metavar="CASE", default=list(BY_NUMBER))
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--truth", type=Path, help="folder for what is concealed; default: OUT-truth")
    asked = parser.parse_args(arguments)
    truths = asked.truth or asked.out.with_name(f"{asked.out.name}-truth")
    truths.mkdir(parents=True, exist_ok=True)
    for number in asked.only:
        case = BY_NUMBER[number]
        make_named(case, asked.out, truths)
        print(f"{case.name}: {case.number}, {case.title}", flush=True)


if __name__ == "__main__":
    os.nice(10)
    main()
