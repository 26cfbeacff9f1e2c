"""Starting points for the identification: where in frequency the resonances lie, and where the phases.

The cost has a minimum in every turn of every phase, and one wherever a resonance of the plant falls on a side lobe
of the measured one. Neither is found by descent. But resonances show in the power spectra, whatever the phases, and an
effect of small amplitude is linear in amplitude times cosine and sine of its phase, once the resonances are right.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from kbs_process.identification.output_error import Experiment, Measured, Output, Scalar, Spectra, simulate
from kbs_process.plant.effect import Port, Uniform
from kbs_process.plant.laws import select
from kbs_process.plant.linear.modes import modes
from kbs_process.rig.model import Rig
from kbs_process.signals.records import WRENCH_CHANNELS, Array

Task = tuple[int, Array, Spectra]  # recording, values of the free numbers, noise
Evaluate = Callable[[Sequence[Task]], list[Array]]

LEAST = 0.05  # of its prior: an amplitude is no less, so that its phase has a meaning

_AXES = "xyz"
_ROUNDS = 2  # of matching: channels see each other's resonances
_AROUND = 0.15  # of a resonance's frequency: where its peak is looked for
_FARTHEST = 0.08  # of its frequency: how far it may be off
_STEP = 1e-3  # of frequency
_SMOOTH = 5  # steps
_PHASES = 8  # tried of a Coulomb friction that comes and goes


@dataclass(frozen=True, slots=True)
class Phase:
    """A phase among the free numbers, the amplitude that belongs to it, and whether it enters smoothly."""

    phase: int  # index among the free numbers
    amplitude: int
    smooth: bool


@dataclass(frozen=True, slots=True)
class Contact:
    """Indices among the free numbers of a contact's torque, its half width and its phase."""

    torque: int
    width: int
    phase: int


@dataclass(frozen=True, slots=True, eq=False)
class Start:
    """Values to begin a fit at, and -2 log likelihood there as the linear model has it."""

    values: Array
    cost: float


def phases(rig: Rig, effects: Sequence[str], free: Sequence[Scalar]) -> tuple[Phase, ...]:
    """Find phases (uniform priors over a turn) with their amplitudes: the nearest torque declared before each."""
    place = {scalar.name: index for index, scalar in enumerate(free)}
    found = []
    for joint in rig.joints:
        for effect in select(effects):
            amplitude = ""
            for parameter in effect.parameters:
                name = f"joint.{joint.name}.drive.{parameter.name}"
                if parameter.unit == "N m":
                    amplitude = name
                uniform = isinstance(parameter.prior, Uniform)
                if uniform and name in place and amplitude in place:
                    smooth = effect.port is not Port.MOTOR_FRICTION
                    found.append(Phase(place[name], place[amplitude], smooth))
    return tuple(found)


def contacts(rig: Rig, effects: Sequence[str], free: Sequence[Scalar]) -> tuple[Contact, ...]:
    """Find frictions with a torque, a half width and a phase that are all free."""
    place = {scalar.name: index for index, scalar in enumerate(free)}
    found = []
    for joint in rig.joints:
        for effect in select(effects):
            if effect.port is not Port.MOTOR_FRICTION:
                continue
            roles: dict[str, int] = {}
            for parameter in effect.parameters:
                index = place.get(f"joint.{joint.name}.drive.{parameter.name}")
                turns = isinstance(parameter.prior, Uniform)
                role = {"N m": "torque", "rad": "phase" if turns else "width"}.get(parameter.unit)
                if index is not None and role is not None:
                    roles[role] = index
            if len(roles) == 3:
                found.append(Contact(**roles))
    return tuple(found)


Run = Callable[[Experiment, Measured, Array], Output]


