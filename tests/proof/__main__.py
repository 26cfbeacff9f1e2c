"""The proof bench: `python -m proof`, run from tests/, or `kbs-process prove` from a checkout."""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path
from time import monotonic

from kbs_process.errors import ConfigError
from kbs_process.results.parallel import workers
from proof.prove import finish, isolation, judge
from proof.score import Row
from proof.seal import SealError
from proof.words import METHODS, OURS
from proof.work import BenchError, Work

CHECKOUT = Path(__file__).resolve().parents[2]
SMALL, FULL = 6, 20


def parser() -> argparse.ArgumentParser:
    """The command's options."""
    options = argparse.ArgumentParser(prog="python -m proof", description=__doc__)
    options.add_argument("--full", action="store_true", help=f"a set of {FULL} validation trials, and all rivals")
    options.add_argument("--trials", type=int, metavar="N", help=f"how many [default: {SMALL}]")
    options.add_argument("--split", choices=("development", "validation"), help="[default: development]")
    options.add_argument("--seed", type=int, help="of the trials [default: secret until seals are broken]")
    options.add_argument(
        "--method", action="append", choices=METHODS, help="repeatable [default: ours; all with --full]"
    )
    options.add_argument("--work", type=Path, help="working folder; a bench begun there goes on")
    options.add_argument(
        "--output", "-o", type=Path, help="where score and page go [default: results/proof/small; full with --full]"
    )
    options.add_argument("--jobs", type=int, default=len(os.sched_getaffinity(0)), help="processes")
    options.add_argument(
        "--answered",
        action="store_true",
        help="do no more: score the trials before the first one, by name, without an answer; the others are lost",
    )
    options.add_argument("--scheduler", metavar="ADDRESS", help="scheduler of a Dask cluster, tcp://HOST:PORT")
    return options


def main() -> int:
    """Run a bench; return 1 if `failed`, 2 if it could not be run."""
    asked = parser().parse_args()
    command = " ".join(["python -m proof", *sys.argv[1:]])
    split = asked.split or ("validation" if asked.full else "development")
    count = asked.trials or (FULL if asked.full else SMALL)
    methods = tuple(dict.fromkeys(asked.method or (METHODS if asked.full else (OURS,))))
    folder = asked.work or CHECKOUT / ".proof" / f"{split}-{count}"
    target = asked.output or CHECKOUT / "results" / "proof" / ("full" if asked.full else "small")
    begin = monotonic()

    def tell(line: str) -> None:
        print(f"{monotonic() - begin:7.1f} s  {line}", file=sys.stderr, flush=True)

    try:
        work = Work(folder, split, count, asked.seed, command)
        if not asked.answered:
            os.nice(5)
            with workers(asked.jobs, asked.scheduler) as pool:
                finish(work, methods, pool, isolated=isolation(asked.scheduler), tell=tell)
        rows = judge(work, methods, target, command=command, tell=tell)
    except (BenchError, SealError, ConfigError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    print("\n".join(table(rows)))
    print(f"Report: {target / 'index.html'}")
    return 1 if failed(rows) else 0


def failed(rows: tuple[Row, ...]) -> bool:
    """Whether we claimed a find where nothing is concealed, or left a trial without an answer."""
    ours = {row.metric: row for row in rows if row.method == OURS and row.group == "all"}
    answered, false = ours.get("answered"), ours.get("false find")
    return (answered is not None and answered.right != answered.of) or (false is not None and bool(false.right))


def table(rows: tuple[Row, ...]) -> list[str]:
    """The score over all trials, in lines."""
    lines = []
    for row in rows:
        if row.group == "all":
            value = "-" if row.value is None else f"{row.value:.3g}"
            count = f"{row.right}/{row.of}" if row.kind == "share" else f"n = {row.of}"
            interval = "" if row.low is None or row.high is None else f"[{row.low:.3g}, {row.high:.3g}]"
            lines.append(f"{row.method:18} {row.metric:44} {value:>8} {count:>9} {interval}")
    return lines


if __name__ == "__main__":
    sys.exit(main())
