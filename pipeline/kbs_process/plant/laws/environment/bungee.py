"""Elastic cord that carries part of the article's weight: a rig effect of the zero-g kit."""

from __future__ import annotations

import math

from kbs_process.plant.effect import Effect, LogNormal, Normal, Parameter, Port, amplitude


def force(
    x: float,
    y: float,
    z: float,
    stiffness: float,
    free_length: float,
    anchor_x: float,
    anchor_y: float,
    anchor_z: float,
) -> tuple[float, float, float]:
    r"""Force on the point at (x, y, z), towards the anchor: a spring that pulls and never pushes.

    Equation: with r the way from the point to the anchor and l its length,
        $F = k \max(l - l_0, 0)\, r / l$. As the point goes sideways by s the cord swings, and pulls back with
        about $F s / l$: a pendulum of its length.
    Units: m, N/m, m -> N; all along the undeflected T's axes.
    Validity: l > 0; a cord without mass, damping and hysteresis, straight, its anchor at rest in the laboratory.
    Source: Hooke's law; ENVISAT Ka-band subsystem: Measurement and prediction of the performance of a satellite based
        antenna pointing mechanism and controller, Trans. Built Environment 19 (1996), section 7, configurations 3
        and 4.
    """
    rx, ry, rz = anchor_x - x, anchor_y - y, anchor_z - z
    length = math.sqrt(rx * rx + ry * ry + rz * rz)
    pull = stiffness * max(length - free_length, 0.0) / length
    return pull * rx, pull * ry, pull * rz


BUNGEE = Effect(
    "bungee",
    Port.EXTERNAL_FORCE,
    force,
    (
        amplitude("stiffness", "N/m", LogNormal(60.0, 0.3), "of the cord", (0.0, 1e5)),
        Parameter("free_length", "m", Normal(0.7, 0.2), "of the cord when slack", (0.0, 100.0)),
        Parameter("anchor_x", "m", Normal(0.0, 0.5), "cord's upper end, along T's x axis", (-100.0, 100.0)),
        Parameter("anchor_y", "m", Normal(0.0, 0.5), "along T's y axis", (-100.0, 100.0)),
        Parameter("anchor_z", "m", Normal(2.0, 1.0), "along T's z axis", (-100.0, 100.0), grid=(1.5, 3.2)),
    ),
    anywhere=True,
    family="bungee",
    order=410,
)
