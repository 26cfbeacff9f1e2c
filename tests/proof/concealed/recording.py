"""One recorded run of a trial: hardware a little different from run to run, physics concealed, a noisy laboratory, and
clocks that jitter."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from engine import sensors
from engine.hardware import AXES, Array, Hardware
from engine.laboratory import QUIET, Laboratory
from engine.ports import Extra
from engine.sensors import Recording, Stream
from engine.simulation import TIME_STEP, integrate, sample
from engine.trajectories import Commands
from proof.concealed.ranges import RUN_TO_RUN, STAMP_JITTER


def vary(hardware: Hardware, rng: np.random.Generator) -> Hardware:
    """Return the hardware as one run meets it: friction, temperature, zero and inclination a little different."""
    hardware = sensors.vary(hardware, rng)
    warmth = 1 + RUN_TO_RUN["temperature"] * rng.standard_normal()
    changed: dict[str, Array] = {
        f"joint.{axis}.drive.{name}": hardware[f"joint.{axis}.drive.{name}"] * warmth
        for axis in AXES
        for name in ("b_m", "d0")
    }
    changed["transducer.tilt"] = hardware["transducer.tilt"] + RUN_TO_RUN["tilt"] * rng.standard_normal(2)
    return hardware.with_values(changed)


def record(
    hardware: Hardware,
    path: Commands,
    extra: Extra,
    *,
    seed: np.random.SeedSequence,
    epoch_ns: int,
    wrench_hz: float,
    encoder_hz: float,
    laboratory: Laboratory = QUIET,
    stamp_jitter: float = STAMP_JITTER,
    time_step: float = TIME_STEP,
) -> Recording:
    """Simulate one run with what is concealed, and record it. The same arguments give the same bits."""
    run, clocks, noise, jitter, *arrivals, chance = (np.random.default_rng(s) for s in seed.spawn(9))
    hardware = vary(hardware, run)
    wrench_clock, encoder_clock = (sensors.draw_clock(clocks, wrench_hz), sensors.draw_clock(clocks, encoder_hz))
    duration = float(path.t[-1])
    extra = replace(extra, disturbance=laboratory.disturbance(duration, chance))
    dense = integrate(hardware, path, time_step=time_step, extra=extra)
    wrench_reading, wrench_t = sensors.ticks(wrench_clock, wrench_hz, duration)
    encoder_reading, encoder_t = sensors.ticks(encoder_clock, encoder_hz, duration)
    result = sample(hardware, dense, wrench_t, encoder_t, extra=extra)
    drift = sensors.DRIFT_SPREAD * hardware.sigmas["transducer.bias"] * run.standard_normal(6)
    raw = sensors.read_transducer(
        hardware, wrench_t, result.wrench, drift, noise, extra=_with_hum(extra, laboratory, hardware, chance)
    )
    streams = {
        "wrench": (
            _stamped("wrench", wrench_reading, wrench_t, extra, stamp_jitter, jitter),
            _by_clock("wrench", wrench_t, extra),
            raw,
        ),
        "encoder": (
            _stamped("encoder", encoder_reading, encoder_t, extra, stamp_jitter, jitter),
            _by_clock("encoder", encoder_t, extra),
            result.encoder,
        ),
        "command": (path.t, path.t, np.hstack([path.position, path.rate])),
        "field": (dense.field_t, dense.field_t, dense.field),
    }
    made: dict[str, Stream] = {
        name: sensors.stream(epoch_ns, *columns, rng)
        for (name, columns), rng in zip(streams.items(), arrivals, strict=True)
    }
    return Recording(**made, hardware=hardware, drift=drift, wrench_clock=wrench_clock, encoder_clock=encoder_clock)


def _with_hum(extra: Extra, laboratory: Laboratory, hardware: Hardware, rng: np.random.Generator) -> Extra:
    """Let mains act on the transducer's channels beside what does."""

    def change(t: Array, wrench: Array) -> Array:
        hum = laboratory.hum(t, hardware["transducer.noise"], rng)
        return hum if extra.transducer is None else hum + extra.transducer(t, wrench)

    return replace(extra, transducer=change)


def _stamped(name: str, reading: Array, t: Array, extra: Extra, jitter: float, rng: np.random.Generator) -> Array:
    """What the clock reads, with its jitter (s, one sigma); never backwards."""
    read = reading + jitter * rng.standard_normal(len(t))
    return np.asarray(np.maximum.accumulate(read + _by_clock(name, t, extra) - t))


def _by_clock(name: str, t: Array, extra: Extra) -> Array:
    """Instants as a clock that does something has them.

    Messages arrive by it too: else the times at which they were logged would tell what it does, beside all physics.
    """
    return t + extra.clocks[name](t) if name in extra.clocks else t
