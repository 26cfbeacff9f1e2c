"""One piece of physics: an equation, where it acts, its parameters, and all that a search and a diagnosis ask of it.

An effect is a plain typed function whose argument names are its wiring: signals of the plant at its port
(`Port.signals`), the effect's own states, and its parameters. The declaration beneath it is checked
when it is made, so a wrong name is an error at import, not in the middle of a run. The plant compiles the
function; it has to use floats and `math` alone, and to call functions of its own file alone.
"""

from __future__ import annotations

import inspect
import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
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


UNNAMED = "unnamed"  # family of laws that are measured
_BRAKING = ("friction", "viscous")  # families
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


class Acts(Enum):
    """What a port says of itself: what an equation's value does there, and what it can ask for."""

    def __init__(
        self, what: str, word: str, shows: str, signals: Mapping[str, str], site: str, rate: str = "", tested: str = ""
    ) -> None:
        self.what = what  # an equation's value does there, with unit and signs
        self.word = word  # for it in a diagnosis
        self.shows = shows  # what is seen of what acts there
        self.signals = signals  # that an equation can ask for by name, with unit and meaning
        self.site = site  # of which it is a port: joint, link, floor, mounting, channel, encoder, stream
        self.rate = rate  # signal that the value, a torque, does its work with
        self.tested = tested  # its name in a test of ports, if that tells more than the word

    @property
    def title(self) -> str:
        """Its own name, in words."""
        return self.name.lower().replace("_", " ")

    @property
    def of_channel(self) -> bool:
        """Whether it is a port of a single channel."""
        return self.site == "channel"

    @property
    def beneath(self) -> bool:
        """Whether it is under the transducer's plate, which is one place."""
        return self.site in ("floor", "mounting")


_INSIDE = "windup at the encoder; of the wrench only what the motion's change makes"


class Port(Acts):
    """Where an equation's value acts.

    The field is what a driver makes of the controller's command. Motor torque, friction, transmission and joint torque
    act between a joint's output, its rotor and the body that carries the motor: what they do is internal. The others
    come from the laboratory, and the transducer feels them; the base's torque is what carries the transducer, and it
    feels of that what becomes of the motion.
    Ports of a drive have their parameters at every joint, the others once in the rig (`rig.model.External`).
    """

    FIELD = (
        "change of the magnetic field's position, as an angle of the motor, rad",
        "controller",
        "what the motor makes of it; where the field was recorded, what the driver does after that",
        FIELD_SIGNALS,
        "joint",
    )
    MOTOR_TORQUE = "torque on the rotor, N m", "motor torque", _INSIDE, SIGNALS, "joint", "rotor_rate"
    MOTOR_FRICTION = (
        "greatest Coulomb friction torque on the rotor, N m, >= 0: opposes motion, holds at rest",
        "motor torque",
        _INSIDE,
        SIGNALS,
        "joint",
    )
    TRANSMISSION = (
        "torque of the gear on the output, N m; the rotor gets -1/ratio of it, and what the slope of an error adds",
        "transmission",
        _INSIDE,
        SIGNALS,
        "joint",
    )
    JOINT_TORQUE = (
        "torque on the output, N m, reacted by the body that carries the motor",
        "joint torque",
        _INSIDE,
        SIGNALS,
        "joint",
        "joint_rate",
    )
    GROUND_TORQUE = (
        "torque on the output about the joint's axis, N m, reacted by the laboratory",
        "external wrench",
        "windup, and the wrench itself",
        SIGNALS,
        "joint",
        "joint_rate",
        "ground torque",
    )
    EXTERNAL_FORCE = (
        "force (x, y, z) of the laboratory on a point of a link, N, along the undeflected T's axes",
        "external wrench",
        "windup, and the wrench itself",
        POINT_SIGNALS,
        "link",
    )
    BASE_ACCELERATION = (
        "acceleration (x, y, z) of the laboratory's floor, m/s^2, along the undeflected T's axes",
        "base",
        "the wrench, as of all masses the other way",
        FLOOR_SIGNALS,
        "floor",
        "",
        "base",
    )
    BASE_TORQUE = (
        "moment (x, y, z) of the mounting on the plate about the axes of the base's angles, N m, beyond the "
        "transducer's stiffness and damping",
        "base",
        "of the wrench what the change of the plate's motion makes: sag that turns weight, resonances; little at the "
        "encoder; nothing where the transducer is rigid",
        MOUNTING_SIGNALS,
        "mounting",
        "",
        "base torque",
    )

    @property
    def of_drive(self) -> bool:
        """Whether it is a port of every driven joint, and not one of the rig."""
        return self.site == "joint"

    @property
    def of_rotor(self) -> bool:
        """Whether it is a torque on the rotor alone."""
        return self in (Port.MOTOR_TORQUE, Port.MOTOR_FRICTION)

    @property
    def internal(self) -> bool:
        """Whether what it does stays between a joint's output, its rotor and the body that carries the motor."""
        return self.of_drive and self not in (Port.FIELD, Port.GROUND_TORQUE)

    @property
    def components(self) -> int:
        """Numbers that an equation at this port returns before the derivatives of its states."""
        return 1 if self.of_drive else 3

    @property
    def stateful(self) -> bool:
        """Whether an equation at this port may have states of its own: what integrates them is the plant's."""
        return self is Port.BASE_TORQUE or (self.of_drive and self is not Port.FIELD)


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


