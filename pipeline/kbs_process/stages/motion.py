"""Joint angles, rates and accelerations from what a rig records: encoder, command, or a measured rate.

A slow joint's encoder repeats one code for many samples: its error is then no noise that a filter averages, and gravity
turns it into a torque error. The command is smooth but is not where the joint is. The two together,
q = command + lowpass(encoder - command), keep the command's smoothness above the corner of that low-pass and the
encoder's truth below; the corner is the one with the least estimated error. A joint that no encoder reads is where the
command is, within what its gear gives way by.

The wrench passes an amplifier that delays it and the encoders do not. At 2 deg/s, 10 ms turn 10 N m of gravity into an
error of 3 mN m that changes its sign with the rate's. So angles are given as the delayed wrench shows them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.interpolate import CubicSpline

from kbs_process.errors import RecordingError
from kbs_process.rig.model import Joint, Rig
from kbs_process.signals.records import Array, Events, Mask, Run, Signal
from kbs_process.signals.smoothing import Index, kernel_length, smooth, smooth_rows

Source = Literal["auto", "encoder", "command+encoder", "rate"]
_CORNERS = (0.05, 0.1, 0.2, 0.5)  # Hz, of the low-pass on encoder - command
# Of an encoder code, over which its rounding error is averaged. A joint at rest reads a whole code: half a code from it
# the last digit of its angle would say which way it is rounded.
_PHASES = (0.125, 0.375, 0.625, 0.875)
# rad rms, by which a joint that nobody reads is off its command: a gear of 2e4 N m/rad gives way by as much under
# 10 N m. Of EL089, elevation under its gravity is 6e-4 off, azimuth 1e-4.
_COMMANDED = 5e-4
_OVERSAMPLING = 5  # encoder samples to one of the working rate, where its own rate is not known


@dataclass(frozen=True, slots=True)
class MotionSettings:
    """`band_Hz`: angles are low-passed there (see `signals.smoothing`) before they are differentiated."""

    band_Hz: float = 2.0
    source: Source = "auto"


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """Angles of the joints, in the order of the rig's joints, nominal encoder offsets taken off.

    They are as late as the transducer's amplifier makes the wrench.
    """

    t0: float  # s
    dt: float  # s
    q: Array  # (n, joints) rad
    qd: Array  # (n, joints) rad/s
    qdd: Array  # (n, joints) rad/s^2
    sigma_q: Array  # (n, joints) rad, of both causes below
    rounding: Array  # (phases, n, joints) rad, how encoder rounding may have erred, for positions within a code
    missed: Array  # (joints,) rad rms, real motion that the source does not show
    offset: Array  # (joints,) rad, taken off the encoders' readings
    valid: Mask  # (n,)
    history: tuple[str, ...] = ()
    reach: float = 0.0  # s about a gap in which its low-passes show it

    def __len__(self) -> int:
        return len(self.q)

    @property
    def sigma_rounding(self) -> Array:
        """The part (n, joints) of `sigma_q` that is the encoders' rounding, rad."""
        return np.stack([rounding_error(of_joint, self.dt) for of_joint in self.rounding.T.swapaxes(1, 2)], axis=1)


@dataclass(frozen=True, slots=True, eq=False)
class _Angle:
    q: Array  # (n,) not yet low-passed
    rounding: Array  # (phases, n)
    missed: float
    sigma: Array  # (n,)
    how: str
    corner: float  # Hz, the lowest that it was low-passed at


def estimate(run: Run, rig: Rig, settings: MotionSettings = MotionSettings()) -> Motion:
    """Estimate the motion of every joint of `rig` over the run's time grid.

    Derivatives are exact for band-limited motion up to `band_Hz`; within 1 / band_Hz of the ends they rest on a
    straight continuation. `sigma_q` holds rounding and the part of the real motion that a source misses.
    Raises RecordingError where a joint has neither angle, rate nor command.
    """
    grid = run.angle or run.rate
    if grid is None:
        raise RecordingError(
            f"recording {run.name} has neither angles nor rates of the joints",
            remedy="name the encoder's topic in campaign.toml",
        )
    angles = [_joint_angle(run, joint, settings) for joint in rig.joints]
    q = np.stack([angle.q for angle in angles], axis=1)
    encoders = [joint.encoder for joint in rig.joints]
    offset = np.array([0.0 if encoder is None else float(encoder.offset) for encoder in encoders])
    delay = 0.0 if rig.transducer.amplifier is None else rig.transducer.amplifier.delay
    rates = [_column(run.rate, joint.name) if settings.source == "auto" else None for joint in rig.joints]
    each = [_derivatives(angle, rate, grid.dt, settings.band_Hz) for angle, rate in zip(angles, rates, strict=True)]
    moved = _later(smooth(q, grid.dt, settings.band_Hz), grid.dt, delay)
    rate, acceleration = (
        _later(np.stack([own[order] for own, _, _ in each], axis=1), grid.dt, delay) for order in (0, 1)
    )
    told = (f"{up_to:.3g} Hz" + ", by its measured rate" * rated for _, up_to, rated in each)
    return Motion(
        t0=grid.t0,
        dt=grid.dt,
        q=moved - offset,
        qd=rate,
        qdd=acceleration,
        sigma_q=np.stack([angle.sigma for angle in angles], axis=1),
        rounding=np.stack([angle.rounding for angle in angles], axis=2),
        missed=np.array([angle.missed for angle in angles]),
        offset=offset,
        valid=_valid(run, rig, grid, rated=any(rated for _, _, rated in each)),
        history=(
            *(f"{joint.name}: {angle.how}" for joint, angle in zip(rig.joints, angles, strict=True)),
            f"angles low-passed at {settings.band_Hz:g} Hz",
            f"and differentiated up to {'; '.join(told)}",
            *([f"angles delayed by {1e3 * delay:.1f} ms, as the amplifier delays the wrench"] if delay else []),
        ),
        # Tails of a kernel are below 1 % beyond the half of its length.
        reach=0.5 * grid.dt * kernel_length(min(angle.corner for angle in angles), grid.dt),
    )


