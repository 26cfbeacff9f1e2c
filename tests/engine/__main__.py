"""Make archived campaigns again: `python -m engine NAME...|all`, run from tests/."""

from __future__ import annotations

import argparse
import os
from concurrent.futures import ProcessPoolExecutor

from engine.archive import archive, finish
from engine.campaigns import CAMPAIGNS


def main() -> None:
    """Make every run of the campaigns asked for, in two processes at low priority."""
    parser = argparse.ArgumentParser(prog="python -m engine", description=__doc__)
    parser.add_argument("campaign", nargs="+", choices=[*CAMPAIGNS, "all"])
    asked = parser.parse_args().campaign
    names = list(CAMPAIGNS) if "all" in asked else asked
    with ProcessPoolExecutor(2, initializer=os.nice, initargs=(10,)) as pool:
        jobs = {name: [pool.submit(archive, name, k) for k in range(len(CAMPAIGNS[name].runs))] for name in names}
        for name, runs in jobs.items():
            finish(CAMPAIGNS[name], [run.result() for run in runs])
            print(f"{name}: {len(runs)} recordings", flush=True)


if __name__ == "__main__":
    main()
