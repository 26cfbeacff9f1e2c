"""Predict a recording: the plant driven by the commands, sampled as the transducer and the encoders would."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np
from scipy.linalg import eigh

from kbs_process.errors import SimulationError
from kbs_process.plant.compiled.lanes import LANES
from kbs_process.plant.compiled.simulation import Simulation
from kbs_process.plant.compiled.taps import tap_columns
from kbs_process.plant.compiled.together import Together
from kbs_process.plant.effect import Effect
from kbs_process.plant.laws import select
from kbs_process.plant.linear.linearise import linearise
from kbs_process.plant.schedule import Schedule
from kbs_process.plant.structure import parameters, structure_of
from kbs_process.rig.model import Rig
from kbs_process.signals.records import Array, Block

__all__ = ["DEFAULT_STEP", "LANES", "Schedule", "predict", "predict_together", "simulation_of", "tap_columns"]

DEFAULT_STEP = 2e-3  # s; tests/plant/test_convergence.py shows what it costs in units of the sensors' noise
FINEST_STEP = 2.5e-4  # s; nothing in the plant asks for less
# The amplifier, which passes up to some fifth of the sampling rate, is fed with the mean wrench of each step.
STEPS_PER_SAMPLE = 4
SLIPPING_STEP = 1e-3  # s, of a mounting with states: its slope changes at each reversal of the plate
# rad of the fastest multibody mode, rotors held, in a step: stable up to 2.4, 1.3 in the paper's mechanism.
TURN_PER_STEP = 1.5
BLOCK_S = 10.0


def predict(
    rig: Rig,
    effects: Sequence[str],
    schedule: Schedule,
    *,
    rate_Hz: float,
    angle_rate_Hz: float,
    duration_s: float,
    step_s: float | None = None,
    quantise: bool = True,
    taps: bool = False,
    progress: Callable[[float], None] | None = None,
) -> Iterator[tuple[str, Block]]:
    """Return the streams "wrench", "angle" and "field" of a predicted recording, a block of each at a time.

    "wrench": (n, 6) force and torque on the transducer about T's origin in the plate's own axes, behind the
    amplifier, without cross-coupling, bias and noise, at `rate_Hz`. "angle": (n, joints) encoder readings at
    `angle_rate_Hz`, offset included, rounded to the encoder's codes where `quantise`. "field": (n, joints)
    field position at the start of each cycle, motor rad, not rounded to microsteps.
    With `taps` also "state", at the wrench's samples: the plant's own signals at those instants, in the columns that
    `tap_columns` names (field in whole microsteps, rotor and joint angles and rates unquantised, the plate's angles
    and rates), rad and rad/s.

    Samples lie at 0, 1/rate, ... before `duration_s`; stamps count from the recording's time zero. The run
    starts in static equilibrium at the first command; where that precedes time zero, the time between is
    simulated too. `step_s` bounds the step, which divides the wrench's sampling interval; without it, `step_for`
    does. `progress` gets the share done.
    """
    simulation = simulation_of(
        rig,
        effects,
        schedule,
        rate_Hz=rate_Hz,
        angle_rate_Hz=angle_rate_Hz,
        duration_s=duration_s,
        step_s=step_s,
        taps=taps,
    )
    return _blocks(simulation, rate_Hz, duration_s, quantise, progress)


def simulation_of(
    rig: Rig,
    effects: Sequence[str],
    schedule: Schedule,
    *,
    rate_Hz: float,
    angle_rate_Hz: float,
    duration_s: float,
    step_s: float | None = None,
    taps: bool = False,
) -> Simulation:
    """Return the plant at rest before a prediction; arguments as those of `predict`."""
    if not (min(rate_Hz, angle_rate_Hz, duration_s) > 0.0 and (step_s is None or step_s > 0.0)):
        raise SimulationError("rates, duration and step have to be positive", where="predict")
    chosen = select(effects)
    step = step_s or step_for(rig, chosen, schedule.position[0], rate_Hz)
    per_sample = max(1, int(np.ceil(1.0 / (rate_Hz * step) - 1e-9)))
    return Simulation(
        rig,
        chosen,
        schedule,
        step=1.0 / (rate_Hz * per_sample),
        per_sample=per_sample,
        angle_rate=angle_rate_Hz,
        end=duration_s,
        taps=taps,
    )


def predict_together(simulations: Sequence[Simulation], rate_Hz: float, duration_s: float) -> list[tuple[Array, Array]]:
    """Return wrench (n, 6) and angles (m, joints), offset included and not rounded, of each of some simulations.

    As `predict` does of each alone, to rounding, and several times faster; a plant that diverges has samples that are
    not finite. They have to be alike in structure, schedule, step and rates.
    """
    samples = int(np.ceil(duration_s * rate_Hz - 1e-9))
    found = []
    for begin in range(0, len(simulations), LANES):
        group = simulations[begin : begin + LANES]
        angles = int(np.ceil(duration_s * group[0].angle_rate - 1e-9))
        wrench, angle = Together(group).run(samples, angles)
        found += [(w, _encoded(a, s.encoder, False)) for w, a, s in zip(wrench, angle, group, strict=True)]
    return found


def step_for(rig: Rig, effects: Sequence[Effect], q: Array, rate_Hz: float) -> float:
    """Return the step, s: the default, or less for fast sampling, stiff and light mechanisms, mountings that slip.

    `q` (joints,) is the pose at which the fastest mode of base and outputs is taken; its change over a run is
    what `TURN_PER_STEP` has to spare.
    """
    structure = structure_of(rig, effects)
    parameters(rig, structure)  # says what is missing
    pose = np.where(np.isfinite(q), q, 0.0)
    system = linearise(rig, effects, pose)
    held = system.plate + len(system.joints)
    fastest = np.sqrt(eigh(system.K[:held, :held], system.M[:held, :held], eigvals_only=True)[-1])
    wanted = min(1.0 / (STEPS_PER_SAMPLE * rate_Hz), TURN_PER_STEP / fastest)
    most = SLIPPING_STEP if structure.mounted else DEFAULT_STEP
    return float(min(most, max(FINEST_STEP, wanted)))


def _blocks(
    simulation: Simulation, rate: float, duration: float, quantise: bool, progress: Callable[[float], None] | None
) -> Iterator[tuple[str, Block]]:
    a_rate, per_sample = simulation.angle_rate, simulation.per_sample
    samples = int(np.ceil(duration * rate - 1e-9))
    angles = int(np.ceil(duration * a_rate - 1e-9))
    block = max(1, int(BLOCK_S * rate))
    while simulation.first < 0:  # what precedes the recording
        simulation.advance(min(-simulation.first, block * per_sample), 0)
    cycle = int(np.searchsorted(simulation.knots, -1e-9))
    # The sample at time zero ends no step.
    start = _encoded(simulation.part("q")[None, :], simulation.encoder, quantise)
    yield "angle", _block(np.zeros(1), start)
    done = angle_done = 0
    angle_done = 1
    while done < samples:
        count = min(block, samples - done)
        wrench, angle, state = simulation.advance(count * per_sample, angle_done)
        angle = angle[: angles - angle_done]
        yield "wrench", _block((done + np.arange(count)) / rate, wrench)
        if simulation.taps:
            yield "state", _block((done + np.arange(count)) / rate, state)
        if len(angle):
            yield (
                "angle",
                _block((angle_done + np.arange(len(angle))) / a_rate, _encoded(angle, simulation.encoder, quantise)),
            )
        until = min(simulation.controlled, int(np.searchsorted(simulation.knots, duration - 1e-9)))
        if until > cycle:
            field = simulation.fields[cycle:until] / simulation.microsteps
            yield "field", _block(simulation.knots[cycle:until], field)
        done, angle_done, cycle = done + count, angle_done + len(angle), max(cycle, until)
        if progress is not None:
            progress(done / samples)


def _encoded(angle: Array, encoder: Array, quantise: bool) -> Array:
    """Return encoder readings: offset added, rounded to the nearest code; step 0 does not round."""
    step, offset = encoder
    reading: Array = angle + offset
    if not quantise:
        return reading
    code = np.where(step > 0.0, step, 1.0)
    return np.where(step > 0.0, np.floor(reading / code + 0.5) * code, reading)


def _block(t: Array, values: Array) -> Block:
    stamp = np.rint(t * 1e9).astype(np.int64)
    return Block(stamp, stamp, np.ascontiguousarray(values))
