"""Laws that were measured and have no name: a torque over a signal of the mechanism, as a spline's coefficients."""

from __future__ import annotations

import math
from dataclasses import dataclass

from kbs_process.plant.effect import UNNAMED, Effect, LogNormal, Normal, Parameter, Port, amplitude

COEFFICIENTS = 10
INTERVALS = COEFFICIENTS - 3
DENSE = 0.05  # of a rate's range: nodes are dense within as much of rest


def weight(u: float) -> float:
    """Cardinal cubic B-spline, 2/3 at u = 0, zero beyond 2: its shifts by whole numbers add up to one."""
    outer = max(0.0, 2.0 - abs(u))
    inner = max(0.0, 1.0 - abs(u))
    return (outer * outer * outer - 4.0 * inner * inner * inner) / 6.0


def torque(
    x: float,
    low: float,
    high: float,
    c0: float,
    c1: float,
    c2: float,
    c3: float,
    c4: float,
    c5: float,
    c6: float,
    c7: float,
    c8: float,
    c9: float,
) -> float:
    r"""Torque over a signal x: a cubic spline over `INTERVALS` equal intervals from `low` to `high`, held beyond them.

    Equation: $T = \sum_k c_k B(u - k + 1)$, $u = 7 (x - x_0) / (x_1 - x_0)$ within 0 and 7; with equal c it is c.
    Units: that of x (three), N m (ten) -> N m.
    Validity: between the ends, where it was measured. What jumps, as friction does at rest, is rounded to an interval.
    Source: C. de Boor, A Practical Guide to Splines (2001), chapter IX.
    """
    u = 7.0 * min(1.0, max(0.0, (x - low) / (high - low)))
    return (
        c0 * weight(u + 1.0)
        + c1 * weight(u)
        + c2 * weight(u - 1.0)
        + c3 * weight(u - 2.0)
        + c4 * weight(u - 3.0)
        + c5 * weight(u - 4.0)
        + c6 * weight(u - 5.0)
        + c7 * weight(u - 6.0)
        + c8 * weight(u - 7.0)
        + c9 * weight(u - 8.0)
    )


def friction(
    rate: float,
    slide: float,
    x: float,
    low: float,
    high: float,
    c0: float,
    c1: float,
    c2: float,
    c3: float,
    c4: float,
    c5: float,
    c6: float,
    c7: float,
    c8: float,
    c9: float,
) -> float:
    r"""Torque that opposes a rate by as much as a signal x says.

    Equation: $T = -\tanh(\omega / \omega_s) \sum_k c_k B_k(x)$, $B_k$ the cubic B-splines of a measured torque.
    Units: rad/s, rad/s, that of x (three), N m (ten) -> N m.
    Validity: rates above $\omega_s$, below which it creeps in place of sticking; x between the ends.
    Source: C. de Boor, A Practical Guide to Splines (2001), chapter IX.
    """
    return -math.tanh(rate / slide) * torque(x, low, high, c0, c1, c2, c3, c4, c5, c6, c7, c8, c9)


def bent(rate: float, low: float, high: float) -> float:
    """A rate on the scale of a table: close to rest, where friction changes, its nodes are a hundred times as dense."""
    return rate / (abs(rate) + DENSE * (high - low))


def torque_over_rate(
    x: float,
    low: float,
    high: float,
    c0: float,
    c1: float,
    c2: float,
    c3: float,
    c4: float,
    c5: float,
    c6: float,
    c7: float,
    c8: float,
    c9: float,
) -> float:
    r"""Torque over a rate x: a cubic spline whose nodes are dense about rest.

    Equation: $T = \sum_k c_k B_k(x / (|x| + r))$, $r = (x_1 - x_0) / 20$, $B_k$ those of a measured torque.
    Units: rad/s (three), N m (ten) -> N m.
    Validity: between the ends, where it was measured. A jump at rest is rounded to a hundredth of the range.
    Source: C. de Boor, A Practical Guide to Splines (2001), chapter IX.
    """
    u, first, last = bent(x, low, high), bent(low, low, high), bent(high, low, high)
    return torque(u, first, last, c0, c1, c2, c3, c4, c5, c6, c7, c8, c9)


