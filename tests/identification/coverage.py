"""Do the identification's intervals hold the truth as often as they say? Run from tests/:

    python -m identification.coverage --seeds 40 [--processes 2] [--json FILE]

Each seed draws hardware from the priors of campaigns/DUMMY1 (every uncertain number, phases from the whole circle),
makes one recording of 66 s with the independent engine (its own equations, integrator, noise, clocks and codes),
condenses it as any recording is, and identifies it. What the engine lets friction differ by
from run to run is given to the identification as it is (rms 1.15 %), since the method is on trial here, not that
assumption. Printed are, for each gearbox parameter, the coverage of 95 % intervals with its own binomial interval, and
the rms error over the Cramer-Rao bound: the inverse of the information that data and priors hold, at the estimate.
"""

from __future__ import annotations

import argparse
import json
import os
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from scipy.stats import beta

from engine.campaigns import CAMPAIGNS_FOLDER
from engine.hardware import Hardware
from engine.sensors import FRICTION_SPREAD, Recording, Stream, record
from engine.trajectories import Axis, Commands, commands
from kbs_process.campaign.load import load_campaign
from kbs_process.campaign.measured import measured
from kbs_process.signals.records import Array, Block
from kbs_process.stages.condense import CondenseSettings, condense
from kbs_process.stages.identification import Identification, Settings, gearbox, identify, intervals
from kbs_process.stages.output_error import Experiment, residual
from kbs_process.stages.screening import Evaluate, Task

RUN_TO_RUN = FRICTION_SPREAD / np.sqrt(3.0)  # a uniform distribution's standard deviation


def sweep(start: float, peak: float) -> Axis:
    """Rates 0 to `peak`, to -`peak`, to 0 (deg/s) in 60 s."""
    a = abs(peak) / 15.0
    return Axis(start).rest(3.0).accelerate(peak, a).accelerate(-peak, a).accelerate(0.0, a)


def short_sweeps() -> Commands:
    return commands(sweep(-5.0, 0.9), sweep(55.0, -0.7), 66.0)


def make(seed: int, path: Commands) -> tuple[Hardware, Recording]:
    """Draw hardware and record one run with it."""
    hardware = Hardware.from_campaign(CAMPAIGNS_FOLDER / "DUMMY1", seed=seed)
    return hardware, record(hardware, path, seed=seed, epoch_ns=0, wrench_hz=100.0, encoder_hz=20.0)


def experiment(recording: Recording) -> Experiment:
    """What the pipeline knows of it: the campaign's description and the recorded streams."""
    campaign = load_campaign(CAMPAIGNS_FOLDER / "DUMMY1", checksums=False)
    rig = campaign.rig
    streams = {
        "wrench": recording.wrench,
        "angle": recording.encoder,
        "command": recording.command,
        "field": recording.field,
    }
    blocks = ((key, _block(stream)) for key, stream in streams.items())
    channels = campaign.topics.channels()
    run = condense("coverage", blocks, channels, CondenseSettings(working_rate_Hz=100.0))
    return Experiment(rig, campaign.effects, gearbox(rig, campaign.effects), (measured(run, rig),), 0.05)


def _block(stream: Stream) -> Block:
    return Block(stream.stamp, stream.log, stream.values)


def serial(experiment: Experiment) -> Evaluate:
    def evaluate(tasks: list[Task]) -> list[Array]:
        return [residual(experiment, experiment.recordings[r], values, noise) for r, values, noise in tasks]

    return evaluate  # type: ignore[return-value]


@contextmanager
def silent(what: str) -> Iterator[None]:
    yield


def true_values(hardware: Hardware, found: Identification) -> Array:
    """The drawn hardware's numbers in the order of the estimate."""
    return np.array([float(hardware[scalar.quantity][scalar.element]) for scalar in found.experiment.free])


def errors(found: Identification, truth: Array) -> Array:
    """Estimate less truth; phases within half a turn."""
    difference = found.values - truth
    turn = np.array([scalar.name.rpartition(".")[2].startswith("phi_") for scalar in found.experiment.free])
    return np.where(turn, (difference + np.pi) % (2.0 * np.pi) - np.pi, difference)


