"""From noise-free results to what recorders saw: cross-coupling, bias, drift, noise, codes and clocks.

Every random stream has its own generator, spawned from the recording's seed, and is drawn sample
after sample, so that a shorter recording is the beginning of a longer one, bit by bit.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from engine.encoders import PERFECT, Encoders
from engine.hardware import AXES, Array, Hardware
from engine.laboratory import QUIET, Laboratory
from engine.ports import NONE, Extra
from engine.simulation import TIME_STEP, integrate, sample
from engine.trajectories import Commands

# 1/f noise: the spectrum of white noise doubles here, Hz.
PINK_CORNER = 0.05
_PINK_POLES = PINK_CORNER * 4.0 ** -np.arange(-1, 6)  # Hz; a sum of first-order lags, two octaves apart

# From run to run.
FRICTION_SPREAD = 0.02  # of b_m, d0, d1 and Ts0: lubricant and temperature
BIAS_SPREAD = 0.02  # of the bias's sigma, between runs of one set-up
DRIFT_SPREAD = 0.005  # of the bias's sigma: warming up, over a run
DRIFT_TIME = 300.0  # s

# Recorders: a clock reads t (1 + skew) + offset; a message arrives `latency` after its instant.
CLOCK_OFFSET = 3e-3  # s, standard deviation
CLOCK_SKEW = 3e-6  # standard deviation
LATENCY_LEAST, LATENCY_MOST, LATENCY_MEAN = 0.2e-3, 2e-3, 0.4e-3  # s


class Clock(NamedTuple):
    """A recorder's clock."""

    offset: float  # s
    skew: float
    phase: float  # s, of its ticks


@dataclass(frozen=True, slots=True, eq=False)
class Stream:
    """One topic's messages."""

    stamp: NDArray[np.int64]  # (n,) ns, the sensor's clock
    log: NDArray[np.int64]  # (n,) ns, the recorder's clock, increasing
    values: Array  # (n, c)

    def without(self, start_s: float, end_s: float) -> Stream:
        """Return the stream with a gap (s after its first message)."""
        t = (self.stamp - self.stamp[0]) * 1e-9
        kept = (t < start_s) | (t >= end_s)
        return Stream(self.stamp[kept], self.log[kept], self.values[kept])


@dataclass(frozen=True, slots=True, eq=False)
class Recording:
    """What the recorder of the test bench writes: raw wrench, encoder codes, commands and field."""

    wrench: Stream  # (n, 6) N and N m, raw
    encoder: Stream  # (n, 2) rad
    command: Stream  # (n, 4) rad and rad/s: az, el, az rate, el rate
    field: Stream  # (n, 2) motor rad
    hardware: Hardware  # as it was in this run
    drift: Array  # (6,) N and N m, how far the zero wanders until the end of warming up
    wrench_clock: Clock
    encoder_clock: Clock

    def with_gap(self, stream: str, start_s: float, end_s: float) -> Recording:
        """Return the recording without a stretch of "wrench" or "encoder"."""
        if stream == "wrench":
            return replace(self, wrench=self.wrench.without(start_s, end_s))
        return replace(self, encoder=self.encoder.without(start_s, end_s))


def record(
    hardware: Hardware,
    commands: Commands,
    *,
    seed: int,
    epoch_ns: int,
    wrench_hz: float = 100.0,
    encoder_hz: float = 100.0,
    time_step: float = TIME_STEP,
    laboratory: Laboratory = QUIET,
    encoders: Encoders = PERFECT,
    over_a_turn: Array | None = None,
) -> Recording:
    """Simulate one run and record it. The same arguments give the same recording, bit by bit.

    `over_a_turn` is what was drawn of the `encoders`; without it they only round.
    """
    run, clocks, noise, *others = (np.random.default_rng(s) for s in np.random.SeedSequence(seed).spawn(10))
    arrivals, (chance, looped, recorded) = others[:4], others[4:]
    hardware = vary(hardware, run)
    wrench_clock, encoder_clock = draw_clock(clocks, wrench_hz), draw_clock(clocks, encoder_hz)
    duration = float(commands.t[-1])
    extra = Extra(disturbance=laboratory.disturbance(duration, chance))
    reads = [None if over_a_turn is None else encoders.change(over_a_turn, rng) for rng in (looped, recorded)]
    dense = integrate(hardware, commands, time_step=time_step, extra=replace(extra, encoder=reads[0]))
    wrench_reading, wrench_t = ticks(wrench_clock, wrench_hz, duration)
    encoder_reading, encoder_t = ticks(encoder_clock, encoder_hz, duration)
    result = sample(hardware, dense, wrench_t, encoder_t, extra=replace(extra, encoder=reads[1]))
    drift = DRIFT_SPREAD * hardware.sigmas["transducer.bias"] * run.standard_normal(6)
    raw = read_transducer(hardware, wrench_t, result.wrench, drift, noise)
    command_values = np.hstack([commands.position, commands.rate])
    return Recording(
        wrench=stream(epoch_ns, wrench_reading, wrench_t, raw, arrivals[0]),
        encoder=stream(epoch_ns, encoder_reading, encoder_t, result.encoder, arrivals[1]),
        command=stream(epoch_ns, commands.t, commands.t, command_values, arrivals[2]),
        field=stream(epoch_ns, dense.field_t, dense.field_t, dense.field, arrivals[3]),
        hardware=hardware,
        drift=drift,
        wrench_clock=wrench_clock,
        encoder_clock=encoder_clock,
    )


