"""The effects that a plant can contain, one file each; a new one is a file and a line here.

A campaign's nominal model names some of them; the others are suspects when a prediction fails. What the rig already
describes is no effect: mass, CoG and inertia of bodies, inclination and compliance of the transducer, misalignment of
axes, Kp and Ki of the controller. They are found by refitting them. Gyroscopic and Coriolis terms are part of the rigid
bodies, and cannot be left out.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from kbs_process.errors import ConfigError, did_you_mean
from kbs_process.plant.effect import ACTION, Effect, instance
from kbs_process.plant.effects.air_drag import AIR_DRAG
from kbs_process.plant.effects.appendage import APPENDAGE
from kbs_process.plant.effects.asymmetric_coulomb import ASYMMETRIC_COULOMB
from kbs_process.plant.effects.asymmetric_viscous import ASYMMETRIC_VISCOUS
from kbs_process.plant.effects.backlash import BACKLASH
from kbs_process.plant.effects.base_hardening import BASE_HARDENING
from kbs_process.plant.effects.base_hysteresis import BASE_HYSTERESIS
from kbs_process.plant.effects.bungee import BUNGEE
from kbs_process.plant.effects.cogging import COGGING
from kbs_process.plant.effects.controller_gain import CONTROLLER_GAIN
from kbs_process.plant.effects.controller_jitter import CONTROLLER_JITTER
from kbs_process.plant.effects.controller_lag import CONTROLLER_LAG
from kbs_process.plant.effects.controller_latency import CONTROLLER_LATENCY
from kbs_process.plant.effects.coulomb import COULOMB
from kbs_process.plant.effects.dahl import DAHL
from kbs_process.plant.effects.detent import DETENT
from kbs_process.plant.effects.dynamic_friction import DYNAMIC_FRICTION
from kbs_process.plant.effects.flexspline import FLEXSPLINE
from kbs_process.plant.effects.floor_tilt import FLOOR_TILT
from kbs_process.plant.effects.floor_vibration import FLOOR_VIBRATION
from kbs_process.plant.effects.friction_ripple import FRICTION_RIPPLE
from kbs_process.plant.effects.friction_warmup import FRICTION_WARMUP
from kbs_process.plant.effects.ground_bump import GROUND_BUMP
from kbs_process.plant.effects.ground_cable import GROUND_CABLE
from kbs_process.plant.effects.harness import HARNESS
from kbs_process.plant.effects.joint_hysteresis import JOINT_HYSTERESIS
from kbs_process.plant.effects.joint_order import JOINT_ORDER
from kbs_process.plant.effects.joint_viscous import JOINT_VISCOUS
from kbs_process.plant.effects.kinematic_error import KINEMATIC_ERROR
from kbs_process.plant.effects.load_friction import LOAD_FRICTION
from kbs_process.plant.effects.local_torque import LOCAL_TORQUE
from kbs_process.plant.effects.lugre import LUGRE
from kbs_process.plant.effects.mass_shift import MASS_SHIFT
from kbs_process.plant.effects.measured_law import MEASURED as MEASURED_LAWS
from kbs_process.plant.effects.microstep_error import MICROSTEP_ERROR
from kbs_process.plant.effects.motor_asymmetry import MOTOR_ASYMMETRY
from kbs_process.plant.effects.motor_dahl import MOTOR_DAHL
from kbs_process.plant.effects.motor_drag import MOTOR_DRAG
from kbs_process.plant.effects.motor_order import MOTOR_ORDER
from kbs_process.plant.effects.motor_stribeck import MOTOR_STRIBECK
from kbs_process.plant.effects.motor_viscous import MOTOR_VISCOUS
from kbs_process.plant.effects.stiffness_hardening import STIFFNESS_HARDENING
from kbs_process.plant.effects.stribeck import STRIBECK
from kbs_process.plant.effects.synchronous_motor import SYNCHRONOUS_MOTOR
from kbs_process.plant.effects.tether import TETHER
from kbs_process.plant.effects.tooth_stiction import TOOTH_STICTION
from kbs_process.plant.effects.transmission_hysteresis import TRANSMISSION_HYSTERESIS

# The order is the order of summation, whatever order a campaign names them in.
CATALOGUE: tuple[Effect, ...] = (
    # the paper's mechanism
    SYNCHRONOUS_MOTOR,
    COGGING,
    MOTOR_VISCOUS,
    DYNAMIC_FRICTION,
    TOOTH_STICTION,
    FLEXSPLINE,
    # field
    CONTROLLER_GAIN,
    CONTROLLER_JITTER,
    CONTROLLER_LAG,
    CONTROLLER_LATENCY,
    # motor
    MOTOR_ORDER,
    MICROSTEP_ERROR,
    FRICTION_RIPPLE,
    FRICTION_WARMUP,
    MOTOR_STRIBECK,
    MOTOR_ASYMMETRY,
    MOTOR_DRAG,
    MOTOR_DAHL,
    # gear
    KINEMATIC_ERROR,
    BACKLASH,
    STIFFNESS_HARDENING,
    TRANSMISSION_HYSTERESIS,
    # joint
    JOINT_VISCOUS,
    ASYMMETRIC_VISCOUS,
    COULOMB,
    ASYMMETRIC_COULOMB,
    LOAD_FRICTION,
    STRIBECK,
    DAHL,
    LUGRE,
    HARNESS,
    JOINT_HYSTERESIS,
    JOINT_ORDER,
    LOCAL_TORQUE,
    DETENT,
    # from outside
    GROUND_CABLE,
    GROUND_BUMP,
    MASS_SHIFT,
    AIR_DRAG,
    APPENDAGE,
    BUNGEE,
    TETHER,
    FLOOR_VIBRATION,
    FLOOR_TILT,
    BASE_HARDENING,
    BASE_HYSTERESIS,
)

# Measured laws, which have no name: a model can contain them, and no search tries them as suspects.
MEASURED: tuple[Effect, ...] = tuple(law.effect for law in MEASURED_LAWS)

_EVERY = (*CATALOGUE, *MEASURED)
_POSITION = {effect.name: index for index, effect in enumerate(_EVERY)}


def find(name: str) -> Effect | None:
    """Return the effect of that name; `NAME_2`, `NAME_3`, ... is one more action of the same."""
    if name in _POSITION:
        return _EVERY[_POSITION[name]]
    again = re.fullmatch(f"(.+){ACTION}", name)
    if again is None or again[1] not in _POSITION:
        return None
    return instance(_EVERY[_POSITION[again[1]]], int(again[2]))


def catalogue_with(names: Sequence[str]) -> tuple[Effect, ...]:
    """Return the catalogue, each effect followed by its further actions among `names`."""
    again = [name for name in names if name not in _POSITION and find(name) is not None]
    return select([*_POSITION, *again])


def select(names: Sequence[str]) -> tuple[Effect, ...]:
    """Return the effects of those names in the catalogue's order."""
    chosen = {}
    for name in names:
        effect = find(name)
        if effect is None:
            raise ConfigError(f"unknown effect '{name}'", where="[model] effects", remedy=did_you_mean(name, _POSITION))
        chosen[_POSITION[name.removesuffix(effect.tag)], effect.tag] = effect
    return tuple(chosen[key] for key in sorted(chosen))
