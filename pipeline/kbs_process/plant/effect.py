"""One piece of physics: an equation, where it acts, and its parameters.

An effect is a plain typed function whose argument names are its wiring: signals of the plant at its port
(`Port.signals`), the effect's own states, and its parameters. The declaration beneath it is checked
when it is made, so a wrong name is an error at import, not in the middle of a run. The plant compiles the
function; it has to use floats and `math` alone.
"""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from enum import Enum
from functools import cache
from typing import Any, Literal, get_type_hints

# What every equation can ask for by name, for the drive that it is part of.
SIGNALS = {
    "field": "rad, position of the magnetic field in whole microsteps, as an angle of the motor",
    "rotor_angle": "rad, with respect to the body that carries the motor",
    "rotor_rate": "rad/s, with respect to the same body",
    "rotor_travel": "rad, what the rotor turns about rotor_angle while the value holds: an equation that jumps gives "
    "its mean over it, so that no jump is rounded to a time step; 0 at an instant",
    "joint_angle": "rad, output with respect to the same body",
    "joint_rate": "rad/s, output with respect to the same body",
    "other_angle": "rad, output of the joint after this one, after the last of the first, as joint_angle",
    "other_rate": "rad/s, its rate",
    "ratio": "1, motor turns in a turn of the output",
    "time": "s, on the recording's time axis",
}


LAST = 10_000  # order of a law that declares none
CROSSED = frozenset(("other_angle", "other_rate"))  # signals of another joint

# Phases that a search tries, rad.
EIGHTHS = tuple(math.pi * (i / 4.0 - 1.0) for i in range(8))

# What the equation of a load from the laboratory can ask for: the motion of the point at which it acts.
POINT_SIGNALS = {
    "x": "m, position of the point from T's origin, along the undeflected T's x axis",
    "y": "m, along y",
    "z": "m, along z",
    "vx": "m/s, its velocity along the same axes",
    "vy": "m/s",
    "vz": "m/s",
    "time": SIGNALS["time"],
}
VELOCITIES = frozenset(("vx", "vy", "vz"))
FLOOR_SIGNALS = {"time": SIGNALS["time"]}

# What the equation of the mounting can ask for: how the plate stands on it.
MOUNTING_SIGNALS = {
    "base_x": "rad, angle of the plate about T's x, then y, then z, off the unloaded position",
    "base_y": "rad, about y",
    "base_z": "rad, about z",
    "base_rate_x": "rad/s, of base_x",
    "base_rate_y": "rad/s",
    "base_rate_z": "rad/s",
    "time": SIGNALS["time"],
}

# What a change of the field can ask for: the field as it is commanded, as an angle of the motor.
FIELD_SIGNALS = {
    "field_travel": "rad, turned by the field since the first command",
    "field_rate": "rad/s, of the field",
    "ratio": SIGNALS["ratio"],
    "time": SIGNALS["time"],
}


class Port(Enum):
    """Where an equation's value acts.

    The field is what a driver makes of the controller's command. Motor torque, friction, transmission and joint torque
    act between a joint's output, its rotor and the body that carries the motor: what they do is internal. The others
    come from the laboratory, and the transducer feels them; the base's torque is what carries the transducer, and it
    feels of that what becomes of the motion.
    Ports of a drive have their parameters at every joint, the others once in the rig (`rig.model.External`).
    """

    FIELD = "change of the magnetic field's position, as an angle of the motor, rad"
    MOTOR_TORQUE = "torque on the rotor, N m"
    MOTOR_FRICTION = "greatest Coulomb friction torque on the rotor, N m, >= 0: opposes motion, holds at rest"
    TRANSMISSION = "torque of the gear on the output, N m; the rotor gets -1/ratio of it"
    JOINT_TORQUE = "torque on the output, N m, reacted by the body that carries the motor"
    GROUND_TORQUE = "torque on the output about the joint's axis, N m, reacted by the laboratory"
    EXTERNAL_FORCE = "force (x, y, z) of the laboratory on a point of a link, N, along the undeflected T's axes"
    BASE_ACCELERATION = "acceleration (x, y, z) of the laboratory's floor, m/s^2, along the undeflected T's axes"
    BASE_TORQUE = (
        "moment (x, y, z) of the mounting on the plate about the axes of the base's angles, N m, beyond the "
        "transducer's stiffness and damping"
    )

    @property
    def of_drive(self) -> bool:
        """Whether it is a port of every driven joint, and not one of the rig."""
        return self not in (Port.EXTERNAL_FORCE, Port.BASE_ACCELERATION, Port.BASE_TORQUE)

    @property
    def components(self) -> int:
        """Numbers that an equation at this port returns before the derivatives of its states."""
        return 1 if self.of_drive else 3

    @property
    def stateful(self) -> bool:
        """Whether an equation at this port may have states of its own: what integrates them is the plant's."""
        return self is Port.BASE_TORQUE or (self.of_drive and self is not Port.FIELD)

    @property
    def signals(self) -> dict[str, str]:
        """What an equation at this port can ask for by name, with its unit and meaning."""
        match self:
            case Port.FIELD:
                return FIELD_SIGNALS
            case Port.EXTERNAL_FORCE:
                return POINT_SIGNALS
            case Port.BASE_ACCELERATION:
                return FLOOR_SIGNALS
            case Port.BASE_TORQUE:
                return MOUNTING_SIGNALS
            case _:
                return SIGNALS


