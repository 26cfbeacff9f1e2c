"""Flexible appendage of a link: a mode of its own that the link's rotation excites."""

from __future__ import annotations

import math

from kbs_process.plant.effect import Effect, LogNormal, Normal, Parameter, Port, State, amplitude


def torque(
    joint_rate: float, sway: float, sway_rate: float, sway_inertia: float, sway_frequency: float, sway_damping: float
) -> tuple[float, float, float]:
    r"""Torque of the appendage on its link about the joint's axis; what reacts it is the appendage's own momentum.

    Equation: $T = J (\Omega^2 a + 2 \zeta \Omega \dot a)$, $\dot a = b - \omega_l$, $\dot b = -T / J$,
        $\Omega = 2 \pi f$: a is its angle against the link, b its rate. Far below f it is an
        inertia more: $T = -J \dot\omega_l$.
    Units: rad/s, rad, rad/s, kg m^2, Hz, 1 -> N m, rad/s, rad/s^2.
    Validity: one mode about the joint's axis, small angles, no sag; the link turns with respect to a body almost at
        rest. Its mass is counted in the link's, its inertia is not.
    Source: P. W. Likins, Dynamics and control of flexible space vehicles, JPL Technical Report 32-1329 (1970).
    """
    pulsation = 2.0 * math.pi * sway_frequency
    specific = pulsation * pulsation * sway + 2.0 * sway_damping * pulsation * (sway_rate - joint_rate)
    return sway_inertia * specific, sway_rate - joint_rate, -specific


APPENDAGE = Effect(
    "appendage",
    Port.GROUND_TORQUE,
    torque,
    (
        amplitude("sway_inertia", "kg m^2", Normal(0.0, 0.1), "inertia of the mode", (0.0, 10.0)),
        Parameter(
            "sway_frequency",
            "Hz",
            LogNormal(2.0, 0.7),
            "its frequency on a link at rest",
            (0.05, 50.0),
            grid=tuple(0.3 * 1.25**i for i in range(17)),
            proposed="tone",
        ),
        Parameter("sway_damping", "1", LogNormal(0.01, 0.7), "its damping ratio", (0.0, 1.0), grid=(0.005, 0.03)),
    ),
    states=(State("sway", "rad", 0.0, "angle against the link"), State("sway_rate", "rad/s", 0.0, "rate")),
    of_article=True,
    apart="appendage",
    family="appendage",
    order=400,
)
