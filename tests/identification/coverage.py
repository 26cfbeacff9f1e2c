"""Do the identification's intervals hold the truth as often as they say? Run from tests/:

    nice python -m identification.coverage --seeds 40 [--processes 2] [--json FILE]

Seeds that FILE has already are not run again.

Each seed draws hardware from the priors of campaigns/DUMMY1 (every uncertain number, phases from the whole circle),
makes one recording of 36 s with the independent engine (its own equations, integrator, noise, clocks and codes),
condenses it as any recording is, and identifies it. What the engine lets friction differ by
from run to run is given to the identification as it is (rms 1.15 %), since the method is on trial here, not that
assumption. Printed are, for each gearbox parameter, the coverage of 95 % intervals with its own binomial interval, and
the rms error over the Cramer-Rao bound: the inverse of the information that data and priors hold, at the estimate.
Errors of one seed are correlated: intervals of what is said of all parameters are those of seeds drawn again.
"""

from __future__ import annotations

import argparse
import json
import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from scipy.stats import beta

from engine.campaigns import CAMPAIGNS_FOLDER
from engine.hardware import Hardware
from engine.sensors import FRICTION_SPREAD, Recording, Stream, record
from engine.trajectories import Axis, Commands, commands
from kbs_process.campaign.load import load_campaign
from kbs_process.estimation.whittle import periodogram
from kbs_process.identification.estimate import Identification, Settings, identify, intervals
from kbs_process.identification.output_error import Experiment, residual, sensor_spectra, unexplained
from kbs_process.identification.screening import Evaluate, Task
from kbs_process.identification.unknowns import frictions, gearbox
from kbs_process.signals.records import Array, Block
from kbs_process.stages.align.condense import CondenseSettings, condense
from kbs_process.studies.identify.measured import measured


@dataclass(frozen=True, slots=True)
class Estimate:
    """One parameter of one seed."""

    name: str
    error: float
    bound: float  # Cramer-Rao, of data and priors: also the sigma that the identification states
    profile: bool | None  # the profile's interval holds the truth; None: not profiled

    @property
    def covered(self) -> bool:
        return abs(self.error) <= 1.96 * self.bound


@dataclass(frozen=True, slots=True)
class Trial:
    """One seed."""

    seed: int
    checks: bool  # converged, no better phase or contact edge known, contact explains what there is, residual is noise
    truth_above: float  # -2 log posterior of the truth over the estimate's
    estimates: tuple[Estimate, ...]


RUN_TO_RUN = FRICTION_SPREAD / np.sqrt(3.0)  # a uniform distribution's standard deviation


def sweep(start: float, peak: float) -> Axis:
    """Rates 0 to `peak`, to -`peak`, to 0 (deg/s) in 32 s."""
    a = abs(peak) / 8.0
    return Axis(start).rest(2.0).accelerate(peak, a).accelerate(-peak, a).accelerate(0.0, a)


def short_sweeps() -> Commands:
    return commands(sweep(-5.0, 0.9), sweep(55.0, -0.7), 36.0)


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
    return Experiment(
        rig, campaign.effects, gearbox(rig, campaign.effects), (measured(run, rig),), Settings().lowest_Hz
    )


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


def above(found: Identification, truth: Array, run: Hardware) -> float:
    """-2 log posterior of the true numbers over the estimate's: negative where a better minimum was missed."""
    parameters = found.parameters
    factors = []
    for index in frictions(found.experiment):
        scalar = found.experiment.free[index]
        factors.append(float(run[scalar.quantity][scalar.element]) / truth[index] - 1.0)
    objective = found.objective(serial)
    costs = []
    for theta in (found.fit.value, np.concatenate([truth, factors])):
        r, excess = objective.residual(theta), (theta - parameters.value) / parameters.sigma
        costs.append(float(r @ r + excess @ excess))
    return costs[1] - costs[0]


def over_noise(found: Identification) -> Iterator[float]:
    """Rms of the residual over the sensors' noise in each channel: what a report's check of the residual looks at."""
    setting = found.experiment
    (recording,) = setting.recordings
    noise = sensor_spectra(setting, recording)
    left = unexplained(setting, recording, found.values, noise)
    for column, (spectrum, band) in enumerate(zip(noise, setting.bands(recording), strict=True)):
        f, power = periodogram(left[:, column], recording.valid, recording.dt)
        inside = (f >= band[0]) & (f <= band[1])
        yield float(np.sqrt(np.mean(power[inside] / spectrum.at(f[inside]))))


def trial(seed: int) -> Trial:
    """One seed: each gearbox parameter's error, sigma, bound, and whether its intervals hold the truth."""
    hardware, recording = make(seed, short_sweeps())
    setting = experiment(recording)
    found = identify(setting, serial, Settings(run_to_run=RUN_TO_RUN, starts=1), silent)
    profiled = {profile.name: profile for profile in intervals(found, serial)}
    truth = true_values(hardware, found)
    wrong = errors(found, truth)
    estimates = []
    for index, scalar in enumerate(setting.free):
        held = None
        if scalar.name in profiled:
            at, ends = found.values[index] - wrong[index], profiled[scalar.name]
            held = bool(ends.low <= at <= ends.high)
        estimates.append(Estimate(scalar.name, float(wrong[index]), float(found.fit.sigma[index]), held))
    checks = found.fit.checks[0].passed and found.modes[0].settled and found.fit.checks[-1].passed
    checks = checks and max(over_noise(found)) < 1.05
    return Trial(seed, checks, above(found, truth, recording.hardware), tuple(estimates))


