"""A curved spring with friction between its wires: a harness or a drum across a joint, a cable of the laboratory."""

from __future__ import annotations

import math

from kbs_process.plant.effect import Effect, LogNormal, Normal, Parameter, Port, State, amplitude, wired


def torque(
    joint_angle: float,
    joint_rate: float,
    bend: float,
    offset: float,
    spring: float,
    curve: float,
    cubic: float,
    taut: float,
    friction: float,
    middle: float,
    reach: float,
    memory: float,
) -> tuple[float, float]:
    r"""Torque on the output, reacted by the body that carries the motor, or by the laboratory.

    Equation: with $u = \theta_l - \theta_m$, $T = T_0 - k u - k_2 u^2 - k_3 u^3 - T_s \tanh(u / u_s) - T_h z$,
        $\dot z = (\omega_l - |\omega_l| z) / x_0$.
    Units: rad, rad/s, 1, N m, N m/rad, N m/rad^2, N m/rad^3, N m (two), rad (three) -> N m, 1/s.
    Validity: across a joint it is internal, so it shows in the windup and leaves no wrench of its own; from the
        laboratory its force beside the torque about the joint's axis is left out. The series holds where the joint has
        been.
    Source: Y. K. Wen, Method for random vibration of hysteretic systems, J. Engineering Mechanics Division ASCE 102
        (1976) 249, with exponent 1 and equal shape factors, which is Dahl's law.
    """
    bent = joint_angle - middle
    whole = offset - bent * (spring + bent * (curve + bent * cubic))
    whole = whole - taut * math.tanh(bent / reach)
    rate = (joint_rate - abs(joint_rate) * bend) / memory
    return whole - friction * bend, rate


def _cable(name: str, stem: str, port: Port, family: str, order: int) -> Effect:
    parameters = (
        amplitude(f"{stem}_offset", "N m", Normal(0.0, 1.0), "torque in the middle", 100.0),
        amplitude(f"{stem}_spring", "N m/rad", Normal(0.0, 3.0), "stiffness", 1e3),
        amplitude(f"{stem}_curve", "N m/rad^2", Normal(0.0, 3.0), "its slope", 1e4),
        amplitude(f"{stem}_cubic", "N m/rad^3", Normal(0.0, 10.0), "its curvature", 1e5),
        amplitude(f"{stem}_taut", "N m", Normal(0.0, 1.0), "at which it yields", 100.0),
        amplitude(f"{stem}_friction", "N m", Normal(0.0, 0.5), "between its wires", 100.0, dry=True),
        Parameter(
            f"{stem}_middle",
            "rad",
            Normal(0.0, 3.0),
            "angle of the series, and where it yields",
            (-1e2, 1e2),
            grid=(0.2, 0.5, 0.8),
            over="joint_angle",
        ),
        Parameter(
            f"{stem}_reach",
            "rad",
            LogNormal(0.3, 1.0),
            "angle over which it yields",
            (1e-4, 30.0),
            grid=(0.05, 0.2),
            over="joint_angle.span",
        ),
        Parameter(
            f"{stem}_memory",
            "rad",
            LogNormal(0.05, 1.0),
            "angle after a reversal over which friction builds up",
            (1e-4, 3.0),
            grid=(0.01, 0.05, 0.2),
        ),
    )
    states = (State(f"{stem}_bend", "1", 0.0, "share of the friction that is built up"),)
    own = [entry.name for entry in (*states, *parameters)]
    wires = wired(**{name.removeprefix(f"{stem}_"): name for name in own})
    return Effect(name, port, torque, parameters, states=states, wires=wires, family=family, order=order)


HARNESS = _cable("harness", "harness", Port.JOINT_TORQUE, "harness", 310)
GROUND_CABLE = _cable("ground_cable", "cable", Port.GROUND_TORQUE, "cable", 360)
