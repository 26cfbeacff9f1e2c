"""Can the gear's error of twice a motor turn be told from its rivals beside the paper's five? Run as a program:

    cd tests && python -m identification.kinematic --seeds 6

Drawn hardware of configuration 1, an error of a catalogue's size, one sweep of the azimuth to 1.8 deg/s: there two a
motor turn are at 1 Hz. Estimated are the paper's five and the error; then the same without the error, and what each
rival could explain of what is left, beside all numbers that are free.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from engine.campaigns import CAMPAIGNS_FOLDER
from engine.hardware import Hardware
from engine.sensors import Recording, record
from engine.trajectories import Axis, commands
from identification.coverage import RUN_TO_RUN, errors, experiment, serial, silent
from kbs_process.identification.estimate import Settings, identify, intervals
from kbs_process.identification.output_error import Experiment, Scalar, Spectra, residual
from kbs_process.plant.attach import attach
from kbs_process.plant.laws import select
from kbs_process.rig.model import substitute
from kbs_process.signals.records import Array

FIVE = ("tcog", "phi_cog", "d1", "phi_dyn", "Ts0", "delta", "phi_stat", "fsv", "Ka")
ERROR = ("kinematic_sin", "kinematic_cos")
SIGMA = 1.5e-4  # rad, of either amplitude
ENCODER = 5e-4  # rad, of an encoder's error: more than one of its codes
PATH = commands(Axis(-5.0).rest(1.0).accelerate(1.8, 0.3).accelerate(-1.8, 0.3).accelerate(0.0, 0.3), Axis(55.0), 27.0)


def drawn(seed: int) -> Recording:
    """One sweep of hardware whose azimuth gear errs."""
    a, b = np.random.default_rng([seed, 2]).normal(0.0, SIGMA, 2)
    hardware = Hardware.from_campaign(CAMPAIGNS_FOLDER / "DUMMY1", seed=seed)
    more = {f"joint.az.drive.{name}": np.asarray(value) for name, value in zip(ERROR, (a, b), strict=True)}
    return record(hardware.having(more), PATH, seed=seed, epoch_ns=0, wrench_hz=100.0, encoder_hz=20.0)


def setting(recording: Recording, names: tuple[str, ...]) -> Experiment:
    """The paper's five and `names` of the azimuth free; what else the parameter files do not know is as in this run."""
    base = experiment(recording)
    free = tuple(Scalar(f"joint.az.drive.{name}") for name in (*FIVE, *names))
    kept = {scalar.quantity for scalar in free}
    given: dict[str, Array | float] = {}
    exact: dict[str, Array | float] = {}
    for name, quantity in base.rig.quantities().items():
        if name not in kept and np.any(quantity.sigma > 0.0) and name in recording.hardware.values:
            given[name], exact[name] = np.asarray(recording.hardware[name]), np.zeros(quantity.shape)
    rig, effects = substitute(base.rig, given, exact), base.effects
    if names:
        effects = (*effects, "kinematic_error")
        rig = attach(rig, select(["kinematic_error"])[0], {"kinematic_order": 2.0})
        amplitudes = {f"joint.az.drive.{name}": SIGMA for name in names}
        rig = substitute(rig, dict.fromkeys(amplitudes, 0.0), {k: np.asarray(v) for k, v in amplitudes.items()})
        fixed = [n for n in rig.quantities() if n.endswith("kinematic_order") or (".el." in n and "kinematic" in n)]
        rig = substitute(rig, {n: rig.quantities()[n].value for n in fixed}, {n: np.zeros(()) for n in fixed})
    return replace(base, rig=rig, effects=effects, free=free)


def slopes(at: Experiment, values: Array, steps: Array, spectra: Spectra) -> Array:
    """(n, p) differences of the whitened residual by each free number."""
    recording = at.recordings[0]
    sides = [
        [
            residual(at, recording, values + side * np.where(np.arange(len(steps)) == k, step, 0.0), spectra)
            for side in (1, -1)
        ]
        for k, step in enumerate(steps)
    ]
    return np.column_stack(
        [(ahead - behind) / (2.0 * step) for (ahead, behind), step in zip(sides, steps, strict=True)]
    )


def with_effect(at: Experiment, name: str) -> Experiment:
    """The experiment with one more effect that does nothing yet, its amplitudes at the azimuth alone free."""
    (effect,) = select([name])
    order = {"kinematic_order": 2.0} if name == "kinematic_error" else {}
    free = tuple(Scalar(f"joint.az.drive.{entry.name}") for entry in effect.amplitudes)
    return replace(at, rig=attach(at.rig, effect, order), effects=(*at.effects, name), free=free)


def of_encoder(at: Experiment, values: Array, order: float, spectra: Spectra) -> Array:
    """(n, 2) whitened residual of an error of the azimuth's encoder, sine and cosine, `order` in a turn of its disc."""
    recording = at.recordings[0]
    rows = [residual(at, recording, values, spectra)]
    for wave in (np.sin, np.cos):
        angle = recording.angle.copy()
        angle[:, 0] += SIGMA * wave(order * angle[:, 0])
        rows.append(residual(at, replace(recording, angle=angle), values, spectra))
    return (np.column_stack(rows[1:]) - rows[0][:, None]) / SIGMA