Prior = Normal | LogNormal | Uniform

Proposal = Literal[
    "",
    "tone",  # Hz of a line in the residual's spectrum
    "swept tone",  # such a line, or where one begins that runs up or down
    "sweep",  # Hz/s by which that one runs
    "beat",  # Hz of a line, or of the beat of the controller's cycles next to it
    "motor order",  # periods in a turn of the motor
    "cycle order",  # whole periods in an electrical cycle of the motor
    "joint order",  # periods in a turn of the joint
    "disc order",  # periods in a turn of the encoder's disc, few
    "disc bits",  # codes in a period, as a power of 2, where there are many
    "period",  # rad after which an encoder's residual repeats
    "place",  # rad of a joint, where the residual stands out
    "width",  # rad of that stretch
]


@dataclass(frozen=True, slots=True)
class Parameter:
    """A parameter that an equation asks for by name.

    An "amplitude" is one that the equation is linear in: without its amplitudes an effect is absent. A "shared" one
    belongs to another effect, without which this one says nothing. Any other is a "shape"; a search tries those of
    its `grid`, which are values, or, where `over` names a signal, shares (0 to 1) of the range that the signal sweeps:
    with "joint_angle" places in that range, with "joint_angle.span" widths; over "joint_angle.turns" the grid has
    orders, of which those count that come once at least in that range; over a "spectrum" it is a residual's tones.
    Beside the grid a residual may propose values; `proposed` says of which kind.
    """

    name: str
    unit: str
    prior: Prior
    description: str
    bounds: tuple[float, float]
    role: Literal["amplitude", "shape", "shared"] = "shape"
    grid: tuple[float, ...] = ()
    over: str = ""
    dry: bool = False  # an amplitude of friction or cogging: its slope at rest does not last
    proposed: Proposal = ""
    whole: bool = False  # a whole number, or a ratio of teeth: it stays where a line was found
    critical: bool = False  # of the mechanism's nominal model: an identification has to find it

    @property
    def is_order(self) -> bool:
        """Whether it counts periods in a turn."""
        return self.proposed.endswith("order")


@dataclass(frozen=True, slots=True)
class State:
    """A variable of an effect's own; the equation returns its time derivative after its torque."""

    name: str
    unit: str  # the derivative's is unit/s
    initial: float
    description: str


def amplitude(
    name: str, unit: str, prior: Prior, description: str, bounds: float | tuple[float, float], *, dry: bool = False
) -> Parameter:
    """Return a parameter that its equation is linear in, within `bounds`, of either sign within a single number."""
    within = bounds if isinstance(bounds, tuple) else (-bounds, bounds)
    return Parameter(name, unit, prior, description, within, "amplitude", dry=dry)