def _derivatives(angle: _Angle, measured: Array | None, dt: float, band: float) -> tuple[Array, float, bool]:
    """Rate and acceleration (2, n) up to `band` Hz as far as they are resolved, to where, and if by a `measured` rate.

    By octaves, from the highest down: each is the angle's or the measured rate's, whichever errs less in acceleration.
    The angle errs by its rounding, and the rate by what else the two differ by. Left out are the octaves above the
    one above the first of which at least half of the power is no error: a low-pass takes some of the octave below it.
    """

    def up_to(f: float) -> tuple[Array, Array]:
        own = [[smooth(angle.q, dt, f, order) for order in (1, 2)]]
        if measured is not None:
            own.append([smooth(measured, dt, f, order) for order in (0, 1)])
        return np.array(own), smooth(angle.rounding.T, dt, f, 2)

    total, above, highest, rated = np.zeros((2, len(angle.q))), np.zeros((2, len(angle.q))), 0.0, False
    upper, noise = up_to(band)
    while True:
        last = kernel_length(0.5 * band, dt) > len(angle.q) // 2
        lower, quiet = (0.0 * upper, 0.0 * noise) if last else up_to(0.5 * band)
        octave, rounding = upper - lower, _rms(noise - quiet) ** 2
        errs = [rounding, *(max(_rms(other[1] - octave[0, 1]) ** 2 - rounding, 0.0) for other in octave[1:])]
        best = int(np.argmin(errs))
        if highest or last or _rms(octave[best, 1]) ** 2 >= 2.0 * errs[best]:
            total += (upper[0] if measured is None else octave[best]) + (0.0 if highest else above)
            highest, rated = highest or band, rated or best > 0
        if last or (highest and measured is None):
            return total, highest, rated
        above, upper, noise, band = octave[best], lower, quiet, 0.5 * band


def _valid(run: Run, rig: Rig, grid: Signal, *, rated: bool) -> Mask:
    """Where the joints' motion was measured: a joint's rate counts where it is used."""
    if run.rate is None or not (rated or run.angle is None or not set(rig.joint_names) <= set(run.angle.channels)):
        return grid.valid
    return grid.valid & run.rate.valid


def _later(values: Array, dt: float, delay: float) -> Array:
    """Delay channels (n, c) that are low-passed well below the sampling rate; the first value is held."""
    if delay == 0.0 or len(values) < 2:
        return values
    t = dt * np.arange(len(values))
    delayed: Array = CubicSpline(t, values)(np.maximum(t - delay, 0.0))
    return delayed


def _joint_angle(run: Run, joint: Joint, settings: MotionSettings) -> _Angle:
    measured = _column(run.angle, joint.name)
    rate = _column(run.rate, joint.name)
    source = settings.source
    if source == "rate" or (source == "auto" and measured is None):
        if rate is None or run.rate is None:
            grid = run.angle or run.rate
            alone = None if grid is None or run.command is None else _at(run.command, joint.name, grid.t)
            if source == "auto" and alone is not None:
                return _from_command(alone, settings.band_Hz)
            raise RecordingError(f"recording {run.name} has neither angle nor rate of joint '{joint.name}'")
        return _integrated(rate, run.rate.dt, settings.band_Hz)
    if measured is None or run.angle is None:
        raise RecordingError(f"recording {run.name} has no angle of joint '{joint.name}'")
    commanded = None if run.command is None else _at(run.command, joint.name, run.angle.t)
    encoder_rate = run.rates.get("angle", _OVERSAMPLING / run.angle.dt)
    step = 0.0 if joint.encoder is None else float(joint.encoder.step)
    if source == "encoder" or commanded is None:
        return _from_encoder(measured, run.angle.dt, step, encoder_rate, settings.band_Hz)
    return _from_both(measured, commanded, run.angle.dt, step, encoder_rate, settings)


def _column(signal: Signal | None, channel: str) -> Array | None:
    return None if signal is None or channel not in signal.channels else signal.column(channel)


