"""What an identification is after: which numbers are free, and what is known of them beforehand.

Free are the motor-gears' parameters and the transducer's stiffness and damping, and with them every other number of
the rig that has an uncertainty and shows in these recordings (inertias, CoGs, the amplifier's corner, ...): these are
fitted within their priors, so that what they are not known by counts in all that is. Friction differs from run to
run: each friction torque has a factor for each recording, 1 within a stated sigma.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kbs_process.estimation.fit import Parameters
from kbs_process.estimation.tensors import Tensors
from kbs_process.identification.output_error import Experiment, Scalar
from kbs_process.identification.screening import LEAST, contacts, phases
from kbs_process.plant.effect import Effect, Uniform
from kbs_process.plant.laws import CATALOGUE, select
from kbs_process.rig.model import Rig

_NOT_MOVING = ("spacecraft.", "controller.", "transducer.noise", "transducer.resolution", "transducer.bias")
_PROJECTED = ("transducer.cross_coupling",)
_NO_EFFECT = ("steps_per_turn", "encoder.offset", "gravity.magnitude")
# The paper's five, by the parameters that describe them.
CRITICAL = frozenset(entry.name for effect in CATALOGUE for entry in effect.parameters if entry.critical)


def of_drives(effects: Sequence[str]) -> tuple[Effect, ...]:
    """Return the effects that have their parameters at every drive."""
    return tuple(effect for effect in select(effects) if effect.port.of_drive)


def gearbox(rig: Rig, effects: Sequence[str]) -> tuple[Scalar, ...]:
    """What is to be identified: the drives' uncertain parameters, the transducer's stiffness and damping."""
    quantities = rig.quantities()
    found = []
    for joint in rig.joints:
        for effect in of_drives(effects):
            for parameter in effect.parameters:
                name = f"joint.{joint.name}.drive.{parameter.name}"
                # Effects add nothing to a measured motion where a drive has not their numbers.
                if name in quantities and (quantities[name].sigma > 0.0 or isinstance(parameter.prior, Uniform)):
                    found.append(Scalar(name))
    for name in ("transducer.stiffness", "transducer.damping"):
        if name in quantities:
            found += [Scalar(name, (axis,)) for axis in range(3) if quantities[name].sigma[axis] > 0.0]
    return tuple(found)


def others(rig: Rig, known: Sequence[Scalar]) -> tuple[Scalar, ...]:
    """Every other uncertain number of the rig that can move the residual."""
    taken = {scalar.name for scalar in known}
    return tuple(
        scalar
        for name, quantity in rig.quantities().items()
        if not name.startswith((*_NOT_MOVING, *_PROJECTED)) and not name.endswith(_NO_EFFECT)
        for element in np.ndindex(quantity.shape)
        if quantity.sigma[element] > 0.0 and (scalar := Scalar(name, element)).name not in taken
    )


def prior(experiment: Experiment) -> Parameters:
    """Means and sigmas of the parameter files; phases have none, and no bounds either: a turn brings them back."""
    quantities = experiment.rig.quantities()
    declared = {
        f"joint.{joint.name}.drive.{parameter.name}": parameter
        for joint in experiment.rig.joints
        for effect in of_drives(experiment.effects)
        for parameter in effect.parameters
    }
    sigma, lower, upper = [], [], []
    for scalar in experiment.free:
        parameter = declared.get(scalar.name)
        phase = parameter is not None and isinstance(parameter.prior, Uniform)
        low, high = (-np.inf, np.inf) if parameter is None or phase else parameter.bounds
        quantity = quantities[scalar.quantity]
        low = max(low, float(np.asarray(quantity.low)[scalar.element]))
        sigma.append(np.inf if phase else float(quantity.sigma[scalar.element]))
        lower.append(low)
        upper.append(high)
    names = tuple(scalar.name for scalar in experiment.free)
    nominal = experiment.nominal
    # Without amplitude there is no phase, without width no contact.
    needed = [pair.amplitude for pair in phases(experiment.rig, experiment.effects, experiment.free)]
    needed += [contact.width for contact in contacts(experiment.rig, experiment.effects, experiment.free)]
    for index in needed:
        lower[index] = max(lower[index], LEAST * nominal[index])
    tensors = Tensors.among(names, experiment.rig.inertias)
    return Parameters(names, nominal, np.array(sigma), np.array(lower), np.array(upper), tensors)


def frictions(experiment: Experiment) -> tuple[int, ...]:
    """Indices of the free numbers that are friction torques: those of passive effects on the rotor."""
    torques = {
        f"joint.{joint.name}.drive.{parameter.name}"
        for joint in experiment.rig.joints
        for effect in select(experiment.effects)
        if effect.passive and effect.port.of_rotor
        for parameter in effect.parameters
        if parameter.unit.startswith("N m")
    }
    return tuple(index for index, scalar in enumerate(experiment.free) if scalar.name in torques)


def with_factors(parameters: Parameters, experiment: Experiment, run_to_run: float) -> Parameters:
    """The free numbers' priors, and those of the run-to-run factors less 1."""
    scaled = frictions(experiment)
    names = tuple(
        f"{recording.name}: {experiment.free[index].name}" for recording in experiment.recordings for index in scaled
    )
    count = len(names)
    return parameters.extended(names, np.zeros(count), np.full(count, run_to_run), -1.0, np.inf)
