"""The effects that a drive's model can contain, one file each; a new one is a file and a line here."""

from __future__ import annotations

from collections.abc import Sequence

from kbs_process.errors import ConfigError, did_you_mean
from kbs_process.plant.effect import Effect
from kbs_process.plant.effects.bungee import BUNGEE
from kbs_process.plant.effects.cogging import COGGING
from kbs_process.plant.effects.dynamic_friction import DYNAMIC_FRICTION
from kbs_process.plant.effects.flexspline import FLEXSPLINE
from kbs_process.plant.effects.motor_viscous import MOTOR_VISCOUS
from kbs_process.plant.effects.synchronous_motor import SYNCHRONOUS_MOTOR
from kbs_process.plant.effects.tooth_stiction import TOOTH_STICTION

# The order is the order of summation, whatever order a campaign names them in.
CATALOGUE: tuple[Effect, ...] = (
    SYNCHRONOUS_MOTOR,
    COGGING,
    MOTOR_VISCOUS,
    DYNAMIC_FRICTION,
    TOOTH_STICTION,
    FLEXSPLINE,
    BUNGEE,
)


def select(names: Sequence[str]) -> tuple[Effect, ...]:
    """Return the effects of those names in the catalogue's order."""
    known = {effect.name for effect in CATALOGUE}
    for name in names:
        if name not in known:
            raise ConfigError(
                f"unknown effect '{name}'", where="[model] effects", remedy=did_you_mean(name, known)
            )
    return tuple(effect for effect in CATALOGUE if effect.name in names)
