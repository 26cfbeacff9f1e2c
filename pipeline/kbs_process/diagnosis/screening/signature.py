"""Signatures of suspects: what each would have added, a unit of each of its amplitudes.

A suspect of the plant is run along the signals of the plant without it, which gives the inputs that it would have
been; sent through the plant linearised along the trajectory they give its signature. A suspect of the sensing acts on
the prediction itself.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.interpolate import CubicSpline

from kbs_process.diagnosis.experiments.hypothesis import Tapped
from kbs_process.diagnosis.experiments.stamps import slope
from kbs_process.diagnosis.screening.inlets import WRENCH_PORT, Inlet
from kbs_process.diagnosis.screening.scene import Course, courses
from kbs_process.diagnosis.screening.suspects import Candidate, own_values, point_of
from kbs_process.plant.along import along, signals_of
from kbs_process.plant.compiled.taps import plate_column
from kbs_process.plant.effect import Effect, Port
from kbs_process.plant.laws import select
from kbs_process.plant.linear.linearise import drive_slopes
from kbs_process.plant.sensing import BY, Sensing, SensingPort
from kbs_process.rig.model import Rig
from kbs_process.signals.records import WRENCH_CHANNELS, Array
from kbs_process.stages.align.resample import resample

_POSITION = ("x", "y", "z")  # signals of an effect at a point; its velocity is their slopes


def port_inputs(candidate: Candidate, tapped: Tapped, rig: Rig, course: Course | None = None) -> Array:
    """What a suspect of the plant puts in at its port, for a unit of each amplitude, (m, amplitudes, components).

    Components: one at a drive (N m, of its field rad), three at a point of a link (N), the floor (m/s^2) or the
    mounting (N m), along the undeflected T's axes. Each row is the mean from one tap to the next. `course` is that of
    the link, where it is known.
    """
    effect = candidate.effect
    assert isinstance(effect, Effect)
    columns = {name: k for k, name in enumerate(tapped.columns)}
    signals: dict[str, Array] = {"time": np.arange(len(tapped.values)) / tapped.rate}
    if effect.port is Port.EXTERNAL_FORCE:
        signals |= dict(zip(_POSITION, _way(candidate, tapped, rig, course).T, strict=True))
    elif effect.port is Port.BASE_TORQUE:
        signals |= {f"base_{axis}": tapped.values[:, columns[plate_column(axis)]] for axis in _POSITION}
    elif effect.port.of_drive:
        needed = [name for name in signals_of(effect) if name != "time"]
        signals |= {name: tapped.values[:, columns[f"{name}.{candidate.site}"]] for name in needed}
    values = own_values(rig, candidate.site) | dict(candidate.shape)
    joint = next((joint for joint in rig.joints if joint.name == candidate.site), None)
    if joint is not None and joint.drive is not None:
        values["ratio"] = float(joint.drive.ratio)
    whole = along(effect, signals, values, 1.0 / tapped.rate)
    every = [entry.name for entry in effect.amplitudes]
    return whole[:, [every.index(entry.name) for entry in candidate.amplitudes]]


def _way(candidate: Candidate, tapped: Tapped, rig: Rig, course: Course | None) -> Array:
    """Position (m, 3) of a candidate's point from T's origin, in the undeflected T's axes."""
    point = point_of(rig, candidate.site) if candidate.point is None else np.array(candidate.point)
    return (course or courses(rig, tapped)[candidate.site]).of(point)


def inputs(
    candidate: Candidate, tapped: Tapped, rig: Rig, effects: Sequence[str], course: Course | None = None
) -> list[dict[Inlet, Array]]:
    """Inputs of the linearised plant for a unit of each amplitude: series (m,), means from one tap to the next.

    A force at a point of a link is a wrench about T's origin. A change of the field is the torque by which the motor
    follows it, as `effects`, those of the model, have it at rest.
    """
    site = candidate.site
    values = port_inputs(candidate, tapped, rig, course)
    if candidate.port is Port.FIELD:
        drive = rig.joint(site).drive
        assert drive is not None
        _, _, by_field = drive_slopes(drive, select(effects))
        # Both are meant at the output: the rotor's torque is `ratio` times the motor's, the field's angle a `ratio`-th.
        torque = values[:, :, 0] * by_field[1] / float(drive.ratio) ** 2
        return [{Inlet("motor_torque", site): column} for column in torque.T]
    assert isinstance(candidate.port, Port)
    inlet = candidate.port.name.lower()
    if candidate.port.beneath:
        return [
            {Inlet(inlet, "", axis): values[:, a, k] for k, axis in enumerate(_POSITION)}
            for a in range(values.shape[1])
        ]
    if candidate.port is Port.EXTERNAL_FORCE:
        way = _way(candidate, tapped, rig, course)
        middle = 0.5 * (way + np.vstack([way[1:], way[-1:]]))
        wrenches = [np.hstack([values[:, a], np.cross(middle, values[:, a])]) for a in range(values.shape[1])]
        return [
            {Inlet(WRENCH_PORT, site, axis): wrench[:, k] for k, axis in enumerate(WRENCH_CHANNELS)}
            for wrench in wrenches
        ]
    return [{Inlet(inlet, site): values[:, a, 0]} for a in range(values.shape[1])]