def sine_and_cosine(
    stem: str, unit: str, prior: Prior, what: str, bound: float, *, dry: bool = False
) -> tuple[Parameter, Parameter]:
    """Return the amplitudes `STEM_sin` and `STEM_cos` of `what` is periodic."""
    sine, cosine = f"sine {what}", f"cosine {what}"
    return (
        amplitude(f"{stem}_sin", unit, prior, sine, bound, dry=dry),
        amplitude(f"{stem}_cos", unit, prior, cosine, bound, dry=dry),
    )


def phase(name: str, description: str) -> Parameter:
    """Return a phase, of which nothing is known and all round is tried."""
    return Parameter(name, "rad", Uniform(-math.pi, math.pi), description, (-math.pi, math.pi), grid=EIGHTHS)


def critical(entry: Parameter) -> Parameter:
    """Return a parameter as one that an identification has to find."""
    return replace(entry, critical=True)


def wired(**arguments: str) -> tuple[tuple[str, str], ...]:
    """Return what the arguments of an equation that several laws share are for one of them."""
    return tuple(arguments.items())


@dataclass(frozen=True, slots=True)
class Law:
    """What laws of the plant and of its sensors have in common.

    The docstring of the equation has its formula, units, validity and source. `order` is that of summation and of
    search, whatever order a campaign names laws in; laws without one come last, by name. `family` is the physics in the
    words of a diagnosis. What comes from outside, drifts or hums has amplitudes of its own in `each_trial`.
    """

    name: str
    port: Acts
    equation: Callable[..., Any]
    parameters: tuple[Parameter, ...]
    order: int = field(default=LAST, kw_only=True)
    family: str = field(default="", kw_only=True)
    each_trial: bool = field(default=False, kw_only=True)
    wires: tuple[tuple[str, str], ...] = field(default=(), kw_only=True)  # argument -> what it is, where they differ
    tag: str = field(default="", kw_only=True)  # what `instance` has added to the names of parameters and states
    anywhere: bool = field(default=False, kw_only=True)  # a force whose point on its link is not known
    delay: str = field(default="", kw_only=True)  # the parameter by which the field comes late, s
    of_cycles: str = field(default="", kw_only=True)  # family of orders that all come with whole electrical cycles
    whole_band: bool = field(default=False, kw_only=True)  # what is beyond the working band changes what it does within

    @property
    def arguments(self) -> tuple[str, ...]:
        """Names that the equation's arguments are wired to, in order."""
        return self.arguments_of(self.equation)

    def arguments_of(self, equation: Callable[..., Any]) -> tuple[str, ...]:
        """Return the names that the arguments of one of its functions are wired to, in order."""
        wires = dict(self.wires)
        asked = tuple(wires.get(name, name) for name in _asked(equation))
        if not self.tag:
            return asked
        own = {name.removesuffix(self.tag): name for name in self.own}
        return tuple(own.get(name, name) for name in asked)

    @property
    def own(self) -> tuple[str, ...]:
        """Names that it declares itself."""
        return tuple(entry.name for entry in self.parameters)

    @property
    def amplitudes(self) -> tuple[Parameter, ...]:
        """Parameters that it is linear in."""
        return tuple(entry for entry in self.parameters if entry.role == "amplitude")

    @property
    def suspected(self) -> bool:
        """Whether a search tries it: it can be absent, and has a name."""
        return bool(self.amplitudes)

    def section(self, heading: str) -> str:
        """Return what the equation's docstring says under a heading, as "Validity", on one line."""
        text = self.equation.__doc__ or ""
        found = re.search(rf"^ *{heading}:(.*?)(?=^ *(?:Equation|Units|Validity|Source):|\Z)", text, re.M | re.S)
        return "" if found is None else " ".join(found[1].split())

    def plausible(self, entry: Parameter) -> tuple[float, float]:
        """Between which values an amplitude is no sign of something else."""
        return entry.bounds

    @property
    def reference(self) -> str:
        """Where the equation is from."""
        return self.section("Source").removesuffix(".")

    @property
    def port_word(self) -> str:
        """The word in which a diagnosis says where it acts."""
        return self.port.word

    @property
    def in_plant(self) -> bool:
        """Whether the plant can be simulated with it."""
        return False

    @property
    def jumps(self) -> bool:
        """Whether it is the jump of a clock, at a time that each recording has."""
        return "drop_time" in self.arguments


