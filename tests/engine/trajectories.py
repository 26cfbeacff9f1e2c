"""The paper's test trajectories (table 2) and sweeps of configuration 1: desired angle and rate, one a real-time cycle.

Each axis follows a list of stretches of constant acceleration, so that positions and rates are
exact and limits can be read off. Numbers in this file are in degrees; commands are in radians.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from engine.hardware import Array

CYCLE = 0.1  # s
RATE_LIMIT = 2.0  # deg/s
ACCELERATION_LIMIT = 0.015  # deg/s^2, in normal operation
# The controller's words are fixed-point: 1/8000 of a microstep in position, 1e-8 rad/s in rate.
_POSITION_BIT, _RATE_BIT = 2.0**-24, 2.0**-26  # rad, rad/s
RANGE = {"az": (-165.0, 165.0), "el": (-30.0, 90.0)}  # deg


@dataclass(frozen=True, slots=True, eq=False)
class Commands:
    """Desired angles and rates, one row a real-time cycle."""

    t: Array  # (n,) s
    position: Array  # (n, 2) rad: az, el
    rate: Array  # (n, 2) rad/s

    def until(self, t: float) -> Commands:
        """Return the commands up to and including time t."""
        keep = self.t <= t + 1e-9
        return Commands(self.t[keep], self.position[keep], self.rate[keep])


@dataclass(frozen=True, slots=True)
class Axis:
    """One axis's profile: where it starts, then stretches (duration s, acceleration deg/s^2)."""

    start: float  # deg
    stretches: tuple[tuple[float, float], ...] = ()

    def rest(self, duration: float) -> Axis:
        """Keep the present rate (zero after a move) for `duration`."""
        return replace(self, stretches=(*self.stretches, (duration, 0.0)))

    def accelerate(self, rate: float, acceleration: float = ACCELERATION_LIMIT) -> Axis:
        """Change to `rate` (deg/s) at a constant acceleration."""
        change = rate - self.now()[1]
        stretch = (abs(change) / acceleration, float(np.copysign(acceleration, change)))
        return replace(self, stretches=(*self.stretches, stretch))

    def move(self, distance: float, rate: float = RATE_LIMIT, acceleration: float = ACCELERATION_LIMIT) -> Axis:
        """Move by `distance` (deg) from rest to rest: accelerate, coast at `rate` if reached, brake."""
        peak = min(rate, float(np.sqrt(abs(distance) * acceleration)))
        ramp = peak / acceleration
        coast = abs(distance) / peak - ramp
        a = float(np.copysign(acceleration, distance))
        return replace(self, stretches=(*self.stretches, (ramp, a), (coast, 0.0), (ramp, -a)))

    def now(self) -> tuple[float, float]:
        """Position (deg) and rate (deg/s) after the last stretch."""
        position, rate = self.start, 0.0
        for duration, a in self.stretches:
            position += rate * duration + 0.5 * a * duration**2
            rate += a * duration
        return position, rate

    def duration(self) -> float:
        """Time until the end of the last stretch, s."""
        return sum(duration for duration, _ in self.stretches)

    def stopped(self, t: float, acceleration: float = ACCELERATION_LIMIT) -> Axis:
        """Cut the profile at time t and ramp its rate to zero: the controller's stop mode."""
        kept: list[tuple[float, float]] = []
        left = t
        for duration, a in self.stretches:
            kept.append((min(duration, left), a))
            left -= duration
            if left <= 0:
                break
        return replace(self, stretches=tuple(kept)).accelerate(0.0, acceleration)

    def sampled(self, t: Array) -> tuple[Array, Array]:
        """Position (deg) and rate (deg/s) at times t."""
        position, rate = np.empty_like(t), np.empty_like(t)
        x, v, begin = self.start, 0.0, 0.0
        for duration, a in (*self.stretches, (np.inf, 0.0)):
            inside = t >= begin
            s = t[inside] - begin
            position[inside] = x + v * s + 0.5 * a * s**2
            rate[inside] = v + a * s
            if np.isfinite(duration):
                x, v, begin = x + v * duration + 0.5 * a * duration**2, v + a * duration, begin + duration
                v = 0.0 if abs(v) < 1e-12 else v
        return position, rate


