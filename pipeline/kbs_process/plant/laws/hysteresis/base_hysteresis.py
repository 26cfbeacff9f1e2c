"""Hysteresis of the mounting: bolted joints that slip by microns, plates that rub, before they hold again."""

from __future__ import annotations

import math

from kbs_process.plant.effect import Effect, LogNormal, Normal, Parameter, Port, State


def moment(
    base_rate_x: float,
    base_rate_y: float,
    base_rate_z: float,
    base_slip_x: float,
    base_slip_y: float,
    base_slip_z: float,
    base_loop_x: float,
    base_loop_y: float,
    base_loop_z: float,
    base_slip_angle: float,
    base_slip_power: float,
) -> tuple[float, float, float, float, float, float]:
    r"""Moment of the mounting on the plate, about each axis by what the plate has turned about it.

    Equation: $M_i = -M_{s,i} z_i$,
        $\dot z_i = (\dot\alpha_i - \frac{1}{2} |z_i|^{n-1} (|\dot\alpha_i| z_i + \dot\alpha_i |z_i|)) / \alpha_s$
        for i = x, y, z.
    Units: rad/s, 1, N m, rad, 1 -> N m, 1/s.
    Validity: does not depend on rate; |z| <= 1; n >= 1, from asperities that yield one after the other to a single
        stop; no axis acts on another. Elastic after each reversal until z = 0. The greatest rate in a step has to stay
        below the angle of slip, and the stiffness before it, $M_{s,i} / \alpha_s$, within what the step resolves.
    Source: Y. K. Wen, Method for random vibration of hysteretic systems, J. Engineering Mechanics Division ASCE 102
        (1976) 249, with equal shape factors; L. Gaul, R. Nitsche, The role of friction in mechanical joints, Applied
        Mechanics Reviews 54 (2001) 93.
    """
    return (
        -base_loop_x * base_slip_x,
        -base_loop_y * base_slip_y,
        -base_loop_z * base_slip_z,
        _slipping(base_rate_x, base_slip_x, base_slip_power) / base_slip_angle,
        _slipping(base_rate_y, base_slip_y, base_slip_power) / base_slip_angle,
        _slipping(base_rate_z, base_slip_z, base_slip_power) / base_slip_angle,
    )


def _slipping(rate: float, slip: float, power: float) -> float:
    deflection = abs(slip)
    yielded = 0.5 * math.exp((power - 1.0) * math.log(max(deflection, 1e-9)))
    return rate - yielded * (abs(rate) * slip + rate * deflection)


_PRIOR, _BOUNDS = Normal(0.0, 0.2), (-100.0, 100.0)

BASE_HYSTERESIS = Effect(
    name="base_hysteresis",
    order=460,
    port=Port.BASE_TORQUE,
    equation=moment,
    parameters=(
        Parameter("base_loop_x", "N m", _PRIOR, "half height of the loop about x", _BOUNDS, role="amplitude", dry=True),
        Parameter("base_loop_y", "N m", _PRIOR, "about y", _BOUNDS, role="amplitude", dry=True),
        Parameter("base_loop_z", "N m", _PRIOR, "about z", _BOUNDS, role="amplitude", dry=True),
        Parameter(
            "base_slip_angle",
            "rad",
            LogNormal(2e-5, 1.0),
            "angle over which it yields, had it stayed elastic",
            (1e-6, 1e-3),
            grid=tuple(3e-6 * 2.4**i for i in range(5)),
        ),
        Parameter("base_slip_power", "1", LogNormal(1.5, 0.3), "sharpness of yielding", (1.0, 5.0), grid=(1.5, 3.0)),
    ),
    reference="Y. K. Wen, Method for random vibration of hysteretic systems, J. Engineering Mechanics Division ASCE "
    "102 (1976) 249",
    states=(
        State("base_slip_x", "1", 0.0, "share of the loop's half height about x"),
        State("base_slip_y", "1", 0.0, "about y"),
        State("base_slip_z", "1", 0.0, "about z"),
    ),
)
