"""How often intervals of a motion-driven rig's numbers hold the truth, and how narrow they are.

    cd tests && python -m benchmarks.turned_mass [SEEDS]

A mass of 5 kg beside the axes of two joints (wrench at 1 kHz, encoders at 200 Hz with steps of 0.0005 degrees), drawn
and recorded for a minute by each seed, at working rates of 160, 40 and 10 Hz, and eight times as slow. Printed are for
each: the share of the intervals of 95 % that hold the mass, CoG and inertia, their median sigmas, and processor time a
seed.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path

import numpy as np

from stages.gravity.test_turned_mass import drawn, errors


def main() -> None:
    """Print a line a working rate."""
    parser = argparse.ArgumentParser()
    parser.add_argument("seeds", nargs="?", type=int, default=20)
    seeds = range(parser.parse_args().seeds)
    print("rate/Hz  slower  held   mass    CoG     inertia  s a seed")
    for rate, slow in ((160.0, 1.0), (160.0, 8.0), (40.0, 1.0), (10.0, 1.0)):
        begun = time.process_time()
        with tempfile.TemporaryDirectory() as folder:
            found = [drawn(Path(folder), rate, seed, slow) for seed in seeds]
        held = np.mean([np.abs(errors(rig, model)) < 1.96 for rig, model in found])
        sigma = np.median([model.fit.sigma[:7] for _, model in found], axis=0)
        value = np.median([model.fit.value[:7] for _, model in found], axis=0)
        mass, inertia = sigma[0] / value[0], (sigma[4:] / value[4:]).max()
        spent = (time.process_time() - begun) / len(seeds)
        print(
            f"{rate:7g}  {slow:6g}  {held:4.0%}  {mass:6.2%}  {1e3 * sigma[1:4].max():4.2f} mm  {inertia:6.1%}  "
            f"{spent:8.1f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
