"""Laws of concealed physics in controller, sensors and clocks: changes of what they do or show."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from enum import StrEnum

import numpy as np
from scipy.signal import lfilter

from engine.hardware import AXES, Array, Hardware
from engine.ports import Extra

CHANNELS = ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz")

_STEP = 0.02  # of a channel's span: over which a converter's step is smeared by what feeds it


class Sense(StrEnum):
    """Laws by name; A is the amplitude, s are shapes, span is a channel's range in the fit recordings."""

    FIELD_LAG = "the field stays behind by A s at the present rate"
    LATE_CYCLES = "in every s0-th cycle, the share A of the way is made up for in the cycle after"
    S_SHAPE = "A s1 span v/sqrt(1 + v^2), v = ((reading - low)/span - s0)/s1"
    PLAY = "A span times a play operator of travel s0 span, over that travel"
    WARMING = "A noise (1 - exp(-t/s0)) (1 + t/(4 s0))^-1/2"
    CREEP = "-A (reading - lag of it over s0)"
    PRODUCT = "A noise (u^2 - 1/3), u from -1 to 1 over the acting channel's span"
    STEP = "A noise (logistic step at s0 of the span)"
    ECCENTRIC = "A (sin(th + s0) + s1 sin(2 th + 2 s0))"
    INTERPOLATION = "A sin(u + s1 sin u), u = s0 th + s2"
    SAWTOOTH = "A (u/pi), u = wrap(s0 th + s1)"
    DIRECTION = "A w/(|w| + s0)"
    JUMP = "A s after s0 of the recording, within 1 s"
    WANDER = "A sin(2 pi t/s0 + s1)"
    CLOCK_WARMING = "A s0 (1 - exp(-t/s0))"


Law = tuple[Sense, str, float, tuple[float, ...]]  # law, place, amplitude, shapes
ON_FIELD = (Sense.FIELD_LAG, Sense.LATE_CYCLES)
ON_ENCODER = (Sense.ECCENTRIC, Sense.INTERPOLATION, Sense.SAWTOOTH, Sense.DIRECTION)
ON_CLOCK = (Sense.JUMP, Sense.WANDER, Sense.CLOCK_WARMING)


def extra(laws: Sequence[Law], hardware: Hardware, spans: Array, duration: float) -> Extra:
    """All of them at the engine's ports."""
    field = [law for law in laws if law[0] in ON_FIELD]
    encoder = [law for law in laws if law[0] in ON_ENCODER]
    clock = [law for law in laws if law[0] in ON_CLOCK]
    channel = [law for law in laws if law[0] not in (*ON_FIELD, *ON_ENCODER, *ON_CLOCK)]

    def drive(k: int, before: Array, after: Array) -> Array:
        return _field(field, hardware, k, before, after)

    def shown(t: Array, angles: Array, rates: Array) -> Array:
        return _encoder(encoder, angles, rates)

    def read(t: Array, wrench: Array) -> Array:
        return _channels(channel, t, wrench, hardware["transducer.noise"], spans)

    return Extra(
        drive=drive if field else None,
        encoder=shown if encoder else None,
        transducer=read if channel else None,
        clocks={place: _clock(law, s, A, duration) for law, place, A, s in clock},
    )


def _field(laws: Sequence[Law], hardware: Hardware, k: int, before: Array, after: Array) -> Array:
    change = np.zeros(2)
    for law, place, A, s in laws:
        axis = AXES.index(place)
        travel = after[axis] - before[axis]
        if law == Sense.FIELD_LAG:
            change[axis] -= A / hardware.scalar("controller.cycle") * travel
        elif k % int(s[0]) == int(s[0]) - 1:
            change[axis] -= A * travel
    return change


def _encoder(laws: Sequence[Law], angles: Array, rates: Array) -> Array:
    change = np.zeros_like(angles)
    for law, place, A, s in laws:
        axis = AXES.index(place)
        th, w = angles[:, axis], rates[:, axis]
        if law == Sense.ECCENTRIC:
            error = np.sin(th + s[0]) + s[1] * np.sin(2 * (th + s[0]))
        elif law == Sense.INTERPOLATION:
            u = s[0] * th + s[2]
            error = np.sin(u + s[1] * np.sin(u))
        elif law == Sense.SAWTOOTH:
            error = ((s[0] * th + s[1] + np.pi) % (2 * np.pi) - np.pi) / np.pi
        else:
            error = w / (np.abs(w) + s[0])
        change[:, axis] += A * error
    return change


def _channels(laws: Sequence[Law], t: Array, wrench: Array, noise: Array, spans: Array) -> Array:
    change = np.zeros_like(wrench)
    dt = float(t[1] - t[0])
    for law, place, A, s in laws:
        reads, _, acts = place.partition("<-")
        row = CHANNELS.index(reads)
        low, high = spans[CHANNELS.index(acts or reads)]
        span = max(high - low, 10 * noise[row])
        x = wrench[:, CHANNELS.index(acts or reads)]
        u = (x - low) / span
        if law == Sense.S_SHAPE:
            v = (u - s[0]) / s[1]
            change[:, row] += A * span * s[1] * v / np.sqrt(1 + v * v)
        elif law == Sense.PLAY:
            change[:, row] += A * span * _play(u / s[0])
        elif law == Sense.WARMING:
            change[:, row] += A * noise[row] * (1 - np.exp(-t / s[0])) / np.sqrt(1 + t / (4 * s[0]))
        elif law == Sense.CREEP:
            a = np.exp(-dt / s[0])
            lag, _ = lfilter([1 - a], [1, -a], x, zi=[a * x[0]])
            change[:, row] -= A * (x - lag)
        elif law == Sense.PRODUCT:
            change[:, row] += A * noise[row] * ((2 * u - 1) ** 2 - 1 / 3)
        else:
            change[:, row] += A * noise[row] * 0.5 * (1 + np.tanh((u - s[0]) / _STEP))
    return change


def _play(x: Array) -> Array:
    """Deviation of a play operator of half width 1 from its input, from -1 to 1."""
    out = np.empty_like(x)
    at = float(x[0])
    for k, value in enumerate(x.tolist()):
        at = min(max(at, value - 1.0), value + 1.0)
        out[k] = at - value
    return out


def _clock(law: Sense, s: tuple[float, ...], A: float, duration: float) -> Callable[[Array], Array]:
    def jump(t: Array) -> Array:
        return A * np.clip(t - s[0] * duration, 0.0, 1.0)

    def wander(t: Array) -> Array:
        return A * np.sin(2 * np.pi * t / s[0] + s[1])

    def warming(t: Array) -> Array:
        return A * s[0] * (1 - np.exp(-t / s[0]))

    return {Sense.JUMP: jump, Sense.WANDER: wander, Sense.CLOCK_WARMING: warming}[law]
