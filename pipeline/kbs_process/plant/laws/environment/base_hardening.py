"""Mounting whose stiffness changes with the angle: elastomers and washers that are pressed flat, joints that gape."""

from __future__ import annotations

import math

from kbs_process.plant.effect import Effect, LogNormal, Normal, Parameter, Port, amplitude

ANGLE = 1e-3  # rad of reference: what weight makes the plate sag by
_LEAST = 1e-6  # of it, below which the moment is in proportion to the angle


def moment(
    base_x: float,
    base_y: float,
    base_z: float,
    base_hardening_x: float,
    base_hardening_y: float,
    base_hardening_z: float,
    base_hardening_power: float,
) -> tuple[float, float, float]:
    r"""Moment of the mounting on the plate beyond that of linear springs, by a power of each angle.

    Equation: $M_i = -H_i |\alpha_i / \alpha_0|^{n-1} \alpha_i / \alpha_0$ for i = x, y, z, $\alpha_0$ = 1 mrad.
    Units: rad, N m, 1 -> N m.
    Validity: n = 1 is the transducer's own stiffness, n = 3 Duffing's spring, n = 3/2 Hertz's contact. A mounting that
        softens ($H_i < 0$) holds as long as $n |M_i|$ is less than the linear springs' moment.
    Source: R. D. Mindlin, Dynamics of package cushioning, Bell System Technical J. 24 (1945) 353; K. L.
        Johnson, Contact Mechanics (1985), chapter 4.
    """
    return (
        -base_hardening_x * _power(base_x, base_hardening_power),
        -base_hardening_y * _power(base_y, base_hardening_power),
        -base_hardening_z * _power(base_z, base_hardening_power),
    )


def _power(angle: float, power: float) -> float:
    share = angle / ANGLE
    return share * math.exp((power - 1.0) * math.log(max(abs(share), _LEAST)))


BASE_HARDENING = Effect(
    "base_hardening",
    Port.BASE_TORQUE,
    moment,
    (
        amplitude("base_hardening_x", "N m", Normal(0.0, 0.5), "moment at 1 mrad about x", 1e3),
        amplitude("base_hardening_y", "N m", Normal(0.0, 0.5), "about y", 1e3),
        amplitude("base_hardening_z", "N m", Normal(0.0, 0.5), "about z", 1e3),
        Parameter(
            "base_hardening_power", "1", LogNormal(3.0, 0.3), "power of the angle", (1.2, 9.0), grid=(2.0, 3.0, 5.0)
        ),
    ),
    family="stiffness",
    order=450,
)
