"""Friction of a joint by bristles that bend, with a Stribeck curve: the LuGre model."""

from __future__ import annotations

import math

from kbs_process.plant.effect import Effect, LogNormal, Normal, Parameter, Port, State, amplitude


def torque(
    joint_rate: float, bristle: float, lugre: float, lugre_displacement: float, lugre_excess: float, lugre_rate: float
) -> tuple[float, float]:
    r"""Torque on the output, reacted by the body that carries the motor.

    Equation: $T = -T_c z$, $\dot z = (\omega_l - |\omega_l| z / g) / x_0$,
        $g = 1 + s e^{-(\omega_l/\omega_s)^2}$; in the usual symbols $\sigma_0 = T_c / x_0$.
    Units: rad/s, 1, N m, rad, 1, rad/s -> N m, 1/s.
    Validity: without the bristles' own damping; the viscous part is `joint_viscous`. The greatest rate in a step has to
        stay below x0.
    Source: C. Canudas de Wit, H. Olsson, K. J. Astrom, P. Lischinsky, A new model for control of systems with friction,
        IEEE Trans. Automatic Control 40 (1995) 419.
    """
    share = joint_rate / lugre_rate
    level = 1.0 + lugre_excess * math.exp(-share * share)
    return -lugre * bristle, (joint_rate - abs(joint_rate) * bristle / level) / lugre_displacement


LUGRE = Effect(
    "lugre",
    Port.JOINT_TORQUE,
    torque,
    (
        amplitude("lugre", "N m", Normal(0.0, 0.5), "Coulomb torque", 100.0, dry=True),
        Parameter(
            "lugre_displacement",
            "rad",
            LogNormal(1e-3, 1.0),
            "bristles' deflection under the Coulomb torque",
            (1e-5, 5e-3),
            grid=(2e-4, 1e-3),
        ),
        Parameter(
            "lugre_excess",
            "1",
            LogNormal(0.5, 0.5),
            "excess at breakaway over the Coulomb torque",
            (0.0, 10.0),
            grid=(0.3, 1.0),
        ),
        Parameter(
            "lugre_rate",
            "rad/s",
            LogNormal(3e-3, 1.0),
            "rate at which the excess has fallen to 1/e",
            (1e-5, 10.0),
            grid=(1e-3, 5e-3),
        ),
    ),
    states=(State("bristle", "1", 0.0, "bristles' deflection over that under the Coulomb torque"),),
    family="friction",
    order=300,
)
