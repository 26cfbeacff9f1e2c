"""Onset of instability in the time domain: the non-linear plant, kicked, at one gain after another.

The command steps by a small angle and then stands; whether the joints' oscillation about it grows or decays says on
which side of the onset a gain lies, and bisection finds the onset. Without friction, and without an encoder's codes,
it is that of the linearised plant; with them it depends on the kick, and limit cycles appear below it.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import detrend, periodogram

from kbs_process.errors import SimulationError
from kbs_process.plant.effect import ACTION
from kbs_process.plant.laws import CATALOGUE, MEASURED
from kbs_process.plant.predict import Schedule, predict
from kbs_process.rig.model import Controller, Rig, substitute
from kbs_process.signals.records import Array, Block
from kbs_process.stages.gravity.equation import encoder_offsets

KICK = 1e-3  # rad
DURATION = 40.0  # s
_WINDOW = 10.0  # s, of which the second and the last are compared
_STILL = 1e-5  # rad rms: two microsteps at the output of the paper's rig; what is below has died away
_LOST = 10.0  # times the kick: motors slip, and their motion means nothing any more


@dataclass(frozen=True, slots=True, eq=False)
class Ring:
    """Joint angles after a kick, and how they grew."""

    t: Array  # (n,) s
    angle: Array  # (n, joints) rad, less the kicked command
    kick: float  # rad
    early: float  # rad rms about the mean, of the joint that moves most, 10 to 20 s after the start
    late: float  # rad rms of the same, in the last 10 s
    frequency: float  # Hz, of the largest line in the last 10 s

    def grows(self, floor: float) -> bool:
        """Whether the oscillation was lost, or is larger at the end than it was and than `floor` (rad rms)."""
        lost = float(np.max(np.abs(self.angle))) > _LOST * self.kick
        return lost or self.late > max(floor, self.early)


@dataclass(frozen=True, slots=True)
class Onset:
    """Between the factor that still decays and the one that grows."""

    factor: float
    half_width: float
    frequency: float  # Hz, of the oscillation that grows


def smooth_rig(rig: Rig) -> Rig:
    """Return the rig with encoders that do not round, and without friction and cogging."""
    steps = [joint.encoder.step.name for joint in rig.joints if joint.encoder is not None]
    holders = [joint.drive.parameters for joint in rig.joints if joint.drive is not None]
    holders += [external.parameters for external in rig.external]
    dry = {entry.name for effect in (*CATALOGUE, *MEASURED) for entry in effect.parameters if entry.dry}
    amplitudes = [
        quantity.name
        for holder in holders
        for name, quantity in holder.items()
        if name in dry or re.sub(f"{ACTION}$", "", name) in dry
    ]
    return substitute(rig, dict.fromkeys([*steps, *amplitudes], 0.0))


def ring(
    rig: Rig,
    effects: Sequence[str],
    q: Array,
    *,
    proportional: float,
    integral: float,
    kick: float = KICK,
    duration: float = DURATION,
) -> Ring:
    """Simulate the closed loop standing at q (joints,) with Kp and Ki times a factor each, kicked after 1 s."""
    controller = rig.controller
    assert controller is not None  # a command-driven campaign has one
    gained = _with_gains(rig, controller, proportional, integral)
    cycle = float(controller.cycle)
    t = np.arange(0.0, duration + cycle, cycle)
    position = np.tile(np.asarray(q, dtype=float), (len(t), 1)) + kick * (t >= 1.0)[:, None]
    rate = 5.0 / cycle
    blocks = predict(
        gained,
        effects,
        Schedule(t, position, np.zeros_like(position)),
        rate_Hz=rate,
        angle_rate_Hz=rate,
        duration_s=duration,
        quantise=False,
    )
    angle = np.concatenate(list(_angles(blocks)))
    moved = angle - np.asarray(q) - kick - encoder_offsets(rig)
    early = _rms(moved[int(_WINDOW * rate) : int(2 * _WINDOW * rate)])
    last = moved[-int(_WINDOW * rate) :]
    most = int(np.argmax(_rms(last)))
    f, power = periodogram(detrend(last[:, most]), rate, window="hann")
    return Ring(
        t=np.arange(len(moved)) / rate,
        angle=moved,
        kick=kick,
        early=float(early[most]),
        late=float(_rms(last)[most]),
        frequency=float(f[np.argmax(power)]),
    )


def onset(
    rig: Rig,
    effects: Sequence[str],
    q: Array,
    guess: float,
    *,
    proportional: float = 1.0,
    integral: float = 1.0,
    kick: float = KICK,
    tolerance: float = 1e-3,
) -> Onset | None:
    """Bisect the factor on the gains at which the oscillation begins to grow, to `tolerance` of itself.

    Starts 6 % below and 5 % above `guess` and widens until one decays and the other grows; None if that does not happen
    between a tenth and ten times of it. `proportional` and `integral` weigh the factor on Kp and Ki. Where encoders
    round or friction acts, a limit cycle smaller than the kick is no growth.
    """
    floor = _STILL if _is_smooth(rig) else kick

    def tried(factor: float) -> Ring | None:
        """None: the motion is no longer finite."""
        try:
            return ring(rig, effects, q, proportional=factor * proportional, integral=factor * integral, kick=kick)
        except SimulationError:
            return None

    def grows(found: Ring | None) -> bool:
        return found is None or found.grows(floor)

    low, high = 0.94 * guess, 1.05 * guess
    above = tried(high)
    while grows(below := tried(low)):
        low, high, above = 0.7 * low, low, below
        if low < 0.1 * guess:
            return None
    while not grows(above):
        low, high = high, 1.3 * high
        if high > 10.0 * guess:
            return None
        above = tried(high)
    while high - low > tolerance * low:
        middle = 0.5 * (low + high)
        found = tried(middle)
        if grows(found):
            high, above = middle, found
        else:
            low = middle
    frequency = float("nan") if above is None else above.frequency
    return Onset(0.5 * (low + high), 0.5 * (high - low), frequency)


def _is_smooth(rig: Rig) -> bool:
    given = rig.quantities()
    return all(np.array_equal(q.value, given[name].value) for name, q in smooth_rig(rig).quantities().items())


def _with_gains(rig: Rig, controller: Controller, proportional: float, integral: float) -> Rig:
    gains = {controller.Kp.name: proportional * controller.Kp.value, controller.Ki.name: integral * controller.Ki.value}
    gained = substitute(rig, dict(gains))
    assert gained.controller is not None
    return replace(gained, controller=replace(gained.controller, loop="closed"))


def _angles(blocks: Iterator[tuple[str, Block]]) -> Iterator[Array]:
    for name, block in blocks:
        if name == "angle":
            yield block.values


def _rms(values: Array) -> Array:
    rms: Array = np.sqrt(np.mean(detrend(values, axis=0) ** 2, axis=0))
    return rms
