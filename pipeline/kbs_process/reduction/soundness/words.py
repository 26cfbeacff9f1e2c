"""What was found wrong of a rig's model, in words."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from kbs_process.results.judged import Beyond
from kbs_process.signals.records import Array
from kbs_process.stages.gravity.equation import Equation
from kbs_process.stages.gravity.hypotheses import Explained
from kbs_process.stages.gravity.model import GravityModel
from kbs_process.stages.gravity.parameters import CROSS_COUPLING
from kbs_process.stages.gravity.tension import BY_CHANCE, Moved, Shift

SCALE = "clock: the times of all streams run too fast or too slow, or rates are in another unit"
STUCK = "encoder: it is not read, or does not turn with its joint"
TWICE = "mapping: one column is read for two channels"
LATE = "clock: the wrench is {:+.2g} s late, or more, by its timestamps or a filter"
GRAVITY = "unit: gravity.magnitude is {:.3g} m/s^2, which is nowhere on Earth"
TURNED = "the recordings are {1:.0e} times as likely if {0} turns the other way"
UNLESS = "unless a load that goes with the angle pulls there"
UNEXPLAINED = (
    "no single simple fault (gain, unit, sign, axis, zero, swapped channels, one number) explains it: look for what "
    "else pulls or rubs, and compare the parameter files with the rig"
)
_LIKE = 0.03  # relative: a gain this near to a unit's factor is that unit's
_SHOWN = 6
_FORCES = {"pound-force": 4.4482216, "kilogram-force": 9.80665, "gram-force": 9.80665e-3, "kN": 1e3, "mN": 1e-3}
_TORQUES = {
    "N mm": 1e-3,
    "N cm": 1e-2,
    "pound-force foot": 1.3558179,
    "pound-force inch": 0.1129848,
    "kilogram-force metre": 9.80665,
    "kN m": 1e3,
}


def far(beyond: Sequence[Moved], probability: float) -> Iterator[str]:
    for one in beyond[:_SHOWN]:
        known = f"{one.prior:.4g} +- {one.prior_sigma:.2g} by what is known"
        name = f"{one.name} less its certificate" if one.name.startswith(CROSS_COUPLING) else one.name
        yield f"{name} is {one.value:.4g} by the fit, {known}: {abs(one.distance):.1f} sigma"
    if len(beyond) > _SHOWN:
        yield f"{len(beyond) - _SHOWN} other numbers are as far off"
    if probability < BY_CHANCE and not beyond:
        yield f"all fitted numbers together: chance moves them so far with a probability of {probability:.1g} only"


def beyond(one: Moved, model: GravityModel) -> Beyond:
    quantity = model.equation.elements.rig.quantities().get(one.name.split("[")[0])
    channel = one.name.rpartition("].")[2]
    unit = dict(zip(model.channels, model.units, strict=True)).get(channel, "") if quantity is None else quantity.unit
    return Beyond(
        name=one.name, unit=unit, prior=one.prior, prior_sigma=one.prior_sigma, value=one.value, distance=one.distance
    )


def cause(one: Explained, equation: Equation) -> str:
    fault, found = one.fault, one.found
    match fault.kind:
        case "gain":
            return gain(fault.what, fault.gained, float(found[0]))
        case "silent":
            return f"channel: {fault.what} does not respond"
        case "swapped":
            return f"swapped: {fault.what}"
        case "axes":
            return f"axes: the transducer's x, y, z are read as {fault.what}"
        case "sense":
            return f"sign: the angle of {fault.what} turns the other way, by its axis or its encoder's sign"
        case "unit":
            return f"unit: {fault.what}"
        case "clock":
            return f"clock: all times are {np.sqrt(found[0]):.3g} of what passes, by a wrong rate or unit of time"
        case "zero":
            return f"zero: the angle of {fault.what} is {np.degrees(found[0]):.4g} degrees too large"
        case "point":
            return (
                f"axis: torques are about another point than stated, off by ({', '.join(f'{x:.4g}' for x in found)}) m"
            )
        case "bias":
            return f"zero: that of {fault.what} is not as stated ({_values(found)} for {_values(one.stated)})"
        case _:
            return f"{fault.what} is {_values(found)}, for {_values(one.stated)} as stated"


def regained(channel: str, gain_there: float, recording: str, silent: float) -> str:
    """The gain that one recording shows of a channel, or that it is less than `silent`."""
    if abs(gain_there) < silent:
        return f"channel: {channel} does not respond in {recording}"
    return f"{gain(channel, [channel], gain_there)} in {recording}, {UNLESS}"


def misread(one: Shift, silent: float) -> str:
    if one.channel:
        return regained(one.channel, one.value, one.recording, silent)
    how = "reversed" if one.right else f"{one.value:.3g}"
    return f"{one.what} is {how} in {one.recording}, {UNLESS}"


def gain(what: str, channels: Sequence[str], gain: float) -> str:
    """A gain in words: as a sign, as a unit, or as it is."""
    if abs(gain + 1.0) < _LIKE:
        return f"sign: {what} negated"
    units = _FORCES if all(name[0] == "F" for name in channels) else _TORQUES
    if any(name[0] == "F" for name in channels) and any(name[0] == "T" for name in channels):
        units = {}
    for name, factor in units.items():
        stated = "N m" if units is _TORQUES else "N"
        if abs(gain * factor - 1.0) < _LIKE:
            return f"unit: {what} in {name}, taken for {stated}"
        if abs(gain / factor - 1.0) < _LIKE:
            return f"unit: {what} in {stated}, taken for {name}"
    return f"gain: {what} read {gain:.4g} of what acts"


def _values(numbers: Array) -> str:
    return ", ".join(f"{x:.4g}" for x in numbers[:_SHOWN]) + (", ..." if len(numbers) > _SHOWN else "")
