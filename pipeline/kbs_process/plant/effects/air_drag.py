"""Drag of the air on a turning antenna."""

from __future__ import annotations

from kbs_process.plant.effect import Effect, Normal, Parameter, Port


def torque(joint_rate: float, air_drag: float) -> float:
    r"""Torque on the output, reacted by the laboratory.

    Equation: $T = -c |\omega_l| \omega_l$, with $c = \rho/2 \int c_d r^3 dA$.
    Units: rad/s, N m s^2/rad^2 -> N m.
    Validity: turbulent flow, still air. An antenna of 1 m has some 0.05 N m s^2: 2e-5 N m at 1 deg/s.
    Source: S. F. Hoerner, Fluid-Dynamic Drag (1965), chapter 3.
    """
    return -air_drag * abs(joint_rate) * joint_rate


AIR_DRAG = Effect(
    name="air_drag",
    port=Port.GROUND_TORQUE,
    equation=torque,
    parameters=(
        Parameter(
            "air_drag",
            "N m s^2/rad^2",
            Normal(0.0, 1.0),
            "coefficient of drag",
            (-1e4, 1e4),
            role="amplitude",
        ),
    ),
    reference="S. F. Hoerner, Fluid-Dynamic Drag (1965), chapter 3",
    passive=True,
)
