"""Drag of still air on an area of a link, whichever joint moves it."""

from __future__ import annotations

import math

from kbs_process.plant.effect import Effect, LogNormal, Normal, Parameter, Port, amplitude

SPEED = 0.01  # m/s of reference: 0.3 m from an axis at 2 deg/s
_LEAST = 1e-6  # of it, below which the force is in proportion to the velocity


def force(vx: float, vy: float, vz: float, air_drag: float, air_drag_power: float) -> tuple[float, float, float]:
    r"""Force on the centre of the area, against its velocity, along the undeflected T's axes.

    Equation: $F = -D (|v| / v_0)^{n-1}\, v / v_0$, $v_0$ = 0.01 m/s.
    Units: m/s, N, 1 -> N.
    Validity: still air, an area small beside its distance from the axes, n >= 1. Drag of form has n = 2 and
        $D = \rho/2\, c_d A v_0^2$, 7e-5 N of a plate of 1 m^2; of skin n = 1.5 (laminar) to 1.8.
    Source: S. F. Hoerner, Fluid-Dynamic Drag (1965), chapters 2 and 3.
    """
    share = math.sqrt(vx * vx + vy * vy + vz * vz) / SPEED
    slope = -air_drag / SPEED * math.exp((air_drag_power - 1.0) * math.log(max(share, _LEAST)))
    return slope * vx, slope * vy, slope * vz


AIR_DRAG = Effect(
    "air_drag",
    Port.EXTERNAL_FORCE,
    force,
    (
        amplitude("air_drag", "N", Normal(0.0, 0.1), "drag at 0.01 m/s", (0.0, 100.0)),
        Parameter("air_drag_power", "1", LogNormal(2.0, 0.15), "power of the speed", (1.0, 3.0)),
    ),
    passive=True,
    anywhere=True,
    family="air drag",
    order=390,
)
