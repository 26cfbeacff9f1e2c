"""One piece of physics of a drive: an equation, where it acts, and its parameters.

An effect is a plain typed function whose argument names are its wiring: signals of the plant
(`SIGNALS`), the effect's own states, and parameters of the drive. The declaration beneath it is checked
when it is made, so a wrong name is an error at import, not in the middle of a run. The plant compiles the
function; it has to use floats and `math` alone.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Any

# What every equation can ask for by name, for the drive that it is part of.
SIGNALS = {
    "field": "rad, position of the magnetic field in whole microsteps, as an angle of the motor",
    "rotor_angle": "rad, with respect to the body that carries the motor",
    "rotor_rate": "rad/s, with respect to the same body",
    "rotor_travel": "rad, what the rotor turns about rotor_angle while the value holds: an equation that jumps gives "
    "its mean over it, so that no jump is rounded to a time step; 0 at an instant",
    "joint_angle": "rad, output with respect to the same body",
    "joint_rate": "rad/s, output with respect to the same body",
    "ratio": "1, motor turns in a turn of the output",
    "time": "s, on the recording's time axis",
}


class Port(Enum):
    """Where an equation's value acts. Every torque is reacted by the body that carries the motor."""

    MOTOR_TORQUE = "torque on the rotor, N m"
    MOTOR_FRICTION = "greatest Coulomb friction torque on the rotor, N m, >= 0: opposes motion, holds at rest"
    TRANSMISSION = "torque of the gear on the output, N m; the rotor gets -1/ratio of it"
    JOINT_TORQUE = "torque on the output, N m"


@dataclass(frozen=True, slots=True)
class Normal:
    """Normal prior."""

    mean: float
    sigma: float


@dataclass(frozen=True, slots=True)
class LogNormal:
    """Prior of a positive parameter: its logarithm is normal with standard deviation `sigma`."""

    median: float
    sigma: float


@dataclass(frozen=True, slots=True)
class Uniform:
    """Prior of a parameter of which only the range is known, as a phase."""

    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Parameter:
    """A parameter of the drive that an equation asks for by name."""

    name: str
    unit: str
    prior: Normal | LogNormal | Uniform
    description: str
    bounds: tuple[float, float]


@dataclass(frozen=True, slots=True)
class State:
    """A variable of an effect's own; the equation returns its time derivative after its torque."""

    name: str
    unit: str  # the derivative's is unit/s
    initial: float
    description: str


@dataclass(frozen=True, slots=True)
class Effect:
    """An equation, the port at which its value acts, and what it is wired to.

    An effect with n states returns a tuple: its value, then the n time derivatives in their order.
    `passive` claims that its torque never does positive work; the conformance test holds it to that.
    """

    name: str
    port: Port
    equation: Callable[..., Any]
    parameters: tuple[Parameter, ...]
    reference: str
    states: tuple[State, ...] = ()
    passive: bool = False

    def __post_init__(self) -> None:
        where = f"effect '{self.name}'"
        if not self.name.isidentifier():
            raise TypeError(f"{where}: the name is not an identifier")
        own = [state.name for state in self.states] + [parameter.name for parameter in self.parameters]
        if clash := (set(own) & set(SIGNALS)) | {name for name in own if own.count(name) > 1}:
            raise TypeError(f"{where}: {sorted(clash)} declared twice, or named like a signal of the plant")
        if unknown := set(self.arguments) - set(SIGNALS) - set(own):
            raise TypeError(
                f"{where}: {sorted(unknown)} is neither a signal ({', '.join(SIGNALS)}) nor declared"
            )
        if unused := set(own) - set(self.arguments):
            raise TypeError(f"{where}: {sorted(unused)} is declared, but not an argument of the equation")
        signature = inspect.signature(self.equation, eval_str=True)
        untyped = [a.name for a in signature.parameters.values() if a.annotation is not float]
        returns = float if not self.states else tuple[(float,) * (1 + len(self.states))]  # type: ignore[misc]
        if untyped or signature.return_annotation != returns:
            raise TypeError(f"{where}: arguments {untyped} are not float, or the result is not {returns}")

    @property
    def arguments(self) -> tuple[str, ...]:
        """Names of the equation's arguments, in order."""
        return tuple(inspect.signature(self.equation).parameters)