def _at(events: Events, channel: str, t: Array) -> Array | None:
    """The command at the grid's times: linear between cycles, as the motor's field moves; held at the ends."""
    if channel not in events.channels or len(events.t) < 2:
        return None
    at: Array = np.interp(t, events.t, events.values[:, events.channels.index(channel)])
    return at


def _integrated(rate: Array, dt: float, band: float) -> _Angle:
    """Trapezoidal integral from zero; its error is the random walk of the noise that the band takes off."""
    q = np.concatenate([[0.0], np.cumsum(0.5 * dt * (rate[1:] + rate[:-1]))])
    noise = float(np.std(rate - smooth(rate, dt, band)))
    sigma = noise * dt * np.sqrt(np.arange(len(q)))
    return _Angle(q, np.zeros((len(_PHASES), len(q))), _rms(sigma), sigma, "integral of the measured rate", band)


def _from_encoder(measured: Array, dt: float, step: float, encoder_rate: float, band: float) -> _Angle:
    motion = smooth(measured, dt, band)
    rounding = rounding_histories(motion, dt, step, encoder_rate, band)
    sigma = rounding_error(rounding, dt)
    return _Angle(measured, rounding, 0.0, sigma, f"encoder alone, sigma {_rms(sigma):.2g} rad", band)


def _from_command(commanded: Array, band: float) -> _Angle:
    how = f"command alone, sigma {_COMMANDED:.2g} rad"
    sigma = np.full(len(commanded), _COMMANDED)
    return _Angle(commanded, np.zeros((len(_PHASES), len(commanded))), _COMMANDED, sigma, how, band)


def _from_both(
    measured: Array, commanded: Array, dt: float, step: float, encoder_rate: float, settings: MotionSettings
) -> _Angle:
    """Choose the corner with the least of (rounding error below it) + (real deviation lost above it).

    What is lost is the in-band power of encoder - command above the corner, less the rounding error's own there.
    """
    band = settings.band_Hz
    commanded = commanded - _lag(measured, commanded, dt, band) * smooth(commanded, dt, band, derivative=1)
    motion = commanded + smooth(measured - commanded, dt, band)
    in_band = rounding_error(rounding_histories(motion, dt, step, encoder_rate, band), dt)
    deviation = smooth(measured - commanded, dt, band)
    best = _from_encoder(measured, dt, step, encoder_rate, band)
    least = np.inf if settings.source == "command+encoder" else _rms(best.sigma)
    for corner in _CORNERS:
        if corner >= band or kernel_length(corner, dt) > len(measured) // 2:
            continue
        slow = smooth(measured - commanded, dt, corner)
        rounding = rounding_histories(commanded + slow, dt, step, encoder_rate, corner)
        known = rounding_error(rounding, dt)
        missed = _rms(deviation - slow) ** 2 - max(_rms(in_band) ** 2 - _rms(known) ** 2, 0.0)
        sigma = np.sqrt(known**2 + max(missed, 0.0))
        if _rms(sigma) < least:
            least = _rms(sigma)
            how = f"command and encoder, joined at {corner:g} Hz, sigma {least:.2g} rad"
            best = _Angle(commanded + slow, rounding, float(np.sqrt(max(missed, 0.0))), sigma, how, corner)
    return best


def _lag(measured: Array, commanded: Array, dt: float, band: float) -> float:
    """How much later (s) the joint does what the command says: least squares on the command's rate."""
    rate = smooth(commanded, dt, band, derivative=1)
    deviation = commanded - measured
    rate, deviation = rate - rate.mean(), deviation - deviation.mean()
    power = float(rate @ rate)
    return float(rate @ deviation) / power if power > 0.0 else 0.0


def rounding_histories(motion: Array, dt: float, step: float, encoder_rate: float, band: float) -> Array:
    """How an encoder's rounding errs below `band` Hz along a known motion (n,): (phases, n) rad.

    The motion is rounded as the encoder would, at its own rate and at four positions within a code, and
    filtered: which of them is the true one nobody knows.
    """
    if step == 0.0:
        return np.zeros((len(_PHASES), len(motion)))
    factor, own = max(1, round(encoder_rate * dt)), np.arange(len(motion))

    def errors(at: Index) -> Array:
        codes = np.interp(at / factor, own, motion)[:, None] / step + np.array(_PHASES)
        error: Array = step * (np.round(codes) - codes)
        return error

    return smooth_rows(errors, (len(motion) - 1) * factor + 1, dt / factor, band, every=factor).T


def rounding_error(histories: Array, dt: float) -> Array:
    """Standard deviation (n,) rad of the rounding error: its square averaged over phases and over a second.

    A joint at rest keeps step / sqrt(12); one that crosses codes faster than the band loses most of it.
    """
    power = np.mean(histories**2, axis=0)
    window = max(1, min(round(1.0 / dt), len(power)))
    kernel = np.ones(window) / window
    weight = np.convolve(np.ones(len(power)), kernel, mode="same")
    sigma: Array = np.sqrt(np.convolve(power, kernel, mode="same") / weight)
    return sigma


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))