def match_resonances(experiment: Experiment, values: Array, spectra: Sequence[Spectra], run: Run = simulate) -> Array:
    """Return `values` with the transducer's stiffness such that the plant's resonances lie where measured.

    Each torque channel's spectrum around the plant's lowest resonance about that axis is shifted along log f until it
    fits the measured one best; stiffness goes with frequency squared. Good to a fraction of the resonance's width.
    """
    free = {scalar: index for index, scalar in enumerate(experiment.free)}
    for _ in range(_ROUNDS):
        outputs = [run(experiment, recording, values).wrench for recording in experiment.recordings]
        rig = experiment.rig_at(values)
        changed = values.copy()
        for axis, letter in enumerate(_AXES):
            scalar = Scalar("transducer.stiffness", (axis,))
            name = f"T{letter}"
            if scalar not in free or name not in rig.transducer.channels:
                continue
            column = rig.transducer.channels.index(name)
            profile = np.zeros(2 * round(_FARTHEST / _STEP) + 1)
            for recording, output, noise in zip(experiment.recordings, outputs, spectra, strict=True):
                own = [
                    m
                    for m in modes(rig, select(experiment.effects), _pose(recording, len(rig.joints)))
                    if m.axis == letter
                ]
                highest = experiment.bands(recording)[column][1]
                if not own or own[0].frequency * (1.0 + _AROUND) > highest:
                    continue
                pair = (recording.wrench[:, column], output[:, WRENCH_CHANNELS.index(name)])
                profile += _likeness(
                    pair, recording.dt, own[0].frequency, float(noise[column].at(np.array([own[0].frequency]))[0])
                )
            shift = (int(np.argmax(profile)) - len(profile) // 2) * _STEP if profile.any() else 0.0
            changed[free[scalar]] *= math.exp(2.0 * shift)
        values = changed
    return values


def _pose(recording: Measured, joints: int) -> Array:
    """Mean angles (joints,) of a recording: as read, or as commanded where encoders do not read every joint."""
    if recording.angle.shape[1] == joints:
        return np.asarray(recording.angle.mean(axis=0), dtype=np.float64)
    t, commanded = recording.schedule.t, recording.schedule.position
    during = commanded[t >= 0.0] if np.any(t >= 0.0) else commanded
    return np.asarray(during.mean(axis=0), dtype=np.float64)


def _likeness(pair: tuple[Array, Array], dt: float, around: float, noise: float) -> Array:
    """Correlation of log(1 + signal-to-noise) of measured and modelled, the latter moved along log f, by shift."""
    most = round(_FARTHEST / _STEP)
    u = np.log(around) + _STEP * np.arange(-round(_AROUND / _STEP) - most, round(_AROUND / _STEP) + most + 1)
    measured, modelled = (_level(x, dt, u, noise) for x in pair)
    inner = modelled[most:-most] - modelled[most:-most].mean()
    windows = np.lib.stride_tricks.sliding_window_view(measured, len(inner))
    spread = windows - windows.mean(axis=1, keepdims=True)
    scale = np.sqrt(np.sum(spread**2, axis=1) * np.sum(inner**2))
    likeness: Array = spread @ inner / np.where(scale > 0.0, scale, 1.0)
    return likeness


def _level(x: Array, dt: float, u: Array, noise: float) -> Array:
    """log(1 + P/noise) of the smoothed periodogram at log frequencies u."""
    n = len(x)
    power = np.abs(np.fft.rfft((x - x.mean()) * np.hanning(n))) ** 2 * (2.0 * dt / (0.375 * n))
    f = np.fft.rfftfreq(n, dt)
    total = np.concatenate([[0.0], np.cumsum(power)])
    half = 0.5 * _SMOOTH * _STEP
    low, high = (np.clip(np.searchsorted(f, np.exp(u + side)), 0, len(f)) for side in (-half, half))
    high = np.maximum(high, low + 1)
    mean = (total[np.minimum(high, len(f))] - total[np.minimum(low, len(f) - 1)]) / (high - low)
    level: Array = np.log1p(mean / noise)
    return level


def starts(
    experiment: Experiment, values: Array, spectra: Sequence[Spectra], evaluate: Evaluate, most: int
) -> tuple[Start, ...]:
    """Return up to `most` starting points, best first: the local minima over the phases of what is not smooth.

    The plant runs with all such effects off, then with one of them on at a time: at two phases a quarter turn apart
    where its torque is smooth, at eight phases where it is a Coulomb friction. Whitened responses are added, amplitudes
    found by linear least squares for every choice of the latter phases.
    """
    known = phases(experiment.rig, experiment.effects, experiment.free)
    off = values.copy()
    off[[phase.amplitude for phase in known]] = 0.0
    points = [off]
    for phase in known:
        angles = (0.0, 0.5 * np.pi) if phase.smooth else _grid()
        for angle in angles:
            one = off.copy()
            one[phase.amplitude], one[phase.phase] = values[phase.amplitude], angle
            points.append(one)
    indices = range(len(experiment.recordings))
    found = evaluate([(index, point, spectra[index]) for point in points for index in indices])
    rows = [np.concatenate(found[k : k + len(indices)]) for k in range(0, len(found), len(indices))]
    if not known:
        return (Start(values, float(rows[0] @ rows[0])),)
    A = np.column_stack(rows[1:]) - rows[0][:, None]
    # What no plant can run with is no place to start at.
    A[:, ~np.isfinite(A).all(axis=0)] = 0.0
    gram, rhs, left = A.T @ A, -A.T @ rows[0], float(rows[0] @ rows[0])
    return _minima(known, values, gram, rhs, left)[:most]


def _grid() -> Array:
    grid: Array = np.arange(_PHASES, dtype=np.float64) * (2.0 * np.pi / _PHASES)
    return grid


def _minima(known: Sequence[Phase], values: Array, gram: Array, rhs: Array, left: float) -> tuple[Start, ...]:
    first, begin = {}, 0
    for phase in known:
        first[phase] = begin
        begin += 2 if phase.smooth else _PHASES
    rough = [phase for phase in known if not phase.smooth]
    smooth = [first[phase] + k for phase in known if phase.smooth for k in (0, 1)]
    found: dict[tuple[int, ...], Start] = {}
    for choice in itertools.product(range(_PHASES), repeat=len(rough)):
        columns = smooth + [first[phase] + k for phase, k in zip(rough, choice, strict=True)]
        size = gram[np.ix_(columns, columns)]
        gain = np.linalg.solve(size + 1e-9 * np.trace(size) * np.eye(len(columns)), rhs[columns])
        value = values.copy()
        for phase in known:
            if phase.smooth:
                at = smooth.index(first[phase])
                cosine, sine = gain[at], gain[at + 1]
                value[phase.phase] = math.atan2(sine, cosine)
                value[phase.amplitude] *= min(max(math.hypot(cosine, sine), 0.1), 3.0)
        for place, (phase, k) in enumerate(zip(rough, choice, strict=True)):
            value[phase.phase] = _grid()[k]
            value[phase.amplitude] *= min(max(gain[len(smooth) + place], 0.1), 3.0)
        # A friction that drives is none: what it would gain by a negative amplitude does not count.
        gain[len(smooth) :] = np.maximum(gain[len(smooth) :], 0.0)
        found[choice] = Start(value, float(left - 2.0 * gain @ rhs[columns] + gain @ size @ gain))
    return tuple(sorted(_local(found), key=lambda start: start.cost))


def _local(found: dict[tuple[int, ...], Start]) -> list[Start]:
    """Those that no neighbour on the torus of phases undercuts."""
    minima = []
    for choice, start in found.items():
        neighbours = (
            tuple((k + d) % _PHASES for k, d in zip(choice, step, strict=True))
            for step in itertools.product((-1, 0, 1), repeat=len(choice))
        )
        if all(start.cost <= found[neighbour].cost for neighbour in neighbours):
            minima.append(replace(start))
    return minima
