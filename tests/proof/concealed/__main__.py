"""Make concealed campaigns, from tests/: `python -m proof.concealed --seed S --set dev --count N --out FOLDER`."""

from __future__ import annotations

import argparse
import multiprocessing
import os
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

from proof.concealed import trials
from proof.concealed.ranges import Split
from proof.concealed.trials import Spec, UnreachableError

_SPLITS: dict[str, Split] = {"dev": "development", "validation": "validation"}


def main(arguments: Sequence[str] | None = None) -> None:
    """Make trials in processes of low priority."""
    parser = argparse.ArgumentParser(prog="python -m proof.concealed", description=__doc__)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--set", choices=_SPLITS, required=True)
    parser.add_argument("--count", type=int, default=1)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--truth", type=Path, help="folder for what is concealed; default: OUT-truth")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--only", action="append", help="conceal this physics alone; repeated: these together")
    parser.add_argument("--null", choices=("nothing", "within", "beyond"), help="conceal nothing")
    parser.add_argument("--level", type=float, default=300.0, help="with --only: rho_eff of each")
    parser.add_argument("--first", type=int, default=0, help="number of the first trial")
    asked = parser.parse_args(arguments)
    split, numbers = _SPLITS[asked.set], range(asked.first, asked.first + asked.count)
    if asked.only:
        specs = [trials.chosen(split, asked.seed, k, asked.only, asked.level) for k in numbers]
    elif asked.null:
        specs = [Spec(split, asked.seed, k, asked.null) for k in numbers]
    else:
        specs = trials.draw(split, asked.first + asked.count, asked.seed)[asked.first :]
    truth = asked.truth or asked.out.with_name(f"{asked.out.name}-truth")
    truth.mkdir(parents=True, exist_ok=True)
    spawn = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(asked.jobs, mp_context=spawn, initializer=os.nice, initargs=(10,)) as pool:
        jobs = [pool.submit(trials.make_named, spec, asked.out, truth) for spec in specs]
        failed = 0
        for spec, job in zip(specs, jobs, strict=True):
            try:
                made = job.result()
            except UnreachableError as error:
                failed += 1
                print(f"trial {spec.index}: {error}", flush=True)
            else:
                print(made["trial"], f"rho_eff {made['rho_eff']:.0f}", flush=True)
    if failed:
        raise SystemExit(f"{failed} of {len(specs)} trials could not be made")


if __name__ == "__main__":
    main()
