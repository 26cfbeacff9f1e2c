"""Laws that were measured and have no name: a torque over a joint's angle or rate, as a spline's coefficients."""

from __future__ import annotations

from kbs_process.plant.effect import Effect, Normal, Parameter, Port

COEFFICIENTS = 10
INTERVALS = COEFFICIENTS - 3


def weight(u: float) -> float:
    """Cardinal cubic B-spline, 2/3 at u = 0, zero beyond 2: its shifts by whole numbers add up to one."""
    outer = max(0.0, 2.0 - abs(u))
    inner = max(0.0, 1.0 - abs(u))
    return (outer * outer * outer - 4.0 * inner * inner * inner) / 6.0


def spline(
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
    r"""Cubic spline over `INTERVALS` equal intervals from `low` to `high`, held beyond them.

    Equation: $f(x) = \sum_k c_k B(u - k + 1)$, $u = 7 (x - x_0) / (x_1 - x_0)$ within 0 and 7; with equal c it is c.
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


def joint_over_angle(
    joint_angle: float,
    angle_law_0: float,
    angle_law_1: float,
    angle_law_2: float,
    angle_law_3: float,
    angle_law_4: float,
    angle_law_5: float,
    angle_law_6: float,
    angle_law_7: float,
    angle_law_8: float,
    angle_law_9: float,
    angle_law_low: float,
    angle_law_high: float,
) -> float:
    r"""Torque on the output, reacted by the body that carries the motor, over the joint's angle.

    Equation: $T = \sum_k c_k B_k(\theta_l)$, $B_k$ cubic B-splines on equal intervals.
    Units: rad, N m (ten), rad, rad -> N m.
    Validity: between the two angles, where it was measured; held beyond them.
    Source: C. de Boor, A Practical Guide to Splines (2001), chapter IX.
    """
    return spline(
        joint_angle, angle_law_low, angle_law_high, angle_law_0, angle_law_1, angle_law_2, angle_law_3, angle_law_4,
        angle_law_5, angle_law_6, angle_law_7, angle_law_8, angle_law_9,
    )  # fmt: skip


def joint_over_rate(
    joint_rate: float,
    rate_law_0: float,
    rate_law_1: float,
    rate_law_2: float,
    rate_law_3: float,
    rate_law_4: float,
    rate_law_5: float,
    rate_law_6: float,
    rate_law_7: float,
    rate_law_8: float,
    rate_law_9: float,
    rate_law_low: float,
    rate_law_high: float,
) -> float:
    r"""Torque on the output, reacted by the body that carries the motor, over the joint's rate.

    Equation: $T = \sum_k c_k B_k(\omega_l)$, $B_k$ cubic B-splines on equal intervals.
    Units: rad/s, N m (ten), rad/s, rad/s -> N m.
    Validity: between the two rates, where it was measured; held beyond them. A jump at rest is rounded to an interval.
    Source: C. de Boor, A Practical Guide to Splines (2001), chapter IX.
    """
    return spline(
        joint_rate, rate_law_low, rate_law_high, rate_law_0, rate_law_1, rate_law_2, rate_law_3, rate_law_4,
        rate_law_5, rate_law_6, rate_law_7, rate_law_8, rate_law_9,
    )  # fmt: skip


def ground_over_angle(
    joint_angle: float,
    ground_angle_law_0: float,
    ground_angle_law_1: float,
    ground_angle_law_2: float,
    ground_angle_law_3: float,
    ground_angle_law_4: float,
    ground_angle_law_5: float,
    ground_angle_law_6: float,
    ground_angle_law_7: float,
    ground_angle_law_8: float,
    ground_angle_law_9: float,
    ground_angle_law_low: float,
    ground_angle_law_high: float,
) -> float:
    r"""Torque on the output, reacted by the laboratory, over the joint's angle.

    Equation: $T = \sum_k c_k B_k(\theta_l)$, $B_k$ cubic B-splines on equal intervals.
    Units: rad, N m (ten), rad, rad -> N m.
    Validity: between the two angles, where it was measured; held beyond them.
    Source: C. de Boor, A Practical Guide to Splines (2001), chapter IX.
    """
    return spline(
        joint_angle, ground_angle_law_low, ground_angle_law_high, ground_angle_law_0, ground_angle_law_1,
        ground_angle_law_2, ground_angle_law_3, ground_angle_law_4, ground_angle_law_5, ground_angle_law_6,
        ground_angle_law_7, ground_angle_law_8, ground_angle_law_9,
    )  # fmt: skip


def ground_over_rate(
    joint_rate: float,
    ground_rate_law_0: float,
    ground_rate_law_1: float,
    ground_rate_law_2: float,
    ground_rate_law_3: float,
    ground_rate_law_4: float,
    ground_rate_law_5: float,
    ground_rate_law_6: float,
    ground_rate_law_7: float,
    ground_rate_law_8: float,
    ground_rate_law_9: float,
    ground_rate_law_low: float,
    ground_rate_law_high: float,
) -> float:
    r"""Torque on the output, reacted by the laboratory, over the joint's rate.

    Equation: $T = \sum_k c_k B_k(\omega_l)$, $B_k$ cubic B-splines on equal intervals.
    Units: rad/s, N m (ten), rad/s, rad/s -> N m.
    Validity: between the two rates, where it was measured; held beyond them. A jump at rest is rounded to an interval.
    Source: C. de Boor, A Practical Guide to Splines (2001), chapter IX.
    """
    return spline(
        joint_rate, ground_rate_law_low, ground_rate_law_high, ground_rate_law_0, ground_rate_law_1,
        ground_rate_law_2, ground_rate_law_3, ground_rate_law_4, ground_rate_law_5, ground_rate_law_6,
        ground_rate_law_7, ground_rate_law_8, ground_rate_law_9,
    )  # fmt: skip


REFERENCE = "C. de Boor, A Practical Guide to Splines (2001), chapter IX"


def _numbers(prefix: str, unit: str, farthest: float) -> tuple[Parameter, ...]:
    coefficients = tuple(
        Parameter(
            f"{prefix}_{k}",
            "N m",
            Normal(0.0, 1.0),
            "about the torque at that node of the table, the first and the last one outside it",
            (-1e4, 1e4),
            role="amplitude",
        )
        for k in range(COEFFICIENTS)
    )
    ends = (("low", -1.0), ("high", 1.0))
    return coefficients + tuple(
        Parameter(
            f"{prefix}_{end}", unit, Normal(sign, 1.0), "end of what was measured", (-farthest, farthest)
        )
        for end, sign in ends
    )


_OVER_ANGLE, _OVER_RATE = ("rad", 1e2), ("rad/s", 1e2)

JOINT_ANGLE_LAW = Effect(
    "joint_angle_law", Port.JOINT_TORQUE, joint_over_angle, _numbers("angle_law", *_OVER_ANGLE), REFERENCE
)
JOINT_RATE_LAW = Effect(
    "joint_rate_law", Port.JOINT_TORQUE, joint_over_rate, _numbers("rate_law", *_OVER_RATE), REFERENCE
)
GROUND_ANGLE_LAW = Effect(
    "ground_angle_law",
    Port.GROUND_TORQUE,
    ground_over_angle,
    _numbers("ground_angle_law", *_OVER_ANGLE),
    REFERENCE,
)
GROUND_RATE_LAW = Effect(
    "ground_rate_law",
    Port.GROUND_TORQUE,
    ground_over_rate,
    _numbers("ground_rate_law", *_OVER_RATE),
    REFERENCE,
)