def read(path: Path) -> list[Trial]:
    """Trials of an earlier call, which need not be run again."""
    return [
        Trial(**(one | {"estimates": tuple(Estimate(**each) for each in one["estimates"])}))
        for one in json.loads(path.read_text())
    ]


def binomial(hits: int, n: int) -> tuple[float, float]:
    """95 % Clopper-Pearson interval of a rate."""
    low = float(beta.ppf(0.025, hits, n - hits + 1)) if hits else 0.0
    high = float(beta.ppf(0.975, hits + 1, n - hits)) if hits < n else 1.0
    return low, high


def bootstrap(groups: Sequence[Sequence[float | bool]], of: Callable[[Sequence[float]], float]) -> tuple[float, float]:
    """95 % interval of a statistic over groups, by drawing groups again (B. Efron, Annals of Statistics 7:1, 1979)."""
    rng = np.random.default_rng(0)
    drawn = [of(np.concatenate([groups[k] for k in rng.integers(0, len(groups), len(groups))])) for _ in range(2000)]
    low, high = np.percentile(drawn, [2.5, 97.5])
    return float(low), float(high)


def rms(x: Iterable[float]) -> float:
    return float(np.sqrt(np.mean(np.square(list(x)))))


def table(trials: Sequence[Trial]) -> Iterator[str]:
    head = ("parameter", "n", "covered", "95 % of that", "profile", "error/bound", "bias/bound")
    yield "{:28s} {:>3s} {:>8s} {:>14s} {:>8s} {:>12s} {:>11s}".format(*head)
    for own in zip(*(one.estimates for one in trials), strict=True):
        low, high = binomial(sum(one.covered for one in own), len(own))
        held = [one.profile for one in own if one.profile is not None]
        shown = f"{100 * np.mean(held):6.0f} %" if held else ""
        yield (
            f"{own[0].name:28s} {len(own):3d} {100 * np.mean([one.covered for one in own]):6.0f} % "
            f"{100 * low:5.0f} to {100 * high:3.0f} % {shown:>8s} "
            f"{rms(one.error / one.bound for one in own):12.2f} "
            f"{np.mean([one.error / one.bound for one in own]):+11.2f}"
        )
    held = (
        [[one.covered for one in done.estimates] for done in trials],
        [[one.profile for one in done.estimates if one.profile is not None] for done in trials],
    )
    for label, hits in zip(("all, +-1.96 sigma", "critical, profile"), held, strict=True):
        low, high = bootstrap(hits, lambda drawn: float(np.mean(drawn)))
        count = sum(map(len, hits))
        yield (
            f"{label}: {100 * np.mean(np.concatenate(hits)):.1f} % of {count} "
            f"(95 %, by seeds: {100 * low:.1f} to {100 * high:.1f} %)"
        )
    z = [[one.error / one.bound for one in done.estimates] for done in trials]
    for label, of in (
        ("rms error over bound, all parameters", rms),
        ("median |error|/bound (normal: 0.67)", lambda drawn: float(np.median(np.abs(drawn)))),
    ):
        low, high = bootstrap(z, of)
        yield f"{label}: {of(np.concatenate(z)):.2f} (95 %, by seeds: {low:.2f} to {high:.2f})"
    missed = [str(one.seed) for one in trials if one.truth_above < -10.0]
    yield f"seeds where the truth costs less by more than 10: {', '.join(missed) or 'none'}"
    failed = [str(one.seed) for one in trials if not one.checks]
    yield f"seeds whose checks (converged, edges, contact, residual) did not pass: {', '.join(failed) or 'none'}"


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m identification.coverage", description=__doc__)
    parser.add_argument("--seeds", type=int, default=40)
    parser.add_argument("--first", type=int, default=1)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--json", type=Path)
    asked = parser.parse_args()
    trials = read(asked.json) if asked.json and asked.json.exists() else []
    seeds = sorted(set(range(asked.first, asked.first + asked.seeds)) - {one.seed for one in trials})
    with ProcessPoolExecutor(asked.processes, initializer=os.nice, initargs=(10,)) as pool:
        for running in as_completed([pool.submit(trial, seed) for seed in seeds]):
            done = running.result()
            trials = sorted([*trials, done], key=lambda one: one.seed)
            furthest = max(done.estimates, key=lambda one: abs(one.error / one.bound))
            print(f"seed {done.seed}: {sum(one.covered for one in done.estimates)} of", end=" ")
            print(
                f"{len(done.estimates)} held; rms {rms(one.error / one.bound for one in done.estimates):.2f};", end=" "
            )
            print(f"furthest {furthest.name} {furthest.error / furthest.bound:+.1f} sigma;", end=" ")
            print(f"truth {done.truth_above:+.0f}; checks {done.checks}", flush=True)
            if asked.json:
                asked.json.write_text(json.dumps([asdict(one) for one in trials], indent=0) + "\n")
    print("\n".join(table(trials)))


if __name__ == "__main__":
    main()