def trial(seed: int) -> list[dict[str, float | str | bool]]:
    """One seed: each gearbox parameter's error, sigma, and whether its intervals hold the truth."""
    hardware, recording = make(seed, short_sweeps())
    setting = experiment(recording)
    found = identify(setting, serial, Settings(run_to_run=RUN_TO_RUN, starts=1), silent)
    profiled = {profile.name: profile for profile in intervals(found, serial)}
    truth = true_values(hardware, found)
    wrong = errors(found, truth)
    rows: list[dict[str, float | str | bool]] = []
    for index, scalar in enumerate(setting.free):
        sigma = float(found.fit.sigma[index])
        row: dict[str, float | str | bool] = {
            "seed": seed,
            "name": scalar.name,
            "error": float(wrong[index]),
            "sigma": sigma,
            "covered": bool(abs(wrong[index]) <= 1.96 * sigma),
        }
        if scalar.name in profiled:
            at, ends = found.values[index] - wrong[index], profiled[scalar.name]
            row["profile covered"] = bool(ends.low <= at <= ends.high)
        rows.append(row)
    return rows


def binomial(hits: int, n: int) -> tuple[float, float]:
    """95 % Clopper-Pearson interval of a rate."""
    low = float(beta.ppf(0.025, hits, n - hits + 1)) if hits else 0.0
    high = float(beta.ppf(0.975, hits + 1, n - hits)) if hits < n else 1.0
    return low, high


def table(rows: list[dict[str, float | str | bool]]) -> Iterator[str]:
    names = list(dict.fromkeys(str(row["name"]) for row in rows))
    head = ("parameter", "n", "covered", "95 % of that", "profile", "error/bound", "bias/bound")
    yield "{:28s} {:>3s} {:>8s} {:>14s} {:>8s} {:>12s} {:>11s}".format(*head)
    for name in names:
        own = [row for row in rows if row["name"] == name]
        n, hits = len(own), sum(bool(row["covered"]) for row in own)
        low, high = binomial(hits, n)
        z = np.array([float(row["error"]) / float(row["sigma"]) for row in own])
        profile = [bool(row["profile covered"]) for row in own if "profile covered" in row]
        shown = f"{100 * np.mean(profile):6.0f} %" if profile else ""
        yield (
            f"{name:28s} {n:3d} {100 * hits / n:6.0f} % {100 * low:5.0f} to {100 * high:3.0f} % {shown:>8s} "
            f"{np.sqrt(np.mean(z**2)):12.2f} {np.mean(z):+11.2f}"
        )
    for label, key in (("all, +-1.96 sigma", "covered"), ("critical, profile", "profile covered")):
        hits = [bool(row[key]) for row in rows if key in row]
        low, high = binomial(sum(hits), len(hits))
        yield f"{label}: {100 * np.mean(hits):.1f} % of {len(hits)} (95 %: {100 * low:.1f} to {100 * high:.1f} %)"
    z = np.array([float(row["error"]) / float(row["sigma"]) for row in rows])
    yield f"rms error over bound, all parameters: {np.sqrt(np.mean(z**2)):.2f}"
    yield f"median |error|/bound: {np.median(np.abs(z)):.2f} (normal: 0.67)"


def _score(row: dict[str, float | str | bool]) -> float:
    return float(row["error"]) / float(row["sigma"])


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m identification.coverage", description=__doc__)
    parser.add_argument("--seeds", type=int, default=40)
    parser.add_argument("--first", type=int, default=1)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--json", type=Path)
    asked = parser.parse_args()
    rows: list[dict[str, float | str | bool]] = []
    with ProcessPoolExecutor(asked.processes, initializer=os.nice, initargs=(10,)) as pool:
        for done in pool.map(trial, range(asked.first, asked.first + asked.seeds)):
            rows += done
            furthest = max(done, key=lambda row: abs(_score(row)))
            held = sum(bool(row["covered"]) for row in done)
            print(f"seed {done[0]['seed']}: {held} of {len(done)} held;", end=" ")
            print(f"furthest {furthest['name']} {_score(furthest):+.1f} sigma", flush=True)
            if asked.json:
                asked.json.write_text(json.dumps(rows))
    print("\n".join(table(rows)))


if __name__ == "__main__":
    main()
