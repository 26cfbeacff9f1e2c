"""The laws of physics that a plant, its sensors and its clocks can contain: one file a physics, in folders by physics.

Begin with `friction/viscous.py`. A law is a plain function (equation, units, validity, source in its docstring) and the
declaration beneath it, which says all that anybody asks of it: where it acts, its parameters, how they are searched, in
which words a diagnosis speaks of it. A new law is a file in one of the folders, or a declaration in one of the files:
nothing else names it. Any `Effect` or `Sensing` at the level of a file, alone or in a tuple, is found. Laws act in the
order that they declare, whatever order a campaign names them in.

A campaign's nominal model names some of the effects; the others are suspects when a prediction fails. What the rig
already describes is no effect: mass, CoG and inertia of bodies, inclination and compliance of the transducer,
misalignment of axes, Kp and Ki of the controller. They are found by refitting them. Gyroscopic and Coriolis terms are
part of the rigid bodies, and cannot be left out.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from importlib import import_module
from pkgutil import iter_modules
from types import ModuleType

from kbs_process.errors import ConfigError, did_you_mean
from kbs_process.plant.effect import ACTION, Effect, instance
from kbs_process.plant.sensing import Sensing


def modules() -> Iterator[ModuleType]:
    """Yield every file of laws, folder by folder."""
    for folder in iter_modules(__path__, f"{__name__}."):
        if folder.ispkg:
            within = import_module(folder.name).__path__
            yield from (import_module(file.name) for file in iter_modules(within, f"{folder.name}."))


def laws_of(module: ModuleType) -> list[Effect | Sensing]:
    """Return the laws that a file declares: those with an equation of its own."""
    named = (value if isinstance(value, tuple) else (value,) for value in vars(module).values())
    laws = (one for values in named for one in values if isinstance(one, Effect | Sensing))
    return [law for law in laws if law.equation.__module__ == module.__name__]


# In the order that they declare.
_FOUND = sorted((law for module in modules() for law in laws_of(module)), key=lambda law: (law.order, law.name))

CATALOGUE: tuple[Effect, ...] = tuple(law for law in _FOUND if isinstance(law, Effect) and not law.measured)
MEASURED: tuple[Effect, ...] = tuple(law for law in _FOUND if isinstance(law, Effect) and law.measured)
SENSING: tuple[Sensing, ...] = tuple(law for law in _FOUND if isinstance(law, Sensing))

LAWS: Mapping[str, Effect | Sensing] = {law.name: law for law in _FOUND}

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