def commands(az: Axis, el: Axis, duration: float) -> Commands:
    """Sample both axes once a real-time cycle, from 0 to `duration` (s).

    Raises ValueError beyond the axes' range or rate.
    """
    t = CYCLE * np.arange(round(duration / CYCLE) + 1)
    sampled = [az.sampled(t), el.sampled(t)]
    position, rate = (np.column_stack([axis[k] for axis in sampled]) for k in (0, 1))
    for name, column in zip(RANGE, position.T, strict=True):
        low, high = RANGE[name]
        if column.min() < low or column.max() > high:
            raise ValueError(f"{name} runs from {column.min():.2f} to {column.max():.2f} deg")
    if np.abs(rate).max() > RATE_LIMIT * (1 + 1e-9):
        raise ValueError(f"rate of {np.abs(rate).max():.3f} deg/s")
    return Commands(t, _fixed_point(position, _POSITION_BIT), _fixed_point(rate, _RATE_BIT))


def _fixed_point(degrees: Array, bit: float) -> Array:
    return np.asarray(np.round(np.radians(degrees) / bit) * bit)


def azps_ata() -> Commands:
    """Pseudo-static azimuth sweeps at elevations 70, 78.5 and 87 deg: calibration, CoG, orthogonality.

    Sweeps over +-150 deg at 0.015 deg/s^2 would take 800 s. Here, out of the flight's envelope, at
    0.15 deg/s^2 and up to 2 deg/s: the motion's own wrench stays below a few mN and mN m.
    """
    quick = 0.15  # deg/s^2
    az, el = Axis(-150.0).rest(5.0), Axis(70.0).rest(5.0)
    for sweep, elevation in ((300.0, 78.5), (-150.0, 87.0), (-150.0, None)):
        az = az.move(sweep, acceleration=quick).rest(3.0)
        el = el.rest(az.duration() - el.duration())
        if elevation is not None:
            el = el.move(elevation - el.now()[0], acceleration=quick).rest(3.0)
            az = az.rest(el.duration() - az.duration())
    return commands(az, el, az.duration())


def _rests(start: float, turn: float, rest: float, quick: float) -> Commands:
    """Rests (s) at elevations 70, 78.5 and 87 deg at each of three azimuths; `quick` in deg/s^2 between them."""
    az, el = Axis(start), Axis(70.0).rest(rest)
    for by, step in ((turn, 8.5), (turn, -8.5), (0.0, 8.5)):
        for _ in range(2):
            el = el.move(step, acceleration=quick).rest(rest)
        if by:
            az = az.rest(el.duration() - az.duration()).move(by, acceleration=quick)
            el = el.rest(az.duration() - el.duration() + rest)
    return commands(az, el, el.duration())


def azps_rests() -> Commands:
    """Rests of 8 s at nine poses, azimuths 120 deg apart."""
    return _rests(-120.0, 120.0, 8.0, 0.4)


def azps_short() -> Commands:
    """Rests of 5 s at nine poses, azimuths 60 deg apart."""
    return _rests(0.0, 60.0, 5.0, 1.0)


def _aesing() -> tuple[Axis, Axis]:
    az = Axis(-60.0).rest(10.0).move(120.0)
    half = np.sqrt(120.0 / ACCELERATION_LIMIT)  # s: azimuth is fastest when elevation is highest
    a = 4 * 9.0 / half**2
    el = Axis(80.0).rest(10.0).move(9.0, acceleration=a).move(-9.0, acceleration=a)
    return az, el


def aesing00() -> Commands:
    """A pass close to the singularity: el 80 to 89 deg and back, az -60 to 60 deg, fastest on top."""
    return commands(*_aesing(), 200.0)


def aestpp00() -> Commands:
    """AESING00 with a stop just after the greatest elevation rate."""
    az, el = _aesing()
    return commands(az.stopped(70.0), el.stopped(70.0), 150.0)


def _el089() -> tuple[Axis, Axis]:
    return Axis(0.0), Axis(70.0).rest(60.0).move(17.0, rate=0.3)


def el089p00() -> Commands:
    """Elevation pre-pointing, 70 to 87 deg at 0.3 deg/s and 0.015 deg/s^2, between rests; 200 s."""
    return commands(*_el089(), 200.0)


