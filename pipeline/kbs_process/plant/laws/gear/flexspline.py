"""Elasticity and damping of the Harmonic Drive's flexspline."""

from __future__ import annotations

from kbs_process.plant.effect import Effect, LogNormal, Parameter, Port, critical


def torque(
    rotor_angle: float, rotor_rate: float, joint_angle: float, joint_rate: float, ratio: float, fsv: float, Ka: float
) -> float:
    r"""Torque of the gear on the output.

    Equation: $T = f_{sv} (\omega_r/R - \omega_l) + K_a (\theta_r/R - \theta_l)$.
    Units: rad, rad/s, rad, rad/s, 1, N m s/rad, N m/rad -> N m.
    Validity: below the torque at which the stiffness of a Harmonic Drive rises; no hysteresis.
    Source: ENVISAT Ka-band subsystem: Measurement and prediction of the performance of a satellite based antenna
        pointing mechanism and controller, Trans. Built Environment 19 (1996), section 5, damping and stiffness of the
        gearbox.
    """
    return fsv * (rotor_rate / ratio - joint_rate) + Ka * (rotor_angle / ratio - joint_angle)


FLEXSPLINE = Effect(
    "flexspline",
    Port.TRANSMISSION,
    torque,
    (
        critical(Parameter("fsv", "N m s/rad", LogNormal(15.0, 0.2), "structural damping", (0.0, 1e4))),
        critical(Parameter("Ka", "N m/rad", LogNormal(1e4, 0.1), "torsional stiffness", (1.0, 1e7))),
    ),
    order=60,
)
