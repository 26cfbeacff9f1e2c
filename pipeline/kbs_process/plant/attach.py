"""A rig with the numbers that one more effect asks for: how a hypothesis about the plant begins."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from kbs_process.plant.effect import Effect, Parameter, Port
from kbs_process.rig.model import LAB, Drive, External, Joint, Quantity, Rig
from kbs_process.signals.records import Array


def attach(
    rig: Rig,
    effect: Effect,
    values: Mapping[str, float] | None = None,
    *,
    joints: Sequence[str] | None = None,
    on: str = LAB,
    point: Array | None = None,
) -> Rig:
    """Return `rig` with the parameters of `effect`: `values`, else what the rig has, else none of an amplitude.

    A shape without a value is in the middle of its prior; sigmas are the priors'. An effect of the drives gets
    `values` at `joints` (all, by default), and no amplitude at the others; a joint without a drive gets a direct one.
    An effect of the laboratory acts on the link `on`, a force at `point` (3,) m in the link's axes.
    """
    given = values or {}
    if unknown := set(given) - {parameter.name for parameter in effect.parameters}:
        raise KeyError(f"'{effect.name}' has no {sorted(unknown)}")
    if effect.port.of_drive:
        chosen = rig.joint_names if joints is None else joints
        return replace(
            rig, joints=tuple(_joint(joint, effect, given if joint.name in chosen else {}) for joint in rig.joints)
        )
    path = f"external.{effect.name}"
    at = None
    if effect.port is Port.EXTERNAL_FORCE:
        at = Quantity(f"{path}.point", np.zeros(3) if point is None else point, "m", np.zeros(3), "assumed")
    parameters = {entry.name: _quantity(path, entry, given, entry.unit) for entry in effect.parameters}
    others = tuple(entry for entry in rig.external if entry.name != effect.name)
    return replace(rig, external=(*others, External(effect.name, on, at, parameters)))


def idle(rig: Rig, effect: Effect) -> bool:
    """Whether an effect that the rig has the numbers of does nothing: no amplitude of it is other than zero."""
    holders = [joint.drive.parameters for joint in rig.joints if joint.drive is not None]
    if not effect.port.of_drive:
        holders = [entry.parameters for entry in rig.external if entry.name == effect.name]
    names = [entry.name for entry in effect.amplitudes]
    return not any(float(holder[name]) for holder in holders for name in names if name in holder)


def detach(rig: Rig, effect: Effect, others: Sequence[Effect]) -> Rig:
    """Return `rig` without the parameters of `effect` that none of the `others` has: what `attach` gave it."""
    shared = {entry.name for other in others for entry in other.parameters}
    own = {entry.name for entry in effect.parameters if entry.role != "shared"} - shared
    if not effect.port.of_drive:
        return replace(rig, external=tuple(entry for entry in rig.external if entry.name != effect.name))
    return replace(
        rig,
        joints=tuple(
            joint
            if joint.drive is None
            else replace(
                joint,
                drive=replace(
                    joint.drive, parameters={n: q for n, q in joint.drive.parameters.items() if n not in own}
                ),
            )
            for joint in rig.joints
        ),
    )


def _joint(joint: Joint, effect: Effect, given: Mapping[str, float]) -> Joint:
    drive = joint.drive or _direct(joint)
    parameters = dict(drive.parameters)
    path = f"joint.{joint.name}.drive"
    for entry in effect.parameters:
        if entry.name in given or (entry.name not in parameters and entry.role != "shared"):
            parameters[entry.name] = _quantity(path, entry, given, joint.unit_of(entry.unit))
    return replace(joint, drive=replace(drive, parameters=parameters))


def _direct(joint: Joint) -> Drive:
    """A drive that turns with its joint, its rotor a part of the body that it drives."""

    def exact(name: str, value: float, unit: str) -> Quantity:
        path = f"joint.{joint.name}.drive.{name}"
        return Quantity(path, np.asarray(value), unit, np.zeros(()), "definition of a direct drive")

    return Drive(exact("ratio", 1.0, "1"), exact("rotor_inertia", 0.0, "kg m^2"), exact("steps_per_turn", 1.0, "1"), {})


def _quantity(path: str, entry: Parameter, given: Mapping[str, float], unit: str) -> Quantity:
    absent = 0.0 if entry.role == "amplitude" else entry.prior.middle
    value, sigma = given.get(entry.name, absent), entry.prior.spread
    return Quantity(f"{path}.{entry.name}", np.asarray(value), unit, np.asarray(sigma), "prior of the effect")