def vary(hardware: Hardware, rng: np.random.Generator) -> Hardware:
    """Return the hardware as one run meets it: friction and bias a little different."""
    changed: dict[str, Array] = {}
    for axis in AXES:
        for name in ("b_m", "d0", "d1", "Ts0"):
            key = f"joint.{axis}.drive.{name}"
            changed[key] = hardware[key] * (1 + FRICTION_SPREAD * rng.uniform(-1, 1))
    sigma = hardware.sigmas["transducer.bias"]
    changed["transducer.bias"] = hardware["transducer.bias"] + BIAS_SPREAD * sigma * rng.standard_normal(6)
    return hardware.with_values(changed)


def read_transducer(
    hardware: Hardware, t: Array, wrench: Array, drift: Array, rng: np.random.Generator, *, extra: Extra = NONE
) -> Array:
    """Return raw = (I + X) w + bias + drift + noise, rounded to the resolution; shape (n, 6).

    `drift` (6,) is how far the zero wanders until the end of warming up.
    """
    coupled = wrench @ (np.eye(6) + hardware["transducer.cross_coupling"]).T
    if extra.transducer is not None:
        coupled = coupled + extra.transducer(t, coupled)
    wandering = drift * (1 - np.exp(-t / DRIFT_TIME))[:, None]
    noise = hardware["transducer.noise"] * coloured(rng, len(t), 1.0 / (t[1] - t[0]))
    raw = coupled + hardware["transducer.bias"] + wandering + noise
    step = hardware["transducer.resolution"]
    return np.asarray(np.round(raw / step) * step)


def coloured(rng: np.random.Generator, n: int, rate: float) -> Array:
    """White noise of unit variance plus 1/f noise below PINK_CORNER, shape (n, 6).

    The 1/f part is a sum of first-order lags a factor 4 apart in frequency, of equal variance each,
    which is 1/f within a few per cent between the first and the last; see test_engine_sensors.py.
    """
    normal = rng.standard_normal((n, 6, 1 + len(_PINK_POLES)))
    total = np.asarray(normal[:, :, 0])
    # Equal variances v a factor 4 apart in frequency: density v/(f ln 4); white: 2/rate.
    level = np.sqrt(2.0 / rate * PINK_CORNER * np.log(4.0))
    for k, pole in enumerate(_PINK_POLES):
        a = np.exp(-2 * np.pi * pole / rate)
        start = _stationary(normal[0, :, k + 1], a)
        lag, _ = lfilter([np.sqrt(1 - a**2)], [1.0, -a], normal[:, :, k + 1], axis=0, zi=start)
        total = total + level * lag
    return total


def _stationary(first: Array, a: float) -> Array:
    """Filter state that makes a lag of unit variance stationary, from its own first sample."""
    return ((1 - np.sqrt(1 - a**2)) * first)[None, :]


def draw_clock(rng: np.random.Generator, rate: float) -> Clock:
    """Draw a recorder's clock with `rate` ticks a second."""
    offset, skew = rng.normal(0.0, CLOCK_OFFSET), rng.normal(0.0, CLOCK_SKEW)
    return Clock(offset, skew, float(np.round(rng.uniform(0.0, 1.0 / rate), 6)))


def ticks(clock: Clock, rate: float, duration: float) -> tuple[Array, Array]:
    """Return readings of the clock at its ticks, and the true instants of these, within the run."""
    reading = clock.phase + np.arange(-100, round((duration + 1) * rate)) / rate
    t = (reading - clock.offset) / (1 + clock.skew)
    inside = (t >= 0) & (t <= duration)
    return reading[inside], t[inside]


def stream(epoch_ns: int, reading: Array, t: Array, values: Array, rng: np.random.Generator) -> Stream:
    """Stamp messages with what the clock read, s, and with when they arrived after t, s."""
    spread = rng.exponential(LATENCY_MEAN, len(t))
    latency = np.minimum(LATENCY_LEAST + spread, LATENCY_MOST)
    log = epoch_ns + 1000 * np.round((t + latency) * 1e6).astype(np.int64)
    stamp = epoch_ns + np.round(reading * 1e9).astype(np.int64)
    return Stream(stamp, np.maximum.accumulate(log), values)