def friction_over_rate(
    rate: float,
    slide: float,
    x: float,
    low: float,
    high: float,
    c0: float,
    c1: float,
    c2: float,
    c3: float,
    c4: float,
    c5: float,
    c6: float,
    c7: float,
    c8: float,
    c9: float,
) -> float:
    r"""Torque that opposes a rate by as much as another rate x says.

    Equation: $T = -\tanh(\omega / \omega_s) \sum_k c_k B_k(x / (|x| + r))$, $r = (x_1 - x_0) / 20$.
    Units: rad/s (five), N m (ten) -> N m.
    Validity: rates above $\omega_s$, below which it creeps in place of sticking; x between the ends.
    Source: C. de Boor, A Practical Guide to Splines (2001), chapter IX.
    """
    return -math.tanh(rate / slide) * torque_over_rate(x, low, high, c0, c1, c2, c3, c4, c5, c6, c7, c8, c9)


@dataclass(frozen=True, slots=True)
class Measured:
    """A measured law: what it is over, and the rate that it opposes, if it is a friction."""

    effect: Effect
    regressor: str  # signal
    opposed: str = ""  # signal

    @property
    def of_rate(self) -> bool:
        """Whether it is over a rate, and its nodes are dense about rest."""
        return self.regressor.endswith("rate")

    @property
    def like_weight(self) -> bool:
        """Whether the weight of a mass that moves with the joint looks the same."""
        return self.effect.port is Port.GROUND_TORQUE and self.regressor == "joint_angle" and not self.opposed

    @property
    def words(self) -> str:
        """What it is, for tables."""
        return f"{'friction' if self.opposed else 'curve'} over {self.regressor.replace('_', ' ')}"


SLIDES = {"joint_rate": 5e-4, "rotor_rate": 0.05}  # rad/s at which a measured friction is full
UNITS = {"angle": "rad", "rate": "rad/s"}


def unit_of(regressor: str) -> str:
    """Return the unit of a signal that a law is over."""
    return UNITS[regressor.rpartition("_")[2]]


def _over(order: int, regressor: str, port: Port, law: str, opposed: str = "") -> Measured:
    """A law with parameters named after it."""
    unit = unit_of(regressor)
    coefficients = tuple(
        amplitude(
            f"{law}_{k}",
            "N m",
            Normal(0.0, 1.0),
            "about the torque at that node of the table, the first and the last one outside it",
            1e4,
            dry=bool(opposed),
        )
        for k in range(COEFFICIENTS)
    )
    shape = [
        Parameter(f"{law}_{end}", unit, Normal(sign, 1.0), "end of what was measured", (-1e4, 1e4))
        for end, sign in (("low", -1.0), ("high", 1.0))
    ]
    wires = [("x", regressor), *((f"c{k}", f"{law}_{k}") for k in range(COEFFICIENTS))]
    wires += [(end, f"{law}_{end}") for end in ("low", "high")]
    if opposed:
        slides = LogNormal(SLIDES[opposed], 1.0)
        shape.append(Parameter(f"{law}_slide", "rad/s", slides, "rate of full friction", (1e-6, 10.0)))
        wires += [("rate", opposed), ("slide", f"{law}_slide")]
    equations = (friction, friction_over_rate) if opposed else (torque, torque_over_rate)
    effect = Effect(
        f"{port.name.lower().removesuffix('_torque')}_{law.removeprefix('ground_').removeprefix('motor_')}",
        port, equations[unit == UNITS["rate"]], (*coefficients, *shape),
        wires=tuple(wires), order=order, family=UNNAMED, measured=True,
    )  # fmt: skip
    return Measured(effect, regressor, opposed)


_JOINT, _MOTOR, _GROUND = Port.JOINT_TORQUE, Port.MOTOR_TORQUE, Port.GROUND_TORQUE
MEASURED: tuple[Measured, ...] = (
    _over(10, "joint_angle", _JOINT, "angle_law"),
    _over(20, "joint_rate", _JOINT, "rate_law"),
    _over(30, "other_angle", _JOINT, "other_angle_law"),
    _over(40, "other_rate", _JOINT, "other_rate_law"),
    _over(50, "joint_angle", _JOINT, "friction_angle_law", "joint_rate"),
    _over(60, "other_rate", _JOINT, "friction_other_rate_law", "joint_rate"),
    _over(70, "joint_angle", _GROUND, "ground_angle_law"),
    _over(80, "joint_rate", _GROUND, "ground_rate_law"),
    _over(90, "other_angle", _GROUND, "ground_other_angle_law"),
    _over(100, "rotor_rate", _MOTOR, "motor_rate_law"),
    _over(110, "joint_angle", _MOTOR, "motor_friction_angle_law", "rotor_rate"),
    _over(120, "other_rate", _MOTOR, "motor_friction_other_rate_law", "rotor_rate"),
)

EFFECTS: tuple[Effect, ...] = tuple(law.effect for law in MEASURED)