def el089_az90() -> Commands:
    """Elevation 70 to 87 deg as fast as 0.015 deg/s^2 lets it, azimuth at 90 deg: gravity's torque moves on Tx."""
    return commands(Axis(90.0), Axis(70.0).rest(20.0).move(17.0), 110.0)


def elstpp00() -> Commands:
    """EL089P00 with a stop in the middle of the coasting part."""
    az, el = _el089()
    return commands(az, el.stopped(98.0), 150.0)


def acq600() -> Commands:
    """Hand-over at high elevation: track one relay satellite slowly, slew to the other, track that one."""
    az = Axis(-35.0).rest(20.0).accelerate(0.06).rest(36.0).accelerate(0.0).move(70.0, rate=1.0)
    az = az.accelerate(-0.03).rest(60.0)
    el = Axis(74.0).rest(20.0).accelerate(0.03).rest(38.0).accelerate(0.0).move(10.0, rate=0.4)
    return commands(az, el.accelerate(0.02).rest(60.0), 240.0)


def acq600_far() -> Commands:
    """Pre-pointing from one relay satellite to the other, 270 deg apart.

    Azimuth turns at 1.6 deg/s: two a motor turn are then 0.89 Hz, nearly as fast as the band of 1 Hz shows.
    """
    az = Axis(-135.0).rest(10.0).move(270.0, rate=1.6).rest(10.0)
    return commands(az, Axis(76.0).rest(60.0).move(8.0), az.duration())


_BUNGEE_ACCELERATION = 0.25  # deg/s^2: the paper, too, left the flight's limit to reach 2 deg/s within +-12 deg


def _al012() -> tuple[Axis, Axis]:
    az = Axis(-12.0).rest(15.0)
    for sweep in range(4):
        az = az.move(24.0 if sweep % 2 == 0 else -24.0, acceleration=_BUNGEE_ACCELERATION).rest(8.0)
    return az, Axis(0.0)


def al012m00() -> Commands:
    """Azimuth between -12 and 12 deg at up to 2 deg/s, elevation 0, on the bungee."""
    az, el = _al012()
    return commands(az, el, az.duration())


def alstpp00() -> Commands:
    """AL012M00 with a stop in the middle of the third sweep."""
    az, el = _al012()
    return commands(az.stopped(81.0, _BUNGEE_ACCELERATION), el, 105.0)


def _sweep(start: float, peak: float) -> Axis:
    """Rates 0 to `peak`, through zero to -`peak`, back to 0, in 120 s: every order of the motor, both ways."""
    acceleration = abs(peak) / 30.0
    return (
        Axis(start)
        .rest(3.0)
        .accelerate(peak, acceleration)
        .accelerate(-peak, acceleration)
        .accelerate(0.0, acceleration)
    )


def swpaz000() -> Commands:
    """Rate sweeps of both axes, azimuth to 0.9 deg/s, elevation 31 to 40 deg; beyond the flight's accelerations."""
    return commands(_sweep(-10.0, 0.9), _sweep(40.0, -0.6), 125.0)


def swpel000() -> Commands:
    """Rate sweeps of both axes, elevation to 0.9 deg/s between 60 and 73.5 deg."""
    return commands(_sweep(10.0, -0.6), _sweep(60.0, 0.9), 125.0)


def trkl0000() -> Commands:
    """Slow tracking with a reversal of each axis, at the accelerations of normal operation."""
    az = Axis(20.0).rest(3.0).accelerate(0.12).rest(20.0).accelerate(-0.3).rest(20.0).accelerate(0.0)
    el = Axis(45.0).rest(5.0).accelerate(0.35).rest(15.0).accelerate(-0.1).rest(15.0).accelerate(0.0)
    return commands(az, el, 110.0)


TRAJECTORIES: dict[str, Callable[[], Commands]] = {
    "AZPS_ATA": azps_ata,
    "AESING00": aesing00,
    "AESTPP00": aestpp00,
    "EL089P00": el089p00,
    "ELSTPP00": elstpp00,
    "ACQ600": acq600,
    "AL012M00": al012m00,
    "ALSTPP00": alstpp00,
    "SWPAZ000": swpaz000,
    "SWPEL000": swpel000,
    "TRKL0000": trkl0000,
    "AZPS_RESTS": azps_rests,
    "AZPS_SHORT": azps_short,
    "EL089_AZ90": el089_az90,
    "ACQ600_FAR": acq600_far,
}