@dataclass(frozen=True, slots=True)
class Effect(Law):
    """An equation, the port at which its value acts, and what it is wired to.

    An effect with n states returns a tuple: its value, then the n time derivatives in their order. At a port of the
    rig, an equation returns three components. A state of the base's depends on itself and on the motion alone.
    What acts at the ground's port belongs to the test, unless it is part `of_article`.
    `passive` claims that it never does positive work; the conformance test holds it to that. A force `anywhere` is tied
    to no place of its link that a drawing shows: a search looks for its point, too. A moment `of_weight` acts about no
    axis that is along gravity. What is `recorded` is in the record of the field, and leaves nothing to find where there
    is one. A `delay` of the field is exact in the plant. An effect can act several times: see `instance`. Effects that
    share an equation say with `wires` what its arguments are for each.
    `slope` is what a gear's output turns for its rotor beyond 1/ratio: the rotor bears that share of the gear's torque.
    """

    port: Port
    states: tuple[State, ...] = ()
    passive: bool = False
    of_article: bool = False  # although the wrench feels it at a port of the ground: an appendage
    of_weight: bool = False  # a moment of weight about a joint's axis
    of_gear: bool = False  # none of its own where a motor turns with its joint
    either_sign: bool = False  # a friction that pushes in one sense what it brakes in the other
    recorded: bool = False  # a change of the field before that is recorded
    of_set_points: bool = False  # a delay of where cycles begin, between which the field goes straight
    measured: bool = False  # a curve without a name: a model can contain it, and no search tries it
    apart: str = ""  # word for where it acts, if that is not its port's
    slope: Callable[..., float] | None = None  # 1, of signals and parameters
    periods: float = 0.0  # in a turn of the motor, where the equation has a fixed number of them

    def __post_init__(self) -> None:
        where = f"effect '{self.name}'"
        if not self.name.isidentifier():
            raise TypeError(f"{where}: the name is not an identifier")
        signals = self.port.signals
        own = self.own
        if clash := (set(own) & set(signals)) | {name for name in own if own.count(name) > 1}:
            raise TypeError(f"{where}: {sorted(clash)} declared twice, or named like a signal of the plant")
        asked = {*self.arguments, *(self.arguments_of(self.slope) if self.slope else ())}
        if unknown := asked - set(signals) - set(own):
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
    def own(self) -> tuple[str, ...]:
        """Names that it declares itself."""
        return (*(state.name for state in self.states), *(entry.name for entry in self.parameters))

    @property
    def port_word(self) -> str:
        """The word in which a diagnosis says where it acts."""
        return self.apart or self.port.word

    @property
    def in_plant(self) -> bool:
        """Whether the plant can be simulated with it."""
        return True

    @property
    def suspected(self) -> bool:
        """Whether a search tries it: it can be absent, and has a name."""
        return bool(self.amplitudes) and not self.measured

    @property
    def brakes(self) -> bool:
        """Whether it takes work out of the mechanism: one that puts work in stands in for something else."""
        return self.family in _BRAKING and bool(self.port.rate) and not self.either_sign

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
        numbers = {state.name: state.initial for state in self.states} | dict(known)
        result = self.equation(*(numbers[name] for name in self.arguments))
        whole = result if isinstance(result, tuple) else (result,)
        return whole[: self.port.components]

    def slope_at(self, known: Mapping[str, float]) -> float:
        """Return its `slope` for numbers by name, 1."""
        return 0.0 if self.slope is None else self.slope(*(known[name] for name in self.arguments_of(self.slope)))


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
