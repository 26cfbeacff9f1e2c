"""What processing costs as recordings get longer: processor time and peak memory of `kbs-process`.

    cd tests && python -m benchmarks.length [MINUTES...] [--band HZ] [--profile]

Each campaign is an arm of two joints on a transducer, driven by its motion: one recording of that many minutes, six
channels of a wrench and two encoders, all at 1 kHz. It is written first, and is not counted. Printed is for each: wall
time, processor time, peak memory, and their ratios to the campaign before it: what is linear in time and flat in memory
has ratios of the lengths and of 1.
"""

from __future__ import annotations

import argparse
import cProfile
import multiprocessing
import os
import pstats
import resource
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from kbs_process.campaign.load import load_campaign
from kbs_process.plant.rigid import loads
from kbs_process.progress import SilentProgress
from kbs_process.recordings.mcap.messages.encoding import OutStream
from kbs_process.recordings.mcap.writer import write_pieces
from kbs_process.rig.model import Rig
from kbs_process.studies.correlate.run import process
from reduction.arm import CAMPAIGN, RIG
from stages.gravity.synthetic import perturbed

RATE, PIECE_S = 1000, 30
STEP = 2e-6  # rad, of an encoder
ONE = CAMPAIGN.partition("[[recording]]")[0] + '[[recording]]\nfile = "long.mcap"\ntrajectory = "long"\nrole = "fit"\n'
BASE = """
[joint.base]
parent = "T"
axis = [0, 0, 1]
origin = { value = [0.0, 0.0, 0.1], unit = "m", sigma = 0.0005, source = "drawing" }
misalignment = { value = 0.0, unit = "mrad", sigma = 0.5, source = "alignment" }
[joint.base.encoder]
step = { value = 2e-6, unit = "rad", sigma = 0.0, source = "data sheet" }
offset = { value = 0.0, unit = "rad", sigma = 0.0, source = "set" }
"""


def described(folder: Path, band: float) -> Rig:
    """Write the description of a campaign that is judged up to `band` Hz; return its rig."""
    folder.mkdir(parents=True)
    text = ONE.replace("1.0]", f"{band}]").replace("20.0\n", f"{max(20.0, 8.0 * band)}\n")
    (folder / "campaign.toml").write_text(text, encoding="utf-8")
    (folder / "rig.toml").write_text(RIG.replace('parent = "T"', 'parent = "base"') + BASE, encoding="utf-8")
    (folder / "long.mcap").touch()
    return load_campaign(folder, checksums=False).rig


def pieces(rig: Rig, minutes: float) -> Iterator[OutStream]:
    """The recording, half a minute at a time: slow swings, a ripple of 0.3 Hz, noise."""
    rng = np.random.default_rng(15)
    bias = 0.5 * rig.transducer.bias.sigma * rng.standard_normal(6)
    for start in range(0, int(60 * minutes), PIECE_S):
        t = start + np.arange(PIECE_S * RATE) / RATE
        w, size = 2.0 * np.pi / np.array([37.0, 30.0]), np.array([0.8, 0.6])
        q = size * (1.0 - np.cos(np.outer(t, w)))
        moved = loads(rig, q, size * w * np.sin(np.outer(t, w)), size * w**2 * np.cos(np.outer(t, w)))[:, :6]
        moved[:, 4] += 0.01 * np.sin(2.0 * np.pi * 0.3 * t)
        wrench = moved + bias + np.repeat([0.02, 0.002], 3) * rng.standard_normal(moved.shape)
        stamp = np.round(1e9 * t).astype(np.int64)
        yield OutStream("/transducer/wrench", "wrench", stamp, stamp, wrench)
        yield OutStream("/encoder", "joints", stamp, stamp, STEP * np.round(q / STEP), rig.joint_names)


def cost(folder: Path, profiled: bool) -> tuple[float, float, float]:
    """Process a campaign: wall time and processor time (s), peak memory (MB)."""
    profile, wall = cProfile.Profile(), time.perf_counter()
    before = sum(resource.getrusage(resource.RUSAGE_SELF)[:2])
    if profiled:
        profile.enable()
    process(load_campaign(folder, checksums=False), folder / "out", progress=SilentProgress(), pdf=False)
    if profiled:
        profile.disable()
        pstats.Stats(profile).sort_stats("cumulative").print_stats(60)
    used = resource.getrusage(resource.RUSAGE_SELF)
    return time.perf_counter() - wall, used.ru_utime + used.ru_stime - before, used.ru_maxrss / 1e3


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.length", description=__doc__)
    parser.add_argument("minutes", nargs="*", type=float, default=[15.0, 30.0, 60.0])
    parser.add_argument("--band", type=float, default=1.0, help="upper edge, Hz; an eighth of the working rate")
    parser.add_argument("--profile", action="store_true")
    arguments = parser.parse_args()
    os.environ["KBS_CACHE_MB"] = "0"  # what is computed is counted
    print("minutes  wall s   CPU s  peak MB     CPU x  memory x")
    before: tuple[float, ...] = (np.nan,) * 3
    own = multiprocessing.get_context("spawn").Pool(1, maxtasksperchild=1)
    with tempfile.TemporaryDirectory() as root, own as pool:
        for minutes in arguments.minutes:
            folder = Path(root) / f"{minutes:g}"
            rig = perturbed(described(folder, arguments.band), np.random.default_rng(1), names=(".mass", ".cog"))
            write_pieces(folder / "long.mcap", pieces(rig, minutes))
            found = pool.apply(cost, (folder, arguments.profile))
            wall, used, peak = found
            print(
                f"{minutes:7g}{wall:8.1f}{used:8.1f}{peak:9.0f}{used / before[1]:10.2f}{peak / before[2]:10.2f}",
                flush=True,
            )
            before = found


if __name__ == "__main__":
    main()