def rivals(at: Experiment, values: Array, spectra: Spectra) -> dict[str, Array]:
    """What each explanation does to the whitened residual (n, k) for its amplitudes at one sigma of their priors."""
    here = replace(at, rig=at.rig_at(values))
    found = {}
    for name in ("kinematic_error", "controller_latency", "load_friction"):
        one = with_effect(here, name)
        (effect,) = select([name])
        sigma = np.array([entry.prior.spread for entry in effect.amplitudes])
        found[name] = slopes(one, np.zeros(len(sigma)), 0.05 * sigma, spectra) * sigma
    for order in (1.0, 200.0):
        found[f"encoder, {order:.0f} a turn"] = ENCODER * of_encoder(at, values, order, spectra)
    return found


def explained(r: Array, J: Array, sigma: Array, more: Array) -> float:
    """Fall of the cost by `more` columns, each with an amplitude of 0 +- 1, beside those of J within their priors."""

    def left(A: Array) -> float:
        whole = np.vstack([A, np.eye(A.shape[1])])
        target = np.concatenate([r, np.zeros(A.shape[1])])
        return float(np.sum((target - whole @ np.linalg.lstsq(whole, target)[0]) ** 2))

    known = J * np.minimum(sigma, np.pi)
    return left(known) - left(np.hstack([known, more]))


@dataclass(frozen=True, slots=True)
class Trial:
    """One seed: errors over sigmas of all that is free, profile intervals that hold, and what rivals explain."""

    seed: int
    names: tuple[str, ...]
    error: Array  # over sigma
    held: tuple[bool, ...]
    amplitude: tuple[float, float, float]  # true, found, sigma, rad
    phase: tuple[float, float, float]
    explained: dict[str, float]
    over_noise: tuple[float, float]  # whitened residual, rms, without and with the error


def polar(sine: float, cosine: float, covariance: Array) -> tuple[tuple[float, float], tuple[float, float]]:
    """Amplitude and phase of sine sin x + cosine cos x, each with its sigma."""
    size = float(np.hypot(sine, cosine))
    along, across = np.array([sine, cosine]) / size, np.array([-cosine, sine]) / size**2
    sigmas = [float(np.sqrt(g @ covariance @ g)) for g in (along, across)]
    return (size, sigmas[0]), (float(np.arctan2(cosine, sine)), sigmas[1])


def trial(seed: int) -> Trial:
    recording = drawn(seed)
    hardware, settings = recording.hardware, Settings(run_to_run=RUN_TO_RUN, starts=1)
    found = identify(setting(recording, ERROR), serial, settings, silent)
    truth = np.array([float(hardware[one.quantity][one.element]) for one in found.experiment.free])
    wrong = errors(found, truth)
    profiled = intervals(found, serial)
    at = {scalar.name: found.values[k] - wrong[k] for k, scalar in enumerate(found.experiment.free)}
    place = [len(FIVE), len(FIVE) + 1]
    amplitude, phase = polar(*found.values[place], found.fit.covariance[np.ix_(place, place)])
    without = identify(setting(recording, ()), serial, settings, silent)
    # The noise is that of the whole model: what is not modelled would be taken for noise.
    spectra, bare = found.spectra[0], without.experiment
    J = slopes(bare, without.values, 0.3 * without.fit.sigma[: len(FIVE)], spectra)
    r = residual(bare, bare.recordings[0], without.values, spectra)
    sigma = without.parameters.sigma[: len(FIVE)]
    gains = {name: explained(r, J, sigma, more) for name, more in rivals(bare, without.values, spectra).items()}
    return Trial(
        seed,
        tuple(scalar.name for scalar in found.experiment.free),
        wrong / found.fit.sigma[: len(wrong)],
        tuple(one.low <= at[one.name] <= one.high for one in profiled),
        (float(np.hypot(*truth[place])), *amplitude),
        (float(np.arctan2(truth[place[1]], truth[place[0]])), *phase),
        gains,
        (without.fit.residual_rms, found.fit.residual_rms),
    )


def table(trials: Sequence[Trial]) -> Iterator[str]:
    yield "| seed | amplitude / 1e-4 rad: true | found | phase / rad: true | found | within 1.96 sigma | profiles |"
    yield "| --- | --- | --- | --- | --- | --- | --- |"
    for one in trials:
        sizes = "{:.3f} | {:.3f} +- {:.3f}".format(*(1e4 * x for x in one.amplitude))
        turns = "{:.2f} | {:.2f} +- {:.2f}".format(*one.phase)
        inside = np.sum(np.abs(one.error) < 1.96)
        yield f"| {one.seed} | {sizes} | {turns} | {inside} of {len(one.error)} | {sum(one.held)} of {len(one.held)} |"
    names = list(trials[0].explained)
    yield ""
    yield f"| seed | {' | '.join(names)} |"
    yield "| --- |" + " --- |" * len(names)
    for one in trials:
        yield f"| {one.seed} | {' | '.join(f'{one.explained[name]:.0f}' for name in names)} |"


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m identification.kinematic", description=__doc__)
    parser.add_argument("--seeds", type=int, default=6)
    trials = []
    for seed in range(1, parser.parse_args().seeds + 1):
        trials.append(trial(seed))
        print(f"seed {seed}", flush=True)
    print("\n".join(table(trials)))


if __name__ == "__main__":
    main()