@dataclass(frozen=True, slots=True)
class Normal:
    """Normal prior."""

    mean: float
    sigma: float

    @property
    def middle(self) -> float:
        """Mean."""
        return self.mean

    @property
    def spread(self) -> float:
        """Standard deviation."""
        return self.sigma


@dataclass(frozen=True, slots=True)
class LogNormal:
    """Prior of a positive parameter: its logarithm is normal with standard deviation `sigma`."""

    median: float
    sigma: float

    @property
    def middle(self) -> float:
        """Median."""
        return self.median

    @property
    def spread(self) -> float:
        """Standard deviation."""
        square = self.sigma**2
        return self.median * math.sqrt(math.expm1(square) * math.exp(square))


@dataclass(frozen=True, slots=True)
class Uniform:
    """Prior of a parameter of which only the range is known, as a phase."""

    low: float
    high: float

    @property
    def middle(self) -> float:
        """Mean."""
        return 0.5 * (self.low + self.high)

    @property
    def spread(self) -> float:
        """Standard deviation."""
        return (self.high - self.low) / math.sqrt(12.0)


@dataclass(frozen=True, slots=True)
class Parameter:
    """A parameter that an equation asks for by name.

    An "amplitude" is one that the equation is linear in: without its amplitudes an effect is absent. A "shared" one
    belongs to another effect, without which this one says nothing. Any other is a "shape"; a search tries those of
    its `grid`, which are values, or, where `over` names a signal, shares (0 to 1) of the range that the signal sweeps:
    with "joint_angle" places in that range, with "joint_angle.span" widths; over "joint_angle.turns" the grid has
    orders, of which those count that come once at least in that range; over a "spectrum" it is a residual's tones.
    """

    name: str
    unit: str
    prior: Normal | LogNormal | Uniform
    description: str
    bounds: tuple[float, float]
    role: Literal["amplitude", "shape", "shared"] = "shape"
    grid: tuple[float, ...] = ()
    over: str = ""
    dry: bool = False  # an amplitude of friction or cogging: its slope at rest does not last


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

    An effect with n states returns a tuple: its value, then the n time derivatives in their order. At a port of the
    rig, an equation returns three components. A state of the base's depends on itself and on the motion alone.
    What acts at the ground's port belongs to the test, unless it is part `of_article`.
    `passive` claims that it never does positive work; the conformance test holds it to that. What comes from outside
    has amplitudes of its own in `each_trial`. A force `anywhere` is tied to no place of its link that a drawing shows:
    a search looks for its point, too. A moment `of_weight` acts about no axis that is along gravity. What is `recorded`
    is in the record of the field, and leaves nothing to find where there is one. A `delay` of the field is exact in the
    plant. An effect can act several times: see `instance`. Effects that share an equation say with `wires` what its
    arguments are for each.
    """

    name: str
    port: Port
    equation: Callable[..., Any]
    parameters: tuple[Parameter, ...]
    reference: str
    states: tuple[State, ...] = ()
    passive: bool = False
    each_trial: bool = False
    of_article: bool = False  # although the wrench feels it at a port of the ground: an appendage
    anywhere: bool = False  # a force whose point on its link is not known
    of_weight: bool = False  # a moment of weight about a joint's axis
    recorded: bool = False  # a change of the field before that is recorded
    delay: str = ""  # the parameter by which the field comes late, s: its equation is that to first order
    of_set_points: bool = False  # a delay of where cycles begin, between which the field goes straight
    tag: str = ""  # what `instance` has added to the names of parameters and states
    wires: tuple[tuple[str, str], ...] = ()  # argument of the equation -> signal or parameter, where they differ
    order: int = LAST  # of summation and of search, whatever order a campaign names them in; then by name
    measured: bool = False  # a curve without a name: a model can contain it, and no search tries it

    def __post_init__(self) -> None:
        where = f"effect '{self.name}'"
        if not self.name.isidentifier():
            raise TypeError(f"{where}: the name is not an identifier")
        signals = self.port.signals
        own = [state.name for state in self.states] + [parameter.name for parameter in self.parameters]
        if clash := (set(own) & set(signals)) | {name for name in own if own.count(name) > 1}:
            raise TypeError(f"{where}: {sorted(clash)} declared twice, or named like a signal of the plant")
        if unknown := set(self.arguments) - set(signals) - set(own):
            raise TypeError(f"{where}: {sorted(unknown)} is neither a signal ({', '.join(signals)}) nor declared")
        if unused := set(own) - set(self.arguments):
            raise TypeError(f"{where}: {sorted(unused)} is declared, but not an argument of the equation")
        if self.states and not self.port.stateful:
            raise TypeError(f"{where}: what acts at this port has no states of its own")
        hints = get_type_hints(self.equation)
        untyped = [name for name in inspect.signature(self.equation).parameters if hints.get(name) is not float]
        count = self.port.components + len(self.states)
        returns: Any = float if count == 1 else tuple[(float,) * count]  # type: ignore[misc]
        if untyped or hints.get("return") != returns:
            raise TypeError(f"{where}: arguments {untyped} are not float, or the result is not {returns}")

    @property
    def arguments(self) -> tuple[str, ...]:
        """Names that the equation's arguments are wired to, in order."""
        names = [entry.name for entry in self.parameters] + [state.name for state in self.states]
        own = {name.removesuffix(self.tag): name for name in names}
        wires = dict(self.wires)
        asked = (wires.get(name, name) for name in _asked(self.equation))
        return tuple(own.get(name, name) for name in asked)

    @property
    def crossed(self) -> bool:
        """Whether it depends on another joint's motion."""
        return not CROSSED.isdisjoint(self.arguments)

    @property
    def flies(self) -> bool:
        """Whether it acts in orbit too: what the laboratory does stays behind."""
        return self.of_article or (self.port.of_drive and self.port is not Port.GROUND_TORQUE)

    def value(self, known: Mapping[str, float]) -> tuple[float, ...]:
        """Return the equation's components for numbers by name; its own states are at their initial values."""
        wired = {state.name: state.initial for state in self.states} | dict(known)
        result = self.equation(*(wired[name] for name in self.arguments))
        whole = result if isinstance(result, tuple) else (result,)
        return whole[: self.port.components]


@cache
def _asked(equation: Callable[..., Any]) -> tuple[str, ...]:
    """Names of an equation's arguments; looking at a signature takes longer than the equation."""
    return tuple(inspect.signature(equation).parameters)


ACTIONS = 24  # of one effect at one place
ACTION = r"_([2-9]|1\d|2[0-4])"  # what `instance` adds to names


def instance(effect: Effect, number: int) -> Effect:
    """Return `effect` for its second, third, ... action, with names of its own: `motor_order_2` has `order_2`."""
    tag = f"_{number}"
    return replace(
        effect,
        name=effect.name + tag,
        parameters=tuple(
            entry if entry.role == "shared" else replace(entry, name=entry.name + tag) for entry in effect.parameters
        ),
        states=tuple(replace(state, name=state.name + tag) for state in effect.states),
        delay=effect.delay and effect.delay + tag,
        tag=tag,
    )


def shared(effect: Effect, name: str) -> Parameter:
    """Return the parameter of `effect` for another effect to use."""
    return replace(next(entry for entry in effect.parameters if entry.name == name), role="shared")