def sensed(
    candidate: Candidate,
    t: Array,
    prediction: Array,
    channels: Sequence[str],
    rig: Rig,
    known: Mapping[str, Array | float] | None = None,
) -> Array:
    """Change of a prediction (n, c) by a unit of each amplitude of a suspect of the sensing, (n, c, amplitudes).

    `known` is what else is known of the recording that its equation may ask for.
    """
    out = np.zeros((*prediction.shape, len(candidate.amplitudes)))
    for k, change in _by_channel(candidate, t, prediction, channels, rig, known or {}).items():
        out[:, k] = change
    return out


def reduced(candidate: Candidate, tapped: Tapped, channels: Sequence[str], rig: Rig, dt: float, n: int) -> Array:
    """As `sensed` at the working rate, (n, c, amplitudes), of what a sensor does to all that it reads.

    Vibration beyond the working band takes a play to and fro and rounds a step off: a sensor that is not linear shows
    otherwise than it would without.
    """
    assert tapped.readings is not None
    t = np.arange(len(tapped.readings)) / tapped.rate
    out = np.zeros((n, len(channels), len(candidate.amplitudes)))
    for k, change in _by_channel(candidate, t, tapped.readings, channels, rig, {}).items():
        slow = resample(change, tapped.rate, 1.0 / dt)[:n]
        out[: len(slow), k] = slow
    return out


def _by_channel(
    candidate: Candidate,
    t: Array,
    prediction: Array,
    channels: Sequence[str],
    rig: Rig,
    recorded: Mapping[str, Array | float],
) -> dict[int, Array]:
    """Change by a unit of each amplitude, (n, amplitudes), of the channels (by index) at which a suspect acts."""
    law, site = candidate.effect, candidate.site
    assert isinstance(law, Sensing)
    given = dict(recorded)
    match law.port:
        case SensingPort.STREAM:
            acted = stamped(site, channels, rig)
        case SensingPort.COUPLING | SensingPort.PRODUCT:
            reads, *acts = site.split(BY)
            acted = [channels.index(reads)]
            given["acting"] = np.prod(prediction[:, [channels.index(name) for name in acts]], axis=1)
        case _:
            acted = [channels.index(site)]
    if "code" in law.arguments:
        encoder = rig.joint(site).encoder
        given["code"] = float(encoder.step) if encoder is not None and float(encoder.step) > 0.0 else np.nan
    return {k: per_unit(candidate, t, prediction[:, k], given) for k in acted}


def stamped(stream: str, channels: Sequence[str], rig: Rig) -> list[int]:
    """Places of the channels that a stream's clock stamps."""
    joints = rig.joint_names
    return [k for k, name in enumerate(channels) if (name in joints) == (stream == "encoder")]


def per_unit(candidate: Candidate, t: Array, reading: Array, given: Mapping[str, Array | float]) -> Array:
    """Change (n, amplitudes) of a reading (n,) by a unit of each amplitude of a suspect of the sensing.

    Of a clock's to first order in its lateness.
    """
    law = candidate.effect
    assert isinstance(law, Sensing)
    known: dict[str, Array | float] = {"reading": reading, **given}
    if "rate" in law.arguments:
        known["rate"] = CubicSpline(t, reading)(t, 1)
    values = unit_values(candidate, t, known)
    if law.port is SensingPort.STREAM:
        return -values * slope(reading[:, None], float(t[1] - t[0]))
    return values


def unit_values(candidate: Candidate, t: Array, given: Mapping[str, Array | float]) -> Array:
    """(n, amplitudes) what the equation of a suspect of the sensing gives for a unit of each amplitude."""
    law = candidate.effect
    assert isinstance(law, Sensing)
    known: dict[str, Array | float] = {"time": t, **given, **dict(candidate.shape)}
    columns = []
    for amplitude in candidate.amplitudes:
        units = {entry.name: float(entry is amplitude) for entry in candidate.amplitudes}
        columns.append(law.equation(**{name: (known | units)[name] for name in law.arguments}))
    return np.stack(columns, axis=1)
